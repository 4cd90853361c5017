#include "estimator/paper/fourier_velocity.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "estimator/model/units.hpp"

namespace splid::paper {
namespace {

constexpr double most_photon_bins = 0x1p18;
// Design note: 30 km/s in a frame of 1 s would ask for 2e9 steps. With 20 times the steps of [P]'s
// experiment (1,000) and wider bins the search reaches as far, in seconds.
constexpr double most_steps = 2e4;

// The power of all harmonics as a function of the rate g of the delay; f' = (1 - g) / period.
class HarmonicPower {
 public:
  HarmonicPower(const TrainPhotons& photons, double bin_ns)
      : photons_(photons), bins_(static_cast<std::size_t>(std::ceil(photons.period_ns / bin_ns))) {}

  double operator()(double rate) {
    counts_.assign(bins_ + 1, 0.0);
    const double turns_per_ns = 1 / photons_.period_ns;
    const auto bins = static_cast<double>(bins_);
    // A photon is shared between the two bins beside it, so that the power is continuous in g.
    for (std::size_t i = 0; i < photons_.size(); ++i) {
      double turns = (photons_.phase_ns[i] - rate * photons_.time_ns[i]) * turns_per_ns;
      turns -= std::floor(turns);
      const double place = turns * bins;
      const std::size_t bin = std::min(static_cast<std::size_t>(place), bins_ - 1);
      const double rest = place - static_cast<double>(bin);
      counts_[bin] += 1 - rest;
      counts_[bin + 1] += rest;
    }
    counts_[0] += counts_[bins_];
    double power = 0;
    double before = counts_[bins_ - 1];
    for (std::size_t k = 0; k < bins_; ++k) {
      const double after = k + 1 < bins_ ? counts_[k + 1] : counts_[0];
      const double smooth = before + 2 * counts_[k] + after;
      power += smooth * smooth;
      before = counts_[k];
    }
    return power;
  }

 private:
  const TrainPhotons& photons_;
  std::size_t bins_;
  std::vector<double> counts_;
};

// The place of the largest value in [low, high], by golden section; the value has one hill there.
double climb(HarmonicPower& power, double low, double high) {
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

double fourier_velocity_mps(const TrainPhotons& photons, double width_ns, double max_speed_mps) {
  if (photons.size() < 2 || !(max_speed_mps > 0)) return 0;
  const auto [first, last] = std::minmax_element(photons.time_ns.begin(), photons.time_ns.end());
  const double span_ns = *last - *first;
  const double max_beta = max_speed_mps / speed_of_light_mps;
  const double max_rate = 2 * max_beta / (1 - max_beta);
  const double bin_ns = std::max(
      {width_ns, photons.period_ns / most_photon_bins, 2 * max_rate * span_ns / most_steps});
  if (!(span_ns > 0) || bin_ns >= photons.period_ns / 4) return 0;

  HarmonicPower power(photons, bin_ns);
  const double step = bin_ns / span_ns;
  const auto steps = static_cast<int>(std::ceil(max_rate / step));
  double best_rate = 0;
  double most = 0;
  for (int n = -steps; n <= steps; ++n) {
    const double here = power(n * step);
    if (here <= most) continue;
    most = here;
    best_rate = n * step;
  }
  const double rate = climb(power, best_rate - 1.5 * step, best_rate + 1.5 * step);
  // This is c (f - f') / (f + f') with f' = (1 - g) f. Computed with f' itself it would lose the
  // digits of g.
  const double velocity_mps = speed_of_light_mps * rate / (2 - rate);
  return std::clamp(velocity_mps, -max_speed_mps, max_speed_mps);
}

}  // namespace splid::paper
