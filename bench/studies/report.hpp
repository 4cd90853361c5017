#pragma once

#include <filesystem>
#include <string>

#include "bench/studies/results.hpp"

namespace splid::studies {

// Pages as Markdown: what was reached and where each method breaks, in two screens; every cell of
// [P]'s figures, with their pictures; and the studies that [P] does not have.
//
// stage_csv: the text of the lines that bench/stage.py writes; empty: the page has none of them.
// figures: where the SVG files lie, as a link from the page sees it.
std::string reader_page(const Results& results, const std::string& stage_csv);
std::string figures_page(const Results& results, const std::string& figures);
std::string beyond_page(const Results& results, const std::string& figures);

// Reads a folder's results and writes the pages: `table`, and beside it two more, whose names end
// in -figures and -beyond. They link to the figures that `python3 -m splid.plots study` draws into
// the folder studies/ beside them, and take studies/stage.csv from there if it is there.
// Errors: as read_results(); Error(Fault::data) where there are none; Error(Fault::device) where a
// file cannot be written.
void write_report(const std::filesystem::path& folder, const std::filesystem::path& table);

}  // namespace splid::studies
