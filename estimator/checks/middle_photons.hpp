#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/model/frame_view.hpp"

namespace splid {

// The photons of a frame that the checks of the detector look at: all of them, or so many from the
// middle of the frame.
//
// Threads: one thread for each object. Errors: none. of() allocates nothing.
class MiddlePhotons {
 public:
  static constexpr std::size_t most = 65536;

  MiddlePhotons() { times_ps_.reserve(most); }

  // In ascending order; holds as long as the frame's photons do, and until the next call.
  std::span<const std::int64_t> of(const FrameView& frame) {
    const std::size_t count = std::min(frame.photons_ps.size(), most);
    const auto middle = frame.photons_ps.subspan((frame.photons_ps.size() - count) / 2, count);
    if (std::is_sorted(middle.begin(), middle.end())) return middle;
    times_ps_.assign(middle.begin(), middle.end());
    std::sort(times_ps_.begin(), times_ps_.end());
    return times_ps_;
  }

 private:
  std::vector<std::int64_t> times_ps_;  // scratch
};

}  // namespace splid
