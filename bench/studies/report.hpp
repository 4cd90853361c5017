#pragma once

#include <filesystem>
#include <string>

#include "bench/studies/results.hpp"

namespace splid::studies {

// Pages as Markdown: up to where each method holds, in three tables; every cell of [P]'s figures,
// with their pictures; and the studies that [P] does not have.
//
// figures: where the SVG files lie, as a link from the page sees it.
std::string reader_page(const Results& results);
std::string figures_page(const Results& results, const std::string& figures);
std::string beyond_page(const Results& results, const std::string& figures);

// Reads a folder's results and writes the pages: `table`, and beside it two more, whose names end
// in -figures and -beyond. They link to the figures that `python3 -m splid.plots study` draws into
// the folder studies/ beside them.
// Errors: as read_results(); Error(Fault::data) where there are none; Error(Fault::device) where a
// file cannot be written.
void write_report(const std::filesystem::path& folder, const std::filesystem::path& table);

}  // namespace splid::studies
