#pragma once

#include <filesystem>
#include <string>

#include "bench/studies/results.hpp"

namespace splid::studies {

// All tables as Markdown. figures: where the SVG files lie, as a link from the table sees it.
std::string tables(const Results& results, const std::string& figures);

// Reads a folder's results and writes the tables into `table`, with links to the figures that
// `python3 -m splid.plots study` draws into the folder studies/ beside it. Errors: as
// read_results(); Error(Fault::data) where there are none; Error(Fault::device) where a file cannot
// be written.
void write_report(const std::filesystem::path& folder, const std::filesystem::path& table);

}  // namespace splid::studies
