#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "daemon/stream/frame.hpp"
#include "drivers/wake.hpp"
#include "estimator/model/estimate.hpp"
#include "estimator/model/options.hpp"

namespace splid {

// Units in a lane: the framer fills one while the estimator works on the other. What comes during
// longer pauses of the estimator waits in the ring, at a third of the memory.
inline constexpr std::size_t lane_depth = 2;

// What comes of a pixel's part of a frame.
struct PixelEstimate {
  Estimate estimate;
  double compute_ms = 0;
  TargetTrack seen;  // where the pixel has seen its target; not valid where that is not followed
  // Where a neighbour has: for the next frame in this unit, which comes lane_depth frames later.
  TargetTrack help;
};

// A frame with what each stage adds on its way.
struct EstimationUnit {
  explicit EstimationUnit(const FrameCapacity& capacity)
      : frame(capacity), pixels(capacity.pixels) {}

  Frame frame;                        // framer
  double mid_unix_s = 0;              // framer; UTC at mid-frame
  Effort effort = Effort::balanced;   // framer; what there is time for
  bool wanted = true;                 // framer; otherwise the frame is not estimated
  Estimate estimate;                  // estimator; where there is one pixel
  double compute_ms = 0;              // estimator; where there is one pixel
  std::vector<PixelEstimate> pixels;  // estimators; where there are several: of frame.pixels
};

// The way of every N-th frame, or of every frame where N estimators share the pixels of each: a
// ring of preallocated units that the threads pass through in turn. The framer fills a unit, the
// estimators work on it, the publisher reads and frees it once all of them have. Each stage owns
// one index and reads the indices of the stage before; no lock, no allocation, no copy.
//
// Threads: as each function says. Errors: none. Timeouts: no call waits; the wakes are for
// estimators that have nothing to do.
class Lane {
 public:
  // joins: the last estimator begins with a unit once all others are done with it.
  Lane(const FrameCapacity& capacity, std::size_t depth, std::size_t estimators = 1,
       bool joins = false)
      : joins_(joins) {
    for (std::size_t i = 0; i < depth; ++i) {
      slots_.push_back(std::make_unique<EstimationUnit>(capacity));
    }
    for (std::size_t i = 0; i < estimators; ++i) {
      estimators_.push_back(std::make_unique<Estimator>());
    }
  }

  // Framer: the unit to fill next, null when all are in use.
  EstimationUnit* free_unit() {
    const std::uint64_t at = filled_.load(std::memory_order_relaxed);
    if (at - released_.load(std::memory_order_acquire) == slots_.size()) return nullptr;
    return slot(at);
  }
  void fill() { advance(filled_); }
  // Framer: no frame comes after those that were filled.
  void close() { closed_.store(true, std::memory_order_release); }

  // Estimator: the unit to work on next, null when there is none.
  EstimationUnit* filled_unit(std::size_t estimator = 0) {
    const Index& own = estimators_[estimator]->done;
    const std::uint64_t at = own.load(std::memory_order_relaxed);
    const bool is_last = joins_ && estimator + 1 == estimators_.size();
    const std::uint64_t ready =
        is_last ? estimated_by(estimator) : filled_.load(std::memory_order_acquire);
    return ready == at ? nullptr : slot(at);
  }
  void estimated(std::size_t estimator = 0) {
    advance(estimators_[estimator]->done);
    if (joins_ && estimator + 1 < estimators_.size()) estimators_.back()->wake.notify();
  }

  // Publisher: the unit to publish next, null when there is none.
  EstimationUnit* estimated_unit() {
    const std::uint64_t at = released_.load(std::memory_order_relaxed);
    return estimated_by(estimators_.size()) == at ? nullptr : slot(at);
  }
  void release() { advance(released_); }

  // Any thread: the lane is closed, and the named stage has nothing left to do in it.
  [[nodiscard]] bool estimator_done(std::size_t estimator = 0) const {
    return done(estimators_[estimator]->done);
  }
  [[nodiscard]] bool publisher_done() const { return done(released_); }

  // Any thread: a unit was filled, or the lane closed.
  void wake_estimators() {
    for (const auto& estimator : estimators_) estimator->wake.notify();
  }
  // Estimator: until then, or the time is over.
  void wait(std::size_t estimator, std::chrono::milliseconds most) {
    estimators_[estimator]->wake.wait_for(most);
  }

 private:
  // Design note: 64 is written out, as in TagRing.
  struct alignas(64) Index : std::atomic<std::uint64_t> {
    Index() : std::atomic<std::uint64_t>(0) {}
  };

  struct Estimator {
    Index done;
    Wake wake;
  };

  EstimationUnit* slot(std::uint64_t at) { return slots_[at % slots_.size()].get(); }
  // How many units the first so many estimators are done with.
  [[nodiscard]] std::uint64_t estimated_by(std::size_t count) const {
    std::uint64_t least = estimators_.front()->done.load(std::memory_order_acquire);
    for (std::size_t i = 1; i < count; ++i) {
      least = std::min(least, estimators_[i]->done.load(std::memory_order_acquire));
    }
    return least;
  }
  static void advance(Index& index) {
    index.store(index.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }
  // closed_ is read first, so that every unit that was filled before the lane was closed is seen.
  [[nodiscard]] bool done(const Index& own) const {
    return closed_.load(std::memory_order_acquire) &&
           own.load(std::memory_order_relaxed) == filled_.load(std::memory_order_acquire);
  }

  bool joins_;
  std::vector<std::unique_ptr<EstimationUnit>> slots_;
  std::vector<std::unique_ptr<Estimator>> estimators_;
  Index filled_;    // framer's
  Index released_;  // publisher's
  std::atomic<bool> closed_{false};
};

}  // namespace splid
