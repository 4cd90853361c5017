#pragma once

#include <cmath>
#include <numbers>

#include "estimator/model/chance.hpp"

namespace splid {

// The part of the plane of delay and range walk that a target is looked for in; for a target that
// may accelerate, of the space of delay, range walk and quadratic term (DelayTrack).
struct SearchVolume {
  double period_ns = 0;         // delays: all of it, it is circular
  double max_walk_ns = 0;       // range walks: -max to max; 0 for a target at rest
  double width_ns = 0;          // of the pulse
  double max_quadratic_ns = 0;  // quadratic terms: -max to max; 0 for a straight path

  // The mean number of excursions above u of the field of significance_threshold_nats().
  [[nodiscard]] double excursions(double u) const {
    const double per_delay = 1 / (std::numbers::sqrt2 * width_ns);
    const double per_walk = per_delay / std::sqrt(12.0);
    const double circle = period_ns * per_delay;
    const double height = 2 * max_walk_ns * per_walk;
    const double depth = 2 * max_quadratic_ns * per_delay / std::sqrt(5.0);
    const double two_pi = 2 * std::numbers::pi;
    const double fall = std::exp(-0.5 * u * u);
    // The second term is that of half the plane's edge: the edge is two circles, so half is one.
    const double plane =
        circle * height * u * fall / std::pow(two_pi, 1.5) + circle * fall / two_pi;
    if (depth == 0) return plane;
    const double space = circle * height * depth * (u * u - 1) * fall / (two_pi * two_pi);
    return plane + circle * depth * u * fall / std::pow(two_pi, 1.5) + space;
  }
};

// The gain over no target, in nats, that a frame without a target exceeds somewhere in the volume
// with the probability false_alarm_rate (above 0, to 0.5).
//
// Source: sqrt(2 gain) of a known pulse at an unknown place is a smooth field of unit variance. Its
// excursions above u have the mean sum_d R_d rho_d(u) (Adler and Taylor 2007). Its gradient's
// variance is 1 / (2 width^2) in delay, a twelfth in range walk, a fifth in the quadratic term.
inline double significance_threshold_nats(const SearchVolume& volume, double false_alarm_rate) {
  // Excursions fall with u above 1. A volume of less than one resolution cell is a single look.
  double lo = 1;
  double hi = 40;
  while (hi - lo > 1e-9) {
    const double u = (lo + hi) / 2;
    const double single_look = normal_integral(-u);
    (volume.excursions(u) + single_look > false_alarm_rate ? lo : hi) = u;
  }
  return 0.5 * lo * lo;
}

}  // namespace splid
