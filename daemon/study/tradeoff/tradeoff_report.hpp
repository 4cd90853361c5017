#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "config/config.hpp"
#include "daemon/study/tradeoff/tradeoff.hpp"

namespace splid {

// A measured curve for people and programs.

// What the errors are measured against.
enum class ErrorsAgainst { scene, truth_file, neighbours };

ErrorsAgainst errors_against(const FrameOrigin& origin);

// In a sentence, and in a few words.
std::string in_words(ErrorsAgainst reference);
std::string short_name(ErrorsAgainst reference);

struct TradeoffReport {
  std::span<const TradeoffRow> rows;
  ErrorsAgainst reference = ErrorsAgainst::scene;
  std::string title;            // of the plot: the scene in a few words
  EstimatorOptions configured;  // decides between settings that cost the same
  double configured_length_ms = 50;
  std::optional<double> budget_ms;      // for one frame
  std::optional<double> stopped_in_ms;  // length of frames whose settings are not all measured
};

// The knee of a length; absent too where not all of its settings are measured.
std::optional<std::size_t> knee_of(const TradeoffReport& report, double length_ms);

// The row to take: what the budget allows if there is one, otherwise the knee of the measured
// length that is nearest to the configured one.
std::optional<std::size_t> chosen_row(const TradeoffReport& report);

// The table, a piece at a time, each without its last line feed: what the errors are and the names
// of the columns, a row, and what comes after the last row of a length.
std::string table_head(ErrorsAgainst reference);
std::string table_line(const TradeoffRow& row);
std::string knee_line(const TradeoffReport& report, double length_ms);

// One JSON object, "schema" first; what is not known is left out.
std::string tradeoff_json(const TradeoffReport& report, std::size_t row);

// The same members as columns under a line of their names; what is not known is empty.
std::string tradeoff_csv(const TradeoffReport& report);

// Why there is no chosen row, where there is none.
std::string no_choice_reason(const TradeoffReport& report);

// Which setting to take, and its configuration lines; or why none.
std::string tradeoff_advice(const TradeoffReport& report);

// "interleaved, 40 pulses in 3780 ns; S 0.00135 a pulse, b 175000 /s, target at 284.5 m" for a
// scene, the file's name and the pattern for a recording.
std::string tradeoff_title(const Config& config, const FrameOrigin& origin);

}  // namespace splid
