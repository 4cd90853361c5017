#include "estimator/search/significance.hpp"

#include <cmath>
#include <numbers>

#include "estimator/model/chance.hpp"

namespace splid {
namespace {

// The mean number of excursions above u that the field has in the volume.
double excursions(const SearchVolume& volume, double u) {
  const double per_delay = 1 / (std::numbers::sqrt2 * volume.width_ns);
  const double per_walk = per_delay / std::sqrt(12.0);
  const double circle = volume.period_ns * per_delay;
  const double height = 2 * volume.max_walk_ns * per_walk;
  const double depth = 2 * volume.max_quadratic_ns * per_delay / std::sqrt(5.0);
  const double two_pi = 2 * std::numbers::pi;
  const double fall = std::exp(-0.5 * u * u);
  // The second term is that of half the plane's edge: the edge is two circles, so half is one.
  const double plane = circle * height * u * fall / std::pow(two_pi, 1.5) + circle * fall / two_pi;
  if (depth == 0) return plane;
  const double space = circle * height * depth * (u * u - 1) * fall / (two_pi * two_pi);
  return plane + circle * depth * u * fall / std::pow(two_pi, 1.5) + space;
}

}  // namespace

double significance_threshold_nats(const SearchVolume& volume, double false_alarm_rate) {
  // excursions() falls with u above 1. A volume of less than one resolution cell is a single look.
  double lo = 1;
  double hi = 40;
  while (hi - lo > 1e-9) {
    const double u = (lo + hi) / 2;
    const double single_look = normal_integral(-u);
    (excursions(volume, u) + single_look > false_alarm_rate ? lo : hi) = u;
  }
  return 0.5 * lo * lo;
}

}  // namespace splid
