#pragma once

#include <cstddef>
#include <cstdint>
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

// What a stream's frames came to, once it is over.
struct LockCounts {
  std::uint64_t frames = 0;
  std::uint64_t locked_frames = 0;
  std::uint64_t syncs = 0;
};

// Errors: Error(Fault::data) where there were plenty of syncs and no frame could lock to them, with
// the diagnosis where there is one (may be null). Where there were few syncs, or none, the log has
// a warning.
void check_locked(const LockCounts& counts, const SyncDiagnosis* diagnosis);

}  // namespace splid
