#pragma once

#include <filesystem>
#include <string>

#include "bench/studies/results.hpp"
#include "daemon/study/svg_chart.hpp"

namespace splid::studies {

// The figure of a study: RMSE against the bound for the four values, and the share of frames
// without a right one. No panels where the study has no results.
Chart figure(const Results& results, Study study);

// All tables as Markdown. figures: where the SVG files lie, as a link from the table sees it.
std::string tables(const Results& results, const std::string& figures);

// Reads a folder's results and writes the tables into `table`, and figN.svg into the folder
// studies/ beside it. Errors: as read_results(); Error(Fault::data) where there are none;
// Error(Fault::device) where a file cannot be written.
void write_report(const std::filesystem::path& folder, const std::filesystem::path& table);

}  // namespace splid::studies
