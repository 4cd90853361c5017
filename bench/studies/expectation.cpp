#include "bench/studies/expectation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <vector>

#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/units.hpp"
#include "estimator/search/significance.hpp"

namespace splid::studies {
namespace {

double normal_tail(double deviations) {  // chance to be below
  return 0.5 * std::erfc(-deviations / std::numbers::sqrt2);
}

// The gain of the truth over no target: a sum over a Poisson process, of log(lambda / flat) at each
// photon, where flat is the rate of as many photons spread evenly.
class Gain {
 public:
  Gain(const Cell& cell, double pulses, double length_ns) {
    const double S = cell.signal_per_pulse;
    const double b = cell.background_per_ns;
    const double flat = S * pulses / length_ns + b;
    constexpr double reach = 8;  // sigma; no two pulses of a study are as near
    constexpr int steps = 3200;
    const double step_ns = 2 * reach * pulse_sigma_ns / steps;
    for (int n = 0; n < steps; ++n) {
      const double u = (n + 0.5) * step_ns / pulse_sigma_ns - reach;
      const double h = std::exp(-u * u / 2) / (pulse_sigma_ns * std::sqrt(2 * std::numbers::pi));
      const double lambda = b + S * h;
      parts_.push_back({pulses * step_ns * lambda, std::log(lambda / flat)});
    }
    const double dark_ns = length_ns - pulses * 2 * reach * pulse_sigma_ns;
    parts_.push_back({dark_ns * b, std::log(b / flat)});
  }

  // Cumulant generating function and its derivatives at s.
  struct Cumulant {
    double value = 0, slope = 0, curve = 0;
  };
  [[nodiscard]] Cumulant at(double s) const {
    Cumulant sum;
    for (const Part& part : parts_) {
      const double tilted = part.photons * std::exp(s * part.nats);
      sum.value += tilted - part.photons;
      sum.slope += tilted * part.nats;
      sum.curve += tilted * part.nats * part.nats;
    }
    return sum;
  }

  // The chance of a gain below nats: the saddlepoint formula of Lugannani and Rice (1980), good in
  // the far tail of few photons, where a normal distribution is off by orders of magnitude.
  [[nodiscard]] double chance_below(double nats) const {
    const Cumulant mean = at(0);
    const double deviations = (nats - mean.slope) / std::sqrt(mean.curve);
    if (std::abs(deviations) < 0.1) return normal_tail(deviations);
    double low = -8, high = 8;  // the slope rises with s
    while (high - low > 1e-9) {
      const double s = (low + high) / 2;
      (at(s).slope < nats ? low : high) = s;
    }
    const Cumulant saddle = at(low);
    const double w = std::copysign(std::sqrt(2 * (low * nats - saddle.value)), low);
    const double u = low * std::sqrt(saddle.curve);
    const double density = std::exp(-w * w / 2) / std::sqrt(2 * std::numbers::pi);
    return std::clamp(normal_tail(w) + density * (1 / w - 1 / u), 0.0, 1.0);
  }

