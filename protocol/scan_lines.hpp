#pragma once

#include <cstdint>
#include <optional>

#include "protocol/recording_header.hpp"

namespace splid {

// How a scan is cut into dwells. A line is from one marker to the next marker of the other kind,
// and has dwells of equal length; where both are of one kind, a line ends as the next begins.
struct ScanLines {
  int start = 1;            // marker bits, 1 to 15
  int stop = 1;             // marker bits; start: there are no stops
  std::int64_t pixels = 1;  // dwells of a line, 1 to most_dwells
  int picture = 0;          // marker bits at the begin of a picture; 0: none
  std::int64_t lines = 0;   // of a picture; 0: not known
  bool both_ways = false;   // every second line runs back
  // Share of the mirror's half swing that a line takes, 0 to 100: dwells are equal in what the
  // mirror sweeps. 0: equal in time.
  double sine_percent = 0;

  friend bool operator==(const ScanLines&, const ScanLines&) = default;
};

inline constexpr std::int64_t most_dwells = 65'536;

// The scan that a PTU header's ImgHdr_ tags tell of; absent where they tell of none. These have
// numbers of markers, from 1, where ScanLines has bits. ImgHdr_PixY is not taken: some programs
// write there what was asked for and not what was scanned.
std::optional<ScanLines> scan_of(const RecordingHeader& header);

// The number of a marker, from 1, of which `bits` are the bits; 0 where these are several markers.
std::int64_t marker_number(int bits);

}  // namespace splid
