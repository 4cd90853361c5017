#include "estimator/paper/fourier_velocity.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "estimator/model/units.hpp"

namespace splid::paper {
namespace {

// Design note: 30 km/s in a frame of 1 s would ask for 2e9 steps. With 20 times the steps of [P]'s
// experiment (1,000) and wider bins the search reaches as far, in seconds.
constexpr double most_steps = 2e4;

using Power = std::function<double(double rate)>;

// The place of the largest value in [low, high], by golden section; the value has one maximum
// there.
double maximum_of(const Power& power, double low, double high) {
  const double golden = (std::sqrt(5.0) - 1) / 2;
  double left = high - golden * (high - low);
  double right = low + golden * (high - low);
  double at_left = power(left);
  double at_right = power(right);
  // 0.618^12 brings the bracket down to a three-hundredth, which is a hundredth of a bin.
  for (int round = 0; round < 12; ++round) {
    if (at_left > at_right) {
      high = right;
      right = left;
      at_right = at_left;
      left = high - golden * (high - low);
      at_left = power(left);
    } else {
      low = left;
      left = right;
      at_left = at_right;
      right = low + golden * (high - low);
      at_right = power(right);
    }
  }
  return (low + high) / 2;
}

}  // namespace

double harmonic_power(const TrainPhotons& photons, std::size_t bins, double rate) {
  std::vector<double> counts(bins);
  for (std::size_t i = 0; i < photons.size(); ++i) {
    const double turns = (photons.phase_ns[i] - rate * photons.time_ns[i]) / photons.period_ns;
    const double place = (turns - std::floor(turns)) * static_cast<double>(bins);
    const auto bin = std::min(static_cast<std::size_t>(place), bins - 1);
    const double rest = place - static_cast<double>(bin);
    counts[bin] += 1 - rest;
    counts[bin + 1 < bins ? bin + 1 : 0] += rest;
  }
  double power = 0, before = counts[bins - 1];
  for (std::size_t k = 0; k < bins; ++k) {
    const double smooth = before + 2 * counts[k] + counts[k + 1 < bins ? k + 1 : 0];
    power += smooth * smooth;
    before = counts[k];
  }
  return power;
}

double fourier_velocity_mps(const TrainPhotons& photons, double width_ns, double max_speed_mps) {
  if (photons.size() < 2 || !(max_speed_mps > 0)) return 0;
  const auto [first, last] = std::minmax_element(photons.time_ns.begin(), photons.time_ns.end());
  const double span_ns = *last - *first;
  const double max_beta = max_speed_mps / speed_of_light_mps;
  const double max_rate = 2 * max_beta / (1 - max_beta);
  const double bin_ns =
      std::max({width_ns, photons.period_ns / most_fold_bins, 2 * max_rate * span_ns / most_steps});
  if (!(span_ns > 0) || bin_ns >= photons.period_ns / 4) return 0;

  const auto bins = static_cast<std::size_t>(std::ceil(photons.period_ns / bin_ns));
  const Power power = [&](double rate) { return harmonic_power(photons, bins, rate); };
  const double step = bin_ns / span_ns;
  const auto steps = static_cast<int>(std::ceil(max_rate / step));
  double start = 0, largest = 0;
  for (int n = -steps; n <= steps; ++n) {
    const double here = power(n * step);
    if (here > largest) largest = here, start = n * step;
  }
  const double rate = maximum_of(power, start - 1.5 * step, start + 1.5 * step);
  // This is c (f - f') / (f + f') with f' = (1 - g) f. Computed with f' itself it would lose the
  // digits of g.
  const double velocity_mps = speed_of_light_mps * rate / (2 - rate);
  return std::clamp(velocity_mps, -max_speed_mps, max_speed_mps);
}

}  // namespace splid::paper
