#include "estimator/paper/matched_filter.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <cstddef>
#include <unsupported/Eigen/FFT>
#include <vector>

#include "estimator/model/units.hpp"

namespace splid::paper {
namespace {

constexpr double most_candidates = 0x1p21;
constexpr double assumed_signal_ns = 1e3;  // S~ / b~

// The filter: log(1 + S~ / b~ sum_p a_p h(phase - t_p)) at each bin of the period.
std::vector<double> log_intensity(const Comb& comb, const PulseShape& shape, std::size_t bins) {
  const double bin_ns = comb.period_ns / static_cast<double>(bins);
  // Bins that are wider than half a pulse see a wider pulse, as they would step over the true one.
  const double squeeze = std::min(1.0, shape.width_ns() / 2 / bin_ns);
  std::vector<double> density(bins);
  for (std::size_t p = 0; p < comb.times_ns.size(); ++p) {
    const double time_ns = comb.times_ns[p];
    const double last = std::floor((time_ns + shape.last_ns() / squeeze) / bin_ns);
    double bin = std::ceil((time_ns + shape.first_ns() / squeeze) / bin_ns);
    for (; bin <= last; ++bin) {
      const double h = squeeze * std::exp(shape.log_h((bin * bin_ns - time_ns) * squeeze));
      density[static_cast<std::size_t>(fold_on(bin, static_cast<double>(bins)))] +=
          comb.amplitudes[p] * h;
    }
  }
  for (double& value : density) value = std::log1p(assumed_signal_ns * value);
  return density;
}

// The share of the period that lies within half_ns of a pulse.
double share_near_pulses(const Comb& comb, double half_ns) {
  const std::vector<double>& times_ns = comb.times_ns;
  double covered_ns = 0;
  for (std::size_t p = 0; p < times_ns.size(); ++p) {
    const double next_ns =
        p + 1 < times_ns.size() ? times_ns[p + 1] : times_ns.front() + comb.period_ns;
    covered_ns += std::min(next_ns - times_ns[p], 2 * half_ns);
  }
  return covered_ns / comb.period_ns;
}

}  // namespace

double matched_delay_ns(const FoldedFrame& frame, const PulseTrain& train,
                        const PulseShape& shape) {
  const double wanted = std::clamp(train.period_ns / (shape.width_ns() / 2), 16.0, most_candidates);
  const std::size_t bins = std::bit_ceil(static_cast<std::size_t>(std::ceil(wanted)));
  const auto bins_per_ns = static_cast<double>(bins) / train.period_ns;
  std::vector<double> photons(bins);
  for (const double phase_ns : frame.phase_ns) {
    photons[static_cast<std::size_t>(std::llround(phase_ns * bins_per_ns)) % bins] += 1;
  }
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  std::vector<std::complex<double>> waves, filter;
  fft.fwd(waves, photons);
  fft.fwd(filter, log_intensity(train.segments.front().comb, shape, bins));
  for (std::size_t k = 0; k < waves.size(); ++k) waves[k] *= std::conj(filter[k]);
  std::vector<double> score;
  fft.inv(score, waves, static_cast<Eigen::Index>(bins));
  const auto best = std::max_element(score.begin(), score.end());
  return static_cast<double>(best - score.begin()) / bins_per_ns;
}

PaperParameters count_signal(const FoldedFrame& frame, const PulseTrain& train, double width_ns,
                             double delay_ns, double max_speed_mps) {
  constexpr double least_outside = 0.01;
  const Comb& comb = train.segments.front().comb;
  const double half_ns = 2 * width_ns + 2 * max_speed_mps / speed_of_light_mps * frame.length_ns;
  const double inside_share = share_near_pulses(comb, half_ns);
  double inside = 0;
  for (const double phase_ns : frame.phase_ns) {
    if (std::abs(comb.to_nearest_ns(phase_ns - delay_ns)) <= half_ns) inside += 1;
  }
  const auto photons = static_cast<double>(frame.size());
  const double amplitude = train.amplitude_per_ns / frame.scale * frame.seen_ns;
  if (inside_share > 1 - least_outside) {
    return {delay_ns, 0, photons / 2 / amplitude, photons / 2 / frame.seen_ns};
  }
  const double background_per_ns = (photons - inside) / ((1 - inside_share) * frame.seen_ns);
  const double beneath = background_per_ns * inside_share * frame.seen_ns;
  return {delay_ns, 0, std::max(0.0, inside - beneath) / amplitude, background_per_ns};
}

}  // namespace splid::paper
