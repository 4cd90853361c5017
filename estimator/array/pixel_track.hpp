#pragma once

#include <cstddef>
#include <span>

#include "estimator/array/neighbours.hpp"
#include "estimator/model/estimate.hpp"

namespace splid::array {

// Where a pixel of an array looks first, so that few pixels of a frame pay for a search: where it
// saw its own target last, or, if it has none, where its nearest neighbour saw one. FrameEstimator
// searches a pixel whose likelihood asks for it, and each pixel anew after 20 frames; not all of
// them in one frame, as each pixel begins to count at a number of its own.
class PixelTrack {
 public:
  // pixel: its number, which spreads the searches of an array over the frames.
  explicit PixelTrack(std::size_t pixel) : pixel_(pixel) {}

  // Before a frame of the pixel. help: where a neighbour saw its target, if it is valid.
  void begin_frame(const TargetTrack& help);
  // For FrameEstimator::estimate(), once the frame has begun.
  [[nodiscard]] TargetTrack& track() { return track_; }
  // What the pixel has seen; not valid where that is nothing, or a neighbour's.
  [[nodiscard]] TargetTrack seen() const;

 private:
  std::size_t pixel_;
  TargetTrack track_;
  bool is_spread_ = false;
};

// What the nearest neighbour of a pixel that sees a target has seen, or a track that is not valid.
// seen: of all pixels, after one frame.
TargetTrack help_of(const Neighbours& neighbours, std::size_t pixel,
                    std::span<const TargetTrack> seen);

}  // namespace splid::array
