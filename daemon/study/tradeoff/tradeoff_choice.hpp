#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "daemon/study/tradeoff/tradeoff.hpp"

namespace splid::tradeoff {

// Choosing a row of a measured tradeoff. The functions return the row's index, or nothing where no
// row will do. They never choose a row of the paper's method, which is measured only for
// comparison, or a row of fewer than fewest_frames_to_choose frames.

// So many errors, of frames on no wrong peak, give an RMSE to 16 %; from four it would be chance.
constexpr std::size_t fewest_frames_to_choose = 20;

// How many frames a row's RMSE is made of.
std::size_t frames_of_rmse(const Row& row);

// The knee of a length's curve. Only settings that lose as few frames (on a wrong peak or without a
// value) as any other count, and only those whose RMSE of distance and of velocity is within 2 % of
// the best. The knee is the cheapest of them by median time; but if the configured setting is among
// those that cost at most 10 % more, it is that one, since nothing is gained by a change. A tracked
// setting is the knee only if the configured setting is tracked: the last digits of a tracked frame
// depend on the frames before it, which a replay that starts elsewhere does not repeat. So tracking
// has to be configured, or be chosen by a budget.
std::optional<std::size_t> find_knee(std::span<const Row> rows, double length_ms,
                                     const EstimatorOptions& configured);

// The most accurate setting of any length that needs no more than the budget, and no more than the
// length of its frame, in 99 of 100 frames. Of these settings it takes those that lose the smallest
// share of frames, of those the settings whose RMSE is within 2 % of the smallest, and of those the
// setting with the smallest time. RMSE here is the product of the distance's RMSE and the
// velocity's, so that ten percent of either count alike.
std::optional<std::size_t> find_within_budget(std::span<const Row> rows, double budget_ms);

// The setting as lines of a configuration file.
std::string configuration_lines(const Setting& setting);

}  // namespace splid::tradeoff
