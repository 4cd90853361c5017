#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/array/neighbours.hpp"
#include "estimator/model/estimate.hpp"

namespace splid::array {

// Where each pixel of an array looks first, so that few pixels of a frame pay for a search. A pixel
// follows its own target; a pixel that has none begins where its nearest neighbour saw one in the
// last frame. FrameEstimator searches a pixel whose likelihood asks for it, and each pixel anew
// after 20 frames: not all of them in one frame, as the field spreads these searches over the
// frames.
//
// A frame's starts come from the frames before it alone, so that the estimates are the same
// whatever the order of the pixels, and the threads.
//
// Threads: begin_frame() while no frame is estimated; track() from any, one thread a pixel. Errors:
// none. No allocation after construction.
class TrackField {
 public:
  explicit TrackField(std::span<const PixelDirection> directions);

  // Before the pixels of a frame are estimated, and after all of the last frame have been.
  void begin_frame();
  // For FrameEstimator::estimate() of the pixel.
  [[nodiscard]] TargetTrack& track(std::size_t pixel) { return tracks_[pixel]; }
  // How many pixels begin where a neighbour saw its target, in this frame.
  [[nodiscard]] std::size_t helped() const { return helped_; }

 private:
  void forget_vain_help();
  [[nodiscard]] const TargetTrack* neighbours_track(std::size_t pixel) const;
  void spread(std::size_t pixel);

  Neighbours neighbours_;
  std::vector<TargetTrack> tracks_, last_;
  std::vector<std::uint8_t> is_helped_, is_spread_;
  std::size_t helped_ = 0;
};

}  // namespace splid::array
