#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/config.hpp"
#include "daemon/study/tradeoff/tradeoff.hpp"
#include "daemon/study/tradeoff/tradeoff_choice.hpp"

namespace splid::tradeoff {

// The report of a measured tradeoff, for people and programs.

// What the errors are measured against.
enum class ErrorsAgainst { scene, truth_file, neighbours };

ErrorsAgainst errors_against(const FrameOrigin& origin);

// The reference in a sentence, and as the word of tables and JSON.
std::string in_words(ErrorsAgainst reference);
const char* name_of(ErrorsAgainst reference);

struct Report {
  std::span<const Row> rows;
  ErrorsAgainst reference = ErrorsAgainst::scene;
  EstimatorOptions configured;  // preferred among settings that cost the same
  double configured_length_ms = 50;
  std::optional<double> budget_ms;      // processor time for one frame
  std::optional<double> stopped_in_ms;  // frame length whose settings are not all measured
};

// The knee of a length; absent where there is none and where not all settings of the length are
// measured.
std::optional<std::size_t> knee_of(const Report& report, double length_ms, KneeOf of = KneeOf::all);

// The recommended row: with a budget, the row of find_within_budget(); without a budget, the knee
// of the measured length that is nearest to the configured length. Unless tracking is configured,
// that is the knee of frames on their own: the last digits of a tracked frame depend on the frames
// before it, which a replay that starts elsewhere does not repeat.
std::optional<std::size_t> chosen_row(const Report& report);

// The table piece by piece, each without its last line feed: its head, which says what the errors
// are measured against and names the columns; a row; and the line after the last row of a length.
std::string table_head(ErrorsAgainst reference);
std::string table_line(const Row& row);
std::string knee_line(const Report& report, double length_ms);

// A row as a JSON object, with "schema" as its first member; values that are not known are left
// out.
std::string row_json(const Report& report, std::size_t row);

// The members of a row: their names, and their values as JSON, empty where they are not known.
struct Member {
  const char* name;
  std::string json;
  // The value without the quotes of JSON; no text in a row has a character that JSON escapes.
  [[nodiscard]] std::string plain() const;
};
std::vector<Member> row_members(const Report& report, std::size_t index);

// Why chosen_row() recommends no row, in a sentence; only for a report where it recommends none.
std::string no_choice_reason(const Report& report);

// The recommended setting with its configuration lines, and why it is not the knee where it is not;
// or why none is recommended.
std::string advice(const Report& report);

// For a scene "interleaved, 40 pulses in 3780 ns; S 0.00135 a pulse, b 175000 /s, target at 284.5
// m"; for a recording the file's name and the pattern.
std::string title_of(const Config& config, const FrameOrigin& origin);

}  // namespace splid::tradeoff
