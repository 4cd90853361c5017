#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace splid {

// Consecutive counts of an encoder, one a tick of the sample clock that also goes to the tagger.
struct EncoderBatch {
  std::int64_t first_index = 0;  // of the first count; 0: the sample clock was just started
  std::vector<std::int64_t> counts;
  bool overrun = false;  // samples before these were lost; there may be no counts

  friend bool operator==(const EncoderBatch&, const EncoderBatch&) = default;
};

// The text of a batch, in a file or on a socket: one line
//   FIRST_INDEX,COUNT[,COUNT...]    or    overrun
// in decimal digits, blanks allowed around each. Empty lines and those that begin with # say
// nothing: a batch without counts.
//
// Null where `line` is no such line, or an index is negative.
std::optional<EncoderBatch> parse_encoder_line(std::string_view line);

// With its line feed; a batch of neither counts nor overrun is empty.
std::string to_encoder_line(const EncoderBatch& batch);

}  // namespace splid
