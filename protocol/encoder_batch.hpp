#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace splid {

// Consecutive counts of an encoder, a count for each tick of the sample clock, which also goes to
// the tagger as markers.
struct EncoderBatch {
  std::int64_t first_index = 0;  // index of the first count; 0: the sample clock was just started
  std::vector<std::int64_t> counts;
  bool overrun = false;  // samples before these were lost; there may be no counts

  friend bool operator==(const EncoderBatch&, const EncoderBatch&) = default;
};

// The text of a batch, in a file or on a socket: one line
//   FIRST_INDEX,COUNT[,COUNT...]    or    overrun
// in decimal digits, with blanks around each if need be. An empty line, and a line that begins with
// #, is a batch without counts.
//
// Absent where `line` is no such line, or its index is negative.
std::optional<EncoderBatch> parse_encoder_line(std::string_view line);

// The line with its line feed. Empty for a batch that has neither counts nor an overrun.
std::string to_encoder_line(const EncoderBatch& batch);

}  // namespace splid
