#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "estimator/frame.hpp"

namespace splid {

// A pulse as a static target's photons show it.
struct FoundPulse {
  double time_ps = 0;    // in [0, period), after the pattern start
  double amplitude = 0;  // relative: the mean of all found pulses is 1
};

// Folds the photons of a static target on the pattern period and finds the pulses in them: how a
// pattern is had from a recording when nobody knows what was played.
//
// Threads: one. Errors: none; where no pulse stands out of the background, none is found.
class PulseFinder {
 public:
  // period_ps: nominal; sigma_ps: standard deviation of the detected pulse. Pulses closer than six
  // of it count as one.
  PulseFinder(double period_ps, double sigma_ps);

  // Frames that are not locked to their syncs are passed over.
  void add(const FrameView& frame);

  // Ascending in time.
  [[nodiscard]] std::vector<FoundPulse> find() const;
  // Of all frames added, each counting by its photons; 0 before any.
  [[nodiscard]] double mean_period_ps() const;
  [[nodiscard]] std::uint64_t photons() const { return photons_; }

 private:
  [[nodiscard]] double count_about(std::ptrdiff_t bin, std::ptrdiff_t half_width) const;
  [[nodiscard]] double settle(double time_ps, double background_per_bin) const;

  double sigma_ps_;
  double bin_ps_;
  double period_ps_;
  std::vector<std::uint32_t> bins_;  // photons by phase
  std::uint64_t photons_ = 0;
  double period_sum_ps_ = 0;
};

}  // namespace splid
