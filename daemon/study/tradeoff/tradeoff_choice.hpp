#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "daemon/study/tradeoff/tradeoff.hpp"

namespace splid {

// Which of the rows to take; index into them, absent where none will do. Never one of the paper's
// method, which is measured for comparison, and none of fewer frames than these.

// Errors of this many frames, on no wrong peak, give an RMSE to 16 %; of four it is chance.
constexpr std::size_t fewest_frames_to_choose = 20;

// Frames that a row's RMSE is made of.
std::size_t frames_of_rmse(const TradeoffRow& row);

// The knee of a length's curve: the cheapest setting, by its median time, that loses as few frames
// (on a wrong peak or without a value) as any other and whose RMSE, of distance and of velocity, is
// within 2 % of the best such. Of settings within 10 % of that time the configured one, if it is
// among them: what costs the same is no reason to change. Tracked settings only where the
// configured one is: the last digits of a tracked frame depend on those before it, which a replay
// that starts elsewhere does not repeat, so that is to be chosen, or asked for by a budget.
std::optional<std::size_t> find_knee(std::span<const TradeoffRow> rows, double length_ms,
                                     const EstimatorOptions& configured);

// The most accurate setting of any length that is done within the budget, and within the length of
// its frame, in 99 of 100 frames: the one that loses the smallest share of frames and of those the
// one with the smallest RMSE, or, within 2 % of that, the smallest time. RMSE is the product of
// distance's and velocity's, so that ten percent in either count alike.
std::optional<std::size_t> find_within_budget(std::span<const TradeoffRow> rows, double budget_ms);

// The setting as lines of a configuration file.
std::string configuration_lines(const TradeoffSetting& setting);

}  // namespace splid
