#pragma once

#include <cstdint>
#include <stop_token>
#include <string>

#include "daemon/base/clock.hpp"

namespace splid::recording {

struct ConvertSummary {
  std::uint64_t records = 0;  // in the new file, overflow records included
  // Those that were lost in the recording, and those no record holds; known counts.
  std::uint64_t lost_tags = 0;
  std::uint64_t uncounted_losses = 0;  // whose count nobody knows
  bool is_t3 = false;
  bool stopped = false;  // a stop was requested; no file was written
};

// Writes a recording of any format that splid reads, or Photon-HDF5, as a PTU: in T2 mode one whose
// tags have times of one clock, in T3 mode one that counts its syncs, whose own times nobody knows.
// A replay of either gives the same tags. What the recording's header says of its instrument, its
// time of day, its losses, its pattern and its configuration is kept.
//
// The new file gets its name when it is whole: until then it is `output` with .part behind it,
// which goes where the conversion fails or is stopped. Shows its progress on a terminal.
//
// Threads: the caller's. Errors: Error(Fault::usage) where `output` exists and may not be
// overwritten; Error(Fault::data) for a recording that cannot be read, and for one whose tags a PTU
// cannot hold at their times; Error(Fault::device) where the file cannot be written.
ConvertSummary convert(const std::string& recording, const std::string& output, bool overwrite,
                       const Clock& clock, const std::stop_token& stop);

}  // namespace splid::recording
