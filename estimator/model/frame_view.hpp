#pragma once

#include <cstdint>
#include <span>

#include "estimator/sync/sync_fit.hpp"
#include "protocol/tag.hpp"

namespace splid {

// One frame as the estimator sees it: a view, nothing owned.
struct FrameView {
  std::int64_t start_ps = 0;                 // tagger's clock
  std::int64_t end_ps = 0;                   // > start_ps
  std::span<const std::int64_t> photons_ps;  // in [start_ps, end_ps), any order
  std::span<const Loss> losses;              // clipped to the frame, sorted, not overlapping
  SyncFit sync;                              // must be locked for an estimate
};

}  // namespace splid
