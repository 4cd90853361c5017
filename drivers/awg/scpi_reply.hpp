#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace splid::awg {

// Takes apart what instruments answer to SCPI queries (IEEE 488.2). Lines come without their line
// feed; spaces around them and a carriage return at the end do not matter. Any bytes may come in:
// an answer that does not have the form gives an absent value, never an error.
//
// Threads: any. Errors: none.

// The answer to *IDN?: four fields with commas between.
struct ScpiIdentity {
  std::string maker;
  std::string model;
  std::string serial;
  std::string firmware;

  friend bool operator==(const ScpiIdentity&, const ScpiIdentity&) = default;
};
std::optional<ScpiIdentity> parse_scpi_identity(std::string_view line);

// An entry of the error queue, such as -223,"Too much data". Code 0: the queue is empty.
struct ScpiError {
  int code = 0;
  std::string text;  // without the quotes

  friend bool operator==(const ScpiError&, const ScpiError&) = default;
};
std::optional<ScpiError> parse_scpi_error(std::string_view line);

// A decimal number, such as +6.0E+10; finite.
std::optional<double> parse_scpi_number(std::string_view line);

// Whole numbers with commas between; at least one.
std::optional<std::vector<std::int64_t>> parse_scpi_integers(std::string_view line);

// The head of a block of definite length, #<d><d digits>: its own length, and the length of the
// content that follows.
struct ScpiBlockHead {
  std::size_t head_bytes = 0;
  std::size_t content_bytes = 0;

  friend bool operator==(const ScpiBlockHead&, const ScpiBlockHead&) = default;
};

// `text` starts with the head and may go on. Also absent for a block of indefinite length (#0).
std::optional<ScpiBlockHead> parse_scpi_block_head(std::string_view text);

// The head of a block of content_bytes, which are at most 999,999,999.
std::string scpi_block_head(std::size_t content_bytes);

// At most 60 characters of what an instrument said or was told, for an error's sentence: characters
// that cannot be printed become '?', and "..." stands where the text was cut.
std::string shown_scpi(std::string_view text);

}  // namespace splid::awg