 private:
  struct Part {
    double photons, nats;
  };
  std::vector<Part> parts_;
};

// The chance that the photons of two periods agree better at a delay whose remainders are one step
// of the periods' common divisor off. Where the periods share the frame, the offset between their
// photons has twice the deviation of the delay. In turn, about half a frame each, it has four times
// that, as the velocity is unknown too: the information is E[sign^2] - E[s sign]^2 / E[s^2] = 1 / 4
// for half of the offset, with s uniform in [-1/2, 1/2].
double chance_of_another_turn(const Pattern& pattern, const Bound& bound) {
  if (pattern.mode != Mode::mrr && pattern.mode != Mode::interleaved) return 0;
  const double deviations = pattern.mode == Mode::mrr ? 4 : 2;
  std::int64_t divisor_ps = 0;
  for (const double period_ps : pattern.subperiods_ps) {
    divisor_ps = std::gcd(divisor_ps, std::llround(period_ps));
  }
  const double half_ns = static_cast<double>(divisor_ps) * ns_per_ps / 2;
  return 2 * normal_tail(-half_ns / (deviations * bound.delay_ns));
}

}  // namespace

Expectation expect(const Cell& cell) {
  const Pattern pattern = pattern_of(cell);
  const double length_ns = frame_length_ns(cell);
  const double periods = length_ns / (pattern_period_ps(pattern) * ns_per_ps);
  const double pulses = periods * static_cast<double>(pulses_per_period(pattern));
  const double unambiguous_ns = pattern.unambiguous_delay_ps * ns_per_ps;
  // Half-way into the unambiguous range, unless the study has its own delay.
  const double walk_ns = cell.velocity_mps.value_or(0) / speed_of_light_mps * length_ns;
  const std::optional<double> start_ns = delay_start_ns(cell.study);
  const double delay_ns = start_ns ? *start_ns + walk_ns : unambiguous_ns / 2;
  Expectation found;
  found.length_ns = length_ns;
  found.signal_photons = pulses * cell.signal_per_pulse;
  found.background_photons = found.length_ns * cell.background_per_ns;
  const Gain gain(cell, pulses, found.length_ns);
  found.gain_nats = gain.at(0).slope;
  found.gain_deviation_nats = std::sqrt(gain.at(0).curve);
  const double max_walk_ns = 2 * max_speed_mps / speed_of_light_mps * found.length_ns;
  found.threshold_nats =
      significance_threshold_nats({unambiguous_ns, max_walk_ns, pulse_sigma_ns}, 1e-3);
  found.bound = cramer_rao_bound(pattern, *make_gaussian(pulse_sigma_ns),
                                 {.length_ns = found.length_ns,
                                  .seen_ns = found.length_ns,
                                  .delay_ns = delay_ns,
                                  .velocity_mps = cell.velocity_mps.value_or(0),
                                  .signal_per_pulse = cell.signal_per_pulse,
                                  .background_per_ns = cell.background_per_ns});
  // The best fit gains 1.5 nats more than the truth: half a nat for each of three more values.
  found.chance_lost = std::min(1.0, gain.chance_below(found.threshold_nats - 1.5) +
                                        chance_of_another_turn(pattern, found.bound));
  return found;
}

// A straight line of arrival against time, through N photons at u uniform in [-1/2, 1/2]: variance
// sigma^2 / N (1 + mean(u)^2 / var(u)) at mid-frame and sigma^2 / (N var(u)) of its slope, where
// the bound has sigma^2 / <N> and 12 sigma^2 / <N>. In background, as many photons as tell as much.
CountFloor count_floor(const Bound& bound) {
  constexpr double many = 500;  // 1.002 and 1.003
  constexpr int least_photons = 5;
  constexpr int draws = 10'000;  // good to 0.003
  const double photons = std::pow(pulse_sigma_ns / bound.delay_ns, 2);
  if (photons > many) return {};
  std::mt19937_64 random(1);
  std::poisson_distribution<int> count(photons);
  std::uniform_real_distribution<double> time(-0.5, 0.5);
  double delay = 0, velocity = 0;
  for (int drawn = 0; drawn < draws;) {
    const int n = count(random);
    double sum = 0, squares = 0;
    for (int k = 0; k < n; ++k) {
      const double u = time(random);
      sum += u;
      squares += u * u;
    }
    if (n < least_photons) continue;
    ++drawn;
    const double mean = sum / n;
    const double variance = squares / n - mean * mean;
    delay += (1 + mean * mean / variance) / n;
    velocity += 1 / (n * variance);
  }
  return {std::sqrt(delay / draws * photons), std::sqrt(velocity / draws * photons / 12)};
}

bool photons_decide(const Expectation& expectation) { return expectation.chance_lost < 0.03; }

bool is_easy(const Expectation& expectation) { return expectation.chance_lost < 1e-6; }

}  // namespace splid::studies
