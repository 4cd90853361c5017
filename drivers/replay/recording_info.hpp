#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/ptu_header.hpp"
#include "protocol/tag.hpp"

namespace splid {

// What a recording holds.
struct RecordingInfo {
  PtuHeader header;
  std::uint64_t records = 0;                // read, overflows included
  std::uint64_t overflow_records = 0;       // of which each may stand for several wraps
  std::uint64_t unknown_records = 0;        // neither photon, sync, marker nor overflow
  std::array<std::uint64_t, 64> photons{};  // by input, as the records number it
  std::uint64_t syncs = 0;
  std::array<std::uint64_t, 16> markers{};  // by marker bits
  std::optional<std::int64_t> first_ps;     // earliest tag, tagger's clock; absent: no tags
  std::optional<std::int64_t> last_ps;      // latest tag
  std::uint64_t steps_back = 0;             // tags before the one that they follow
  std::uint64_t far_steps_back = 0;         // of these, by more than 1 us
  std::int64_t longest_step_back_ps = 0;    // of these; 0: none
  bool whole = false;                       // read to the end, not to max_tags
  std::vector<std::string> warnings;        // sentences for people

  [[nodiscard]] std::uint64_t tags() const;
};

// Sees the tags of a recording as it is read, in the file's order.
using SeeTags = std::function<void(std::span<const Tag>)>;

// Reads a recording, up to its end or to the first block that reaches max_tags (0: all). see: may
// be empty.
//
// Threads: any. Errors: as RecordingReader.
RecordingInfo scan_recording(const std::string& file, std::uint64_t max_tags = 0,
                             const SeeTags& see = {});

// Which channels have tags, in words: "input 1, input 2 and sync"; "no tags" where there are none.
std::string channels_in_words(const RecordingInfo& info);

}  // namespace splid
