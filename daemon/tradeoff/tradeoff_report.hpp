#pragma once

#include <optional>
#include <span>
#include <string>

#include "config/config.hpp"
#include "daemon/svg_chart.hpp"
#include "daemon/tradeoff/tradeoff.hpp"

namespace splid {

// A measured curve for people and programs.

// What the errors are measured against.
enum class ErrorsAgainst { scene, truth_file, neighbours };

ErrorsAgainst errors_against(const FrameOrigin& origin);

// In a sentence.
std::string describe(ErrorsAgainst reference);

struct TradeoffReport {
  std::span<const TradeoffRow> rows;
  ErrorsAgainst reference = ErrorsAgainst::scene;
  std::string title;                // of the plot: the scene in a few words
  EstimatorOptions configured;      // decides between settings that cost the same
  std::optional<double> budget_ms;  // for one frame
};

// A line a setting under two of headings; the knee of each length is marked with *, what the budget
// allows with <.
std::string tradeoff_table(const TradeoffReport& report);

// One JSON object a line, "schema" first; what is not known is left out.
std::string tradeoff_json(const TradeoffReport& report);

// The same members as columns under a line of their names; what is not known is empty.
std::string tradeoff_csv(const TradeoffReport& report);

// RMSE over bound of distance and of velocity and the share of wrong peaks against the time a
// frame, medians with whiskers up to the 99th percentile; a series joins the lengths of a setting.
Chart tradeoff_chart(const TradeoffReport& report);

// Which setting to take, and its configuration lines.
std::string tradeoff_advice(const TradeoffReport& report, double configured_length_ms);

// "interleaved, 40 pulses in 3780 ns; S 0.00135 a pulse, b 175000 /s, target at 284.5 m" for a
// scene, the file's name and the pattern for a recording.
std::string tradeoff_title(const Config& config, const FrameOrigin& origin);

}  // namespace splid
