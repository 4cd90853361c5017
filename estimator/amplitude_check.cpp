#include "estimator/amplitude_check.hpp"

#include <algorithm>
#include <cmath>

namespace splid {
namespace {

constexpr std::size_t fewest_pulses = 4;
constexpr std::size_t most_photons = 65536;
// 87 % of a gaussian's light, and not much background.
constexpr double half_window_widths = 1.5;
constexpr double least_misfit = 0.1;
constexpr double deviations_of_chance = 6;

}  // namespace

AmplitudeCheck::AmplitudeCheck(const PulseTrain& train, const PulseShape& shape)
    : train_(train), window_ns_(2 * half_window_widths * shape.width_ns()) {
  const Comb& comb = train.stretches.front().comb;
  if (!train.single() || comb.times_ns.size() < fewest_pulses) return;
  const double peak_ns = shape.peak_offset_ns();
  windows_ = comb_windows(train, peak_ns - window_ns_ / 2, peak_ns + window_ns_ / 2);
  counts_.resize(comb.times_ns.size());
}

std::optional<double> AmplitudeCheck::misfit(const FoldedFrame& frame,
                                             const FrameParameters& found) {
  if (windows_.empty() || frame.size() == 0) return std::nullopt;
  const Comb& comb = train_.stretches.front().comb;
  const double share = count_near(frame, found.line);
  const double periods = frame.seen_ns / (train_.period_ns * frame.scale);
  const double background = found.background_per_ns * window_ns_ * frame.scale * periods * share;
  double all = 0;
  for (const double count : counts_) all += count;
  const double signal = all - background * static_cast<double>(counts_.size());
  if (!(signal > 0)) return std::nullopt;
  double excess = 0, chance = 0, scale = 0;
  for (std::size_t p = 0; p < counts_.size(); ++p) {
    const double light = signal * comb.amplitudes[p] / comb.total_amplitude;
    const double expected = light + background;
    const double off = counts_[p] - expected;
    // A count of Poisson's has variance E, and (n - E)^2 one of 2 E^2 + E.
    excess += off * off - expected;
    chance += 2 * expected * expected + expected;
    scale += light * light;
  }
  if (excess < deviations_of_chance * std::sqrt(chance)) return std::nullopt;
  const double misfit = std::sqrt(excess / scale);
  return misfit < least_misfit ? std::nullopt : std::optional(misfit);
}

// Returns the share of the photons that was looked at.
double AmplitudeCheck::count_near(const FoldedFrame& frame, DelayLine line) {
  const CombWindow& window = windows_.front();
  const double period_ns = train_.stretches.front().comb.period_ns;
  const double turns = line.delay_ns / period_ns;
  const double slope = line.drift_ns / (frame.length_ns * period_ns);
  const std::size_t step = 1 + (frame.size() - 1) / most_photons;
  std::fill(counts_.begin(), counts_.end(), 0.0);
  for (std::size_t i = 0; i < frame.size(); i += step) {
    double phase = frame.phase_ns[i] / period_ns - turns - slope * frame.time_ns[i];
    phase -= std::floor(phase);
    const auto phase_32 = static_cast<std::uint32_t>(static_cast<std::uint64_t>(phase * 0x1p32));
    for (const CombWindow::Pulse& pulse : window.candidates(phase_32)) {
      const double residual_ns = phase * period_ns - pulse.time_ns;
      const bool inside = residual_ns >= window.first_ns() && residual_ns <= window.last_ns();
      counts_[window.index_of(pulse)] += inside ? 1 : 0;
    }
  }
  return 1 / static_cast<double>(step);
}

}  // namespace splid
