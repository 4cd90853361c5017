#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "daemon/study/tradeoff/tradeoff.hpp"

namespace splid::tradeoff {

// Choosing a row of a measured tradeoff. The functions return the row's index, or nothing where no
// row will do. They never choose a row of the paper's method, which is measured only for
// comparison, or one with other findings than the configuration has, since the table does not show
// what findings save from. Nor do they choose a row of fewer than fewest_frames_to_choose frames.

// So many errors, of frames on no wrong peak, give an RMSE to 16 %; from four it would be chance.
constexpr std::size_t fewest_frames_to_choose = 20;

// How many frames a row's RMSE is made of.
std::size_t frames_of_rmse(const Row& row);

// Which settings of a length may be its knee.
enum class KneeOf { all, frames_on_their_own };

// The knee of a length's curve. Only settings that lose as few frames (on a wrong peak or without a
// value) as any other count, to one frame in a hundred, and only those whose RMSE of distance and
// of velocity is within 2 % of the best. The knee is the cheapest of them by median time; but if
// the configured setting is among those that cost at most 25 % more, it is that one, since nothing
// is gained by a change; else the cheapest of these with the configured effort.
std::optional<std::size_t> find_knee(std::span<const Row> rows, double length_ms,
                                     const EstimatorOptions& configured, KneeOf of = KneeOf::all);

// The most accurate setting of any length that needs no more than the budget, and no more than the
// length of its frame, in 99 of 100 frames. Of these settings it takes those that lose as few
// frames as any other, to one frame in a hundred, of those the settings whose RMSE is within 2 % of
// the smallest, and of those the setting with the smallest time. RMSE here is the product of the
// distance's RMSE and the velocity's, so that ten percent of either count alike.
std::optional<std::size_t> find_within_budget(std::span<const Row> rows, double budget_ms,
                                              const EstimatorOptions& configured);

// The setting as lines of a configuration file.
std::string configuration_lines(const Setting& setting);

}  // namespace splid::tradeoff
