#include "daemon/batch/slice_choice.hpp"

#include <algorithm>
#include <utility>

namespace splid::batch {

SliceChoice::SliceChoice(Slicing slicing, std::uint64_t bytes, Part part,
                         std::set<std::uint64_t> measured, std::size_t record_bytes)
    : slicing_(slicing),
      bytes_(bytes),
      part_(part),
      measured_(std::move(measured)),
      record_bytes_(record_bytes) {}

bool SliceChoice::wants(const Frame& frame) {
  if (frame.sequence % slicing_.frames == 0) begin_slice(frame.sequence / slicing_.frames);
  const std::uint64_t tags = frame.photon_count() + frame.syncs_ps.size() + frame.markers.size();
  const std::uint64_t reached = position() + record_bytes_ * tags;
  // A slice that is in no part would never be measured, so the last byte is as far as they go.
  position_.store(std::min(reached, bytes_ - 1), std::memory_order_relaxed);
  return wanted_;
}

void SliceChoice::begin_slice(std::uint64_t number) {
  const std::uint64_t at = position();
  if (at >= part_.end) passed_.store(true, std::memory_order_release);
  wanted_ = at >= part_.begin && at < part_.end && !measured_.contains(number);
}

}  // namespace splid::batch
