#pragma once

#include <atomic>
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

// What is estimated as one, with what each stage adds on its way: a frame, and where an instrument
// has several pixels, one pixel's part of a frame.
struct EstimationUnit {
  explicit EstimationUnit(const FrameCapacity& capacity) : frame(capacity) {}

  Frame frame;                       // framer
  double mid_unix_s = 0;             // framer; UTC at mid-frame
  Effort effort = Effort::balanced;  // framer; what there is time for
  bool wanted = true;                // framer; otherwise the frame is not estimated
  Estimate estimate;                 // estimator
  double compute_ms = 0;             // estimator
};

// The way of every N-th frame: a ring of preallocated units that three threads pass through in
// turn. The framer fills a unit, the estimator works on it, the publisher reads and frees it. Each
// stage owns one index and reads the index of the stage before; no lock, no allocation, no copy.
//
// Threads: as each function says. Errors: none. Timeouts: no call waits; the wake is for an
// estimator that has nothing to do.
class Lane {
 public:
  Lane(const FrameCapacity& capacity, std::size_t depth) {
    for (std::size_t i = 0; i < depth; ++i) {
      slots_.push_back(std::make_unique<EstimationUnit>(capacity));
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
  EstimationUnit* filled_unit() { return behind(estimated_, filled_); }
  void estimated() { advance(estimated_); }

  // Publisher: the unit to publish next, null when there is none.
  EstimationUnit* estimated_unit() { return behind(released_, estimated_); }
  void release() { advance(released_); }

  // Any thread: the lane is closed, and the named stage has nothing left to do in it.
  [[nodiscard]] bool estimator_done() const { return done(estimated_); }
  [[nodiscard]] bool publisher_done() const { return done(released_); }

  Wake estimator_wake;  // a unit was filled, or the lane closed

 private:
  // Design note: 64 is written out, as in TagRing.
  struct alignas(64) Index : std::atomic<std::uint64_t> {
    Index() : std::atomic<std::uint64_t>(0) {}
  };

  EstimationUnit* slot(std::uint64_t at) { return slots_[at % slots_.size()].get(); }
  EstimationUnit* behind(const Index& own, const Index& stage_before) {
    const std::uint64_t at = own.load(std::memory_order_relaxed);
    return stage_before.load(std::memory_order_acquire) == at ? nullptr : slot(at);
  }
  static void advance(Index& index) {
    index.store(index.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }
  // closed_ is read first, so that every unit that was filled before the lane was closed is seen.
  [[nodiscard]] bool done(const Index& own) const {
    return closed_.load(std::memory_order_acquire) &&
           own.load(std::memory_order_relaxed) == filled_.load(std::memory_order_acquire);
  }

  std::vector<std::unique_ptr<EstimationUnit>> slots_;
  Index filled_;     // framer's
  Index estimated_;  // estimator's
  Index released_;   // publisher's
  std::atomic<bool> closed_{false};
};

}  // namespace splid
