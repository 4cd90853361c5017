#pragma once

#include <cstdint>
#include <span>

#include "estimator/model/units.hpp"
#include "estimator/sync/sync_fit.hpp"
#include "protocol/tag.hpp"

namespace splid {

// One frame as the estimator sees it: the input of FrameEstimator and of the calibration. It owns
// nothing; the framer owns the tags. All times are in ps of the tagger's clock.
struct FrameView {
  std::int64_t start_ps = 0;
  std::int64_t end_ps = 0;                   // > start_ps
  std::span<const std::int64_t> photons_ps;  // in [start_ps, end_ps), any order
  std::span<const Loss> losses;  // clipped to the frame, sorted, not overlapping: the time that
                                 // the frame did not see
  SyncFit sync;                  // the pattern's clock; without a lock there is no estimate
  // The last photons before start_ps, any order: a detector may still be dead from them.
  std::span<const std::int64_t> before_ps = {};
  // How many of the photons came on each input, where several inputs share the light; empty: not
  // known, the light is then taken to be shared evenly.
  std::span<const std::uint64_t> photons_of_input = {};

  [[nodiscard]] std::int64_t mid_ps() const { return start_ps + (end_ps - start_ps) / 2; }
  // The frame's time less that of its losses.
  [[nodiscard]] double seen_ns() const {
    double seen = static_cast<double>(end_ps - start_ps) * ns_per_ps;
    for (const Loss& loss : losses) {
      seen -= static_cast<double>(loss.end_ps - loss.begin_ps) * ns_per_ps;
    }
    return seen;
  }
};

}  // namespace splid
