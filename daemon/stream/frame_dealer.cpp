#include "daemon/stream/frame_dealer.hpp"

#include <chrono>
#include <utility>

namespace splid {
namespace {

// How long a wait for a slot lasts before it looks again.
constexpr std::chrono::milliseconds dealer_idle{100};

}  // namespace

FrameDealer::FrameDealer(const SourceInfo& source, Effort effort, const Clock& clock, Lanes& lanes)
    : lanes_(lanes),
      device_clock_(source, clock),
      configured_effort_(effort),
      effort_(effort, source.live) {}

Frame& FrameDealer::open() {
  while ((unit_ = lanes_[lane_]->free_unit()) == nullptr) {
    waited_ = true;
    released_.wait_for(dealer_idle);
  }
  return unit_->frame;
}

void FrameDealer::close() {
  const Frame& frame = unit_->frame;
  const bool clock_set_back = frame.sequence > 0 && frame.start_ps < last_end_ps_;
  if (clock_set_back) device_clock_.anchor(frame.end_ps);
  device_clock_.follow(frame.end_ps);
  last_end_ps_ = frame.end_ps;
  unit_->mid_unix_s = device_clock_.unix_s(frame.start_ps + (frame.end_ps - frame.start_ps) / 2);
  effort_.configure(configured_effort_.load(std::memory_order_relaxed));
  // The dwells of a line come all at once, when it ends: only the first of them shows whether there
  // was time.
  const bool is_first = !frame.scan || frame.scan->line != last_line_;
  last_line_ = frame.scan ? frame.scan->line : -1;
  unit_->effort = effort_.next(std::exchange(waited_, false) && is_first);
  unit_->wanted = !wanted_ || wanted_(frame);
  lanes_[lane_]->fill();
  lanes_[lane_]->wake_estimators();
  lane_ = (lane_ + 1) % lanes_.size();
}

void FrameDealer::close_lanes() {
  for (const auto& lane : lanes_) {
    lane->close();
    lane->wake_estimators();
  }
}

}  // namespace splid
