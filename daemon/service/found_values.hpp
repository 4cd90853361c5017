#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/frame_json.hpp"

namespace splid {

// A sample of numbers that come one by one: every one of them up to 65,536, of more every second,
// fourth and so on. The same numbers give the same sample.
class Sample {
 public:
  void add(double value);
  [[nodiscard]] bool empty() const { return values_.empty(); }
  // The value below which this fraction of the sample lies; 0.5: the median. Not empty.
  [[nodiscard]] double quantile(double fraction) const;

 private:
  std::vector<double> values_;
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

}  // namespace splid
