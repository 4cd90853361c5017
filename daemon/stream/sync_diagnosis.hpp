#pragma once

#include <cstddef>
#include <optional>
#include <string>

namespace splid {

// Why no frame locks although syncs come: they do not come at the pattern's period.
struct SyncDiagnosis {
  double pattern_period_ps = 0;
  std::optional<double> sync_period_ps;  // what fits the syncs; absent: nothing does
  std::size_t syncs = 0;                 // in the frame looked at
  double frame_ms = 0;                   // that frame's length
};

// In a sentence: both periods, by how much they differ, and what to do.
std::string in_words(const SyncDiagnosis& diagnosis);

}  // namespace splid
