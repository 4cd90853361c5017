#include "estimator/paper/fourier_velocity.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "estimator/model/units.hpp"

namespace splid::paper {

double fourier_velocity_mps(const TrainPhotons& photons, double width_ns, double max_speed_mps) {
  if (photons.size() < 2 || !(max_speed_mps > 0)) return 0;
  const auto [first, last] = std::minmax_element(photons.time_ns.begin(), photons.time_ns.end());
  const double span_ns = *last - *first;
  const double max_beta = max_speed_mps / speed_of_light_mps;
  const double max_rate = 2 * max_beta / (1 - max_beta);
  const double bin_ns = std::max(width_ns, photons.period_ns / most_fold_bins);
  if (!(span_ns > 0) || bin_ns >= photons.period_ns / 4) return 0;

  const auto bins = static_cast<std::size_t>(std::ceil(photons.period_ns / bin_ns));
  const auto power = [&](double rate) {
    const std::vector<double> fold = smoothed_fold(photons, bins, rate);
    return std::inner_product(fold.begin(), fold.end(), fold.begin(), 0.0);
  };
  const double step = bin_ns / span_ns;
  const auto steps = static_cast<int>(std::ceil(max_rate / step));
  double best = 0, largest = 0;
  for (int n = -steps; n <= steps; ++n) {
    const double here = power(n * step);
    if (here > largest) largest = here, best = n * step;
  }
  // The top of the parabola through the best rate and its neighbours.
  const double before = power(best - step), after = power(best + step);
  const double fall = 2 * largest - before - after;
  const double rate = best + (fall > 0 ? step / 2 * (after - before) / fall : 0);
  // This is c (f - f') / (f + f') with f' = (1 - g) f. Computed with f' itself it would lose the
  // digits of g.
  const double velocity_mps = speed_of_light_mps * rate / (2 - rate);
  return std::clamp(velocity_mps, -max_speed_mps, max_speed_mps);
}

}  // namespace splid::paper
