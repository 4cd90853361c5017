#include "estimator/checks/light_flicker.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "estimator/fold/dead_intervals.hpp"
#include "estimator/model/chance.hpp"

namespace splid {
namespace {

constexpr std::size_t most_parts = 128;
constexpr std::size_t fewest_parts = 16;
constexpr double most_swing = 2;  // relative rms of the light: more is not expected

// The light of a frame, by its estimate.
struct FrameLight {
  double photons = 0, pulses = 0;  // of the frame
  double of_signal = 0;            // share of the photons
  double in_a_pulse = 0;           // signal
};

FrameLight light_of(const FrameView& frame, const Estimate& estimate, const PulseTrain& train) {
  const double seen_ns = frame.seen_ns();
  const auto photons = static_cast<double>(estimate.photons);
  const double dark = estimate.background_per_ns * seen_ns * (1 - estimate.blind_fraction);
  return {photons, train.pulses_per_ns * seen_ns,
          std::clamp(1 - dark / std::max(photons, 1.0), 0.0, 1.0),
          estimate.signal_per_pulse * train.mean_amplitude()};
}

// The return signal, or the background.
struct SwingingLight {
  double share = 0;  // of the detections
  double seen = 0;   // of what the light rises by: e
  double value = 0, deviation = 0;

  // What all detections rise by, where this light rises by its own amount.
  [[nodiscard]] double rise() const { return share * seen; }
  // By how much the value is too low where the light has such a relative variance.
  [[nodiscard]] double low(double variance) const { return variance * (1 - seen) * value; }
  [[nodiscard]] bool is_low(double variance) const {
    return variance <= most_swing * most_swing && low(variance) > least_that_matters * deviation;
  }
  [[nodiscard]] bool may_be_low() const { return is_low(most_swing * most_swing); }
};

struct PartCounts {
  double parts = 0, mean = 0;
  double variance = 0;  // over the parts
};

// Parts that a loss touches do not count.
PartCounts count(const FrameView& frame) {
  const double periods =
      std::floor(static_cast<double>(frame.end_ps - frame.start_ps) / frame.sync.period_ps);
  const auto parts = static_cast<std::size_t>(std::min<double>(most_parts, periods));
  if (parts < fewest_parts) return {};
  const double part_ps = std::floor(periods / static_cast<double>(parts)) * frame.sync.period_ps;
  std::array<std::uint32_t, most_parts + 1> counts{};  // the last: what is in no whole part
  const auto part_of = [&](std::int64_t time_ps) {
    const auto part =
        static_cast<std::size_t>(static_cast<double>(time_ps - frame.start_ps) / part_ps);
    return std::min(part, parts);
  };
  for (const std::int64_t time_ps : frame.photons_ps) ++counts[part_of(time_ps)];
  std::array<bool, most_parts + 1> is_cut{};
  for (const Loss& loss : frame.losses) {
    for (std::size_t k = part_of(loss.begin_ps); k <= part_of(loss.end_ps); ++k) is_cut[k] = true;
  }
  PartCounts all;
  double sum = 0, squares = 0;
  for (std::size_t k = 0; k < parts; ++k) {
    if (is_cut[k]) continue;
    all.parts += 1;
    sum += counts[k];
    squares += static_cast<double>(counts[k]) * counts[k];
  }
  if (all.parts < fewest_parts) return {};
  all.mean = sum / all.parts;
  all.variance = (squares - sum * all.mean) / (all.parts - 1);
  return all;
}

}  // namespace

void widen_by_flicker(const FrameView& frame, const PulseTrain& train, double share,
                      Estimate& estimate) {
  const FrameLight light = light_of(frame, estimate, train);
  if (!(light.photons > 0) || !(light.in_a_pulse > 0)) return;

  // How much of what the light rises by is seen. Half of a pulse's light is `half`, and a pulse
  // with the light h shows (1 - exp(-h)) / h of it.
  const double half = std::max(light.in_a_pulse * share / 2, 1e-9);
  const double of_pulse = std::exp(-half) * std::sinh(half) / half;
  const double live =
      std::min(1.0, light.of_signal * light.photons / (light.pulses * light.in_a_pulse * of_pulse));
  const double signal_seen =
      (1 - (1 - live) * light.of_signal) * std::exp(-half) * half / std::sinh(half);
  const double background_seen = 1 - estimate.blind_fraction * (1 - light.of_signal);

  const SwingingLight signal = {light.of_signal, signal_seen, estimate.signal_per_pulse,
                                estimate.std_signal_per_pulse};
  const SwingingLight background = {1 - light.of_signal, background_seen,
                                    estimate.background_per_ns, estimate.std_background_per_ns};
  if (!signal.may_be_low() && !background.may_be_low()) return;
  const PartCounts counts = count(frame);
  const double by_chance = counts.mean * (signal.rise() + background.rise());
  const double degrees = counts.parts - 1;
  if (!(counts.variance > by_chance * chi_squared_of(million_deviations, degrees) / degrees))
    return;
  const double excess = (counts.variance - by_chance) / (counts.mean * counts.mean);
  const auto widen = [&](const SwingingLight& of, double& deviation) {
    const double variance = excess / (of.rise() * of.rise());
    if (of.is_low(variance)) deviation = in_quadrature(deviation, of.low(variance));
  };
  widen(signal, estimate.std_signal_per_pulse);
  widen(background, estimate.std_background_per_ns);
}

double low_by_split(const FrameView& frame, const Estimate& estimate, const PulseTrain& train) {
  constexpr double by_both = 2.4 / 12;
  const FrameLight light = light_of(frame, estimate, train);
  // Of a pulse with light x an input counts one photon with the chance 1 - e^-x.
  const auto light_of = [&](std::uint64_t of_input) {
    const double seen = static_cast<double>(of_input) * light.of_signal / light.pulses;
    return -std::log1p(-std::min(seen, most_blind));
  };
  double all = 0, squares = 0, cubes = 0;
  for (const std::uint64_t of_input : frame.photons_of_input) {
    const double x = light_of(of_input);
    all += x;
    squares += x * x;
    cubes += x * x * x;
  }
  if (!(all > 0)) return 0;
  const double mean = squares / (all * all);
  const double variance = std::max(0.0, cubes / (all * all * all) - mean * mean);
  return by_both * light.in_a_pulse * light.in_a_pulse * variance;
}

}  // namespace splid
