#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <span>

#include "estimator/fold/near_set.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/several/joint_likelihood.hpp"

// What CrossingCheck and MovingLight see of the photons about a line.

namespace splid {

// So many photons are seen together, so that loops over them are over vectors.
constexpr std::size_t photons_at_once = 64;
using OfPhotons = std::array<double, photons_at_once>;

// The slopes over the frame of what is left of the light's mean and spread, by polynomials of
// Legendre in the time. A fit leaves no mean and no first slope of the mean, and the spread's mean
// is that of the pulse.
class SlopesLeft {
 public:
  // Chi squared with 7 degrees of freedom exceeds this in one of 1000.
  static constexpr double most_by_chance = 24.3;

  void add(double position, double mean, double spread) {
    const double x = 2 * position;
    const double p2 = (3 * x * x - 1) / 2;
    const double p3 = (5 * x * x - 3) * x / 2;
    const double p4 = ((35 * x * x - 30) * x * x + 3) / 8;
    const std::array<double, terms> all = {mean * p2,   mean * p3,   mean * p4,  spread * x,
                                           spread * p2, spread * p3, spread * p4};
    for (std::size_t i = 0; i < terms; ++i) {
      sums_[i] += all[i];
      squares_[i] += all[i] * all[i];
    }
  }
  [[nodiscard]] double squared_deviations() const {
    double all = 0;
    for (std::size_t i = 0; i < terms; ++i) {
      if (squares_[i] > 0) all += sums_[i] * sums_[i] / squares_[i];
    }
    return all;
  }

 private:
  static constexpr std::size_t terms = 7;
  std::array<double, terms> sums_{}, squares_{};
};

// How far some photons are from the pulses of a target's line.
inline void offsets_from(const NearSet& near, std::size_t first, std::size_t count, DelayLine line,
                         double circle_ns, OfPhotons& offsets_ns) {
  const double delay_ns = std::remainder(line.delay_ns - near.line.delay_ns, circle_ns);
  const double travel_ns = line.travel_ns - near.line.travel_ns;
  for (std::size_t i = 0; i < count; ++i) {
    offsets_ns[i] = near.residual_ns[first + i] - delay_ns - travel_ns * near.position[first + i];
  }
}

// The light of a target at some photons near the pulses of a line, and its derivatives by the
// photons' times.
struct LightAbout {
  OfPhotons h, d1, d2;

  void see(const PulseShape& shape, const NearSet& near, std::size_t first, std::size_t count,
           const TargetParameters& target, double circle_ns) {
    OfPhotons offsets_ns;
    offsets_from(near, first, count, target.line, circle_ns, offsets_ns);
    shape.evaluate(std::span(offsets_ns).first(count), {h, d1, d2});
    for (std::size_t i = 0; i < count; ++i) {
      const double S = target.signal_per_pulse * near.amplitude[first + i];
      h[i] *= S, d1[i] *= S, d2[i] *= S;
    }
  }
};

}  // namespace splid
