#pragma once

#include <limits>
#include <optional>
#include <stop_token>

#include "bench/studies/cells.hpp"
#include "bench/studies/expectation.hpp"
#include "bench/studies/score.hpp"

namespace splid::studies {

// Delays further off than this are another peak's: five pulse widths, or eight times the bound
// where that is wider.
double wrong_peak_limit_ns(const Expectation& expectation);

// Runs a job's trials, or as many of them as begin within longest_s of the thread's own time; one
// at least. Each draws its photons, and its delay and its velocity where the cell leaves these
// open, from a seed of its scene and number: the same frames for every estimator, on every machine
// with the same standard library.
//
// Null if a stop was requested before the last trial. Threads: any, objects shared are const.
std::optional<Score> run_job(const Job& job, const Expectation& expectation,
                             const std::stop_token& stop,
                             double longest_s = std::numeric_limits<double>::infinity());

}  // namespace splid::studies
