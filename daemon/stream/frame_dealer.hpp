#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "daemon/base/clock.hpp"
#include "daemon/stream/device_clock.hpp"
#include "daemon/stream/effort_governor.hpp"
#include "daemon/stream/framer.hpp"
#include "daemon/stream/lane.hpp"
#include "drivers/source.hpp"
#include "drivers/wake.hpp"

namespace splid {

using Lanes = std::vector<std::unique_ptr<Lane>>;

// Says of each frame, once it is complete, whether it is to be estimated. Is asked in the order of
// the frames, on the framer's thread. Must not allocate, lock or throw.
using FrameChoice = std::function<bool(const Frame&)>;

// Deals the frames out to the lanes in turn: gives the framer the slot that it fills next, and each
// full frame its UTC and the effort that there is time for.
//
// Threads: open(), close() and begin() belong to the framer's thread; notify_released() to the
// thread that takes frames; configure() to any. Errors: none. Timeouts: open() waits until the
// lane's slot is released, which the taker of frames does until the lanes are closed.
class FrameDealer final : public FrameSink {
 public:
  // lanes, clock: outlive this.
  FrameDealer(const SourceInfo& source, Effort effort, const Clock& clock, Lanes& lanes);

  // Which frames are to be estimated; without this call all are. Before the first frame.
  void choose(FrameChoice wanted) { wanted_ = std::move(wanted); }
  // A tag of `time_ps`, the first of the stream, has just come.
  void begin(std::int64_t time_ps) { device_clock_.anchor(time_ps); }
  Frame& open() override;
  void close() override;
  // No frame comes after those that are closed.
  void close_lanes();

  // A slot was released.
  void notify_released() { released_.notify(); }
  // The effort that no frame exceeds, from the next frame on.
  void configure(Effort effort) { configured_effort_ = effort; }

 private:
  Lanes& lanes_;
  DeviceClock device_clock_;
  FrameChoice wanted_;
  std::atomic<Effort> configured_effort_;
  EffortGovernor effort_;
  Wake released_;
  bool waited_ = false;   // for the slot of the open frame
  std::size_t lane_ = 0;  // of the open frame
  EstimationUnit* unit_ = nullptr;
  std::int64_t last_line_ = -1;   // of a scan: of the frame before
  std::int64_t last_end_ps_ = 0;  // of the frame before; valid from the second frame on
};

}  // namespace splid
