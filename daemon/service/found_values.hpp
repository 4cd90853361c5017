#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "protocol/frame_json.hpp"
#include "protocol/frame_status.hpp"
#include "protocol/scene_json.hpp"

namespace splid {

// A sample of numbers that come one by one: every one of them up to `most`, of more every second,
// fourth and so on. The same numbers give the same sample.
class Sample {
 public:
  explicit Sample(std::size_t most = 65'536) : most_(most) {}
  void add(double value);
  [[nodiscard]] bool empty() const { return values_.empty(); }
  // The value below which this fraction of the sample lies; 0.5: the median. Not empty.
  [[nodiscard]] double quantile(double fraction) const;

 private:
  std::vector<double> values_;
  std::size_t most_;
  std::uint64_t seen_ = 0;
  std::uint64_t step_ = 1;
};

// What a run has found, for people: median distance and velocity of the valid frames, between what
// nine of ten of them lie, and the median of their standard deviations.
//
// Threads: one. Errors: none.
class FoundValues {
 public:
  void take(const FrameMessage& frame);
  // "distance 284.51 m (median; 90 % of 199 frames: 280.68 to 288.39 m; +- 0.57 mm a frame); ...";
  // "no frame has a distance" where none is valid.
  [[nodiscard]] std::string in_words() const;

 private:
  Sample distance_m_, std_distance_m_, velocity_mps_, std_velocity_mps_;
  std::uint64_t valid_ = 0;
};

// What a run of several pixels has found, for people: all their frames by status, how many pixels
// were measured, and the nearest and the farthest of them.
//
// Threads: one. Errors: none.
class FoundPixels {
 public:
  void take(const SceneMessage::Pixel& pixel);
  // "frames of 4 pixels: 300 ok, 100 no_target; 3 measured, from b at 12.5 m to d at 30.01 m
  // (medians)"; "no pixel measured" where no frame is valid. Empty without frames.
  [[nodiscard]] std::string in_words() const;

 private:
  std::map<std::string, Sample> distances_m_;  // by the pixel's name
  std::array<std::uint64_t, frame_status_names.size()> by_status_{};
};

}  // namespace splid
