#include "estimator/paper/matched_filter.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <cstddef>
#include <vector>

#include "estimator/model/units.hpp"
#include "estimator/paper/train_photons.hpp"

namespace splid::paper {
namespace {

constexpr double most_candidates = 0x1p21;
constexpr double assumed_signal = 1;
constexpr double assumed_background_per_ns = 1e-3;

// The filter: log(1 + S~ / b~ sum_p a_p h(phase - t_p)) at the middle of each bin of the period.
std::vector<double> log_intensity(const EmissionTimes& emission, const PulseShape& shape,
                                  std::size_t bins) {
  const double bin_ns = emission.period_ns() / static_cast<double>(bins);
  // Bins that are wider than half a pulse see a wider pulse, as they would step over the true one.
  const double squeeze = std::min(1.0, shape.width_ns() / 2 / bin_ns);
  std::vector<double> density(bins);
  for (std::size_t k = 0; k < bins; ++k) {
    const double phase_ns = static_cast<double>(k) * bin_ns;
    emission.near(phase_ns, shape.first_ns() / squeeze, shape.last_ns() / squeeze,
                  [&](double offset_ns, double amplitude) {
                    density[k] += amplitude * squeeze * std::exp(shape.log_h(offset_ns * squeeze));
                  });
  }
  for (double& value : density) {
    value = std::log1p(assumed_signal / assumed_background_per_ns * value);
  }
  return density;
}

// The share of the pattern period that lies within half_ns of a pulse. Random patterns have one
// train.
double share_near_pulses(const EmissionTimes& emission, double half_ns) {
  const std::vector<double>& times_ns = emission.train().segments.front().comb.times_ns;
  double covered_ns = 0;
  for (std::size_t p = 0; p < times_ns.size(); ++p) {
    const double next_ns =
        p + 1 < times_ns.size() ? times_ns[p + 1] : times_ns.front() + emission.period_ns();
    covered_ns += std::min(next_ns - times_ns[p], 2 * half_ns);
  }
  return covered_ns / emission.period_ns();
}

}  // namespace

MatchedFilter::MatchedFilter(const EmissionTimes& emission, const PulseShape& shape) {
  const double wanted =
      std::clamp(emission.period_ns() / (shape.width_ns() / 2), 16.0, most_candidates);
  const std::size_t bins = std::bit_ceil(static_cast<std::size_t>(std::ceil(wanted)));
  bins_ = bins;
  fft_.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  std::vector<double> filter = log_intensity(emission, shape, bins);
  fft_.fwd(waves_, filter);
  // For the roots of unity of the way back.
  fft_.inv(filter, waves_, static_cast<Eigen::Index>(bins));
}

double MatchedFilter::delay_ns(const CorrectedTimes& frame) const {
  const auto bins_per_ns = static_cast<double>(bins_) / frame.period_ns;
  std::vector<double> photons(bins_);
  for (const double phase_ns : frame.phase_ns) {
    photons[static_cast<std::size_t>(std::llround(phase_ns * bins_per_ns)) % bins_] += 1;
  }
  Eigen::FFT<double> fft = fft_;
  std::vector<std::complex<double>> waves;
  fft.fwd(waves, photons);
  for (std::size_t k = 0; k < waves.size(); ++k) waves[k] *= std::conj(waves_[k]);
  std::vector<double> score;
  fft.inv(score, waves, static_cast<Eigen::Index>(bins_));
  const auto best = std::max_element(score.begin(), score.end());
  return static_cast<double>(best - score.begin()) / bins_per_ns;
}

Counting count_signal(const CorrectedTimes& frame, const EmissionTimes& emission, double width_ns,
                      double delay_ns, double max_speed_mps) {
  constexpr double least_outside = 0.01;
  const double half_ns = 2 * width_ns + 2 * max_speed_mps / speed_of_light_mps * frame.length_ns;
  const double inside_share = share_near_pulses(emission, half_ns);
  double inside = 0;
  for (const double phase_ns : frame.phase_ns) {
    if (emission.any_near(phase_ns - delay_ns, -half_ns, half_ns)) inside += 1;
  }
  const auto photons = static_cast<double>(frame.time_ns.size());
  const double outside_ns = (1 - inside_share) * frame.seen_ns;
  const double amplitude = emission.train().amplitude_per_ns * frame.seen_ns;
  if (inside_share > 1 - least_outside) {
    return {photons / 2 / amplitude, photons / 2 / frame.seen_ns};
  }
  Counting counting;
  counting.background_per_ns = (photons - inside) / outside_ns;
  const double beneath = counting.background_per_ns * inside_share * frame.seen_ns;
  counting.signal_per_pulse = std::max(0.0, inside - beneath) / amplitude;
  return counting;
}

}  // namespace splid::paper
