#pragma once

#include <cstddef>
#include <optional>
#include <string>

namespace splid {

// Why no frame locks although syncs come: the syncs do not come at the pattern's period.
struct SyncDiagnosis {
  double pattern_period_ps = 0;
  std::optional<double> sync_period_ps;  // the period that fits the syncs; absent: none does
  std::size_t syncs = 0;                 // in the frame that was examined
  double frame_ms = 0;                   // length of that frame
};

// A sentence with both periods, how much they differ and what to do.
std::string in_words(const SyncDiagnosis& diagnosis);

}  // namespace splid
