#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "bench/studies/results.hpp"

// What the pages of docs/evidence/accuracy.md share.
namespace splid::studies {

using Rows = std::vector<const Result*>;

// A study's results in the order of full_jobs().
Rows rows_of(const Results& results, Study study);
// Those of a mode and estimator.
Rows line_of(const Rows& rows, Mode mode, Estimator estimator);

std::string x_text(const Cell& cell);  // the place on the study's axis
const char* x_name(Axis axis);
std::string percent(double share);
// "10000", or "1200 to 10000" where some cells have fewer frames.
std::string frames_text(const Rows& rows);

// Whether the RMSE over the bound, of delay (at mid-frame) and velocity, is what the study is to
// reach, times what the number of photons leaves, give or take two standard deviations.
bool in_reach(const Result& row);
// The share of frames on a wrong peak or without a value.
double lost(const Result& row);

// When and where it was run, where the cells are, and the command.
std::string provenance(const Results& results);

}  // namespace splid::studies
