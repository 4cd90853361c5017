#include "daemon/study/calibration/side_lobe_report.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "daemon/base/text.hpp"
#include "estimator/model/units.hpp"

namespace splid::calibration {
namespace {

constexpr double most_photons_said = 1e9;
constexpr double m_per_ps_of_delay = speed_of_light_mps * 1e-12 / 2;

std::string photons_in_words(double photons) {
  if (photons > most_photons_said) return "no number of signal photons tells them apart";
  return grouped(static_cast<std::uint64_t>(std::ceil(photons))) +
         " signal photons a frame tell them apart";
}

}  // namespace

std::unique_ptr<PulseShape> shape_of(const Pattern& pattern, const PulseOptions& pulse) {
  if (pulse.shape == Shape::tabulated && pattern.pulse) return make_tabulated(*pattern.pulse);
  return make_gaussian(pulse.sigma_ps * ns_per_ps);
}

PatternLight light_of(const Pattern& pattern, double background_photons) {
  const double period_ns = pattern_period_ps(pattern) * ns_per_ps;
  const double a_pulse = pattern.calibration->signal_photons /
                         static_cast<double>(std::max<std::size_t>(1, pulses_per_period(pattern)));
  return {std::max(0.0, background_photons) / period_ns / a_pulse};
}

std::optional<SideLobe> hardest_delay(const Pattern& pattern, const PulseShape& shape,
                                      const PatternLight& light) {
  if (pattern.mode == Mode::ambiguous) return std::nullopt;
  const auto delays = side_lobes(pattern, shape, light, 16);
  return delays.empty() ? std::nullopt : std::optional(delays.front());
}

std::string describe_side_lobe(const Pattern& pattern, const PulseShape& shape, double length_ms) {
  PatternLight light;
  const CalibrationFacts* facts = pattern.calibration ? &*pattern.calibration : nullptr;
  if (facts != nullptr && facts->signal_photons > 0) {
    light = light_of(pattern, static_cast<double>(facts->photons) - facts->signal_photons);
  }
  const auto delay = hardest_delay(pattern, shape, light);
  if (!delay) return {};
  const double needed = photons_to_tell(*delay);
  std::string text =
      fmt::format("hardest to tell from the right delay: {:.6g} ns ({:.5g} m) away, ",
                  delay->shift_ps * ns_per_ps, delay->shift_ps * m_per_ps_of_delay) +
      photons_in_words(needed);
  if (facts == nullptr || !(facts->seconds > 0)) return text;
  const double there = facts->signal_photons / facts->seconds * length_ms * 1e-3;
  text += fmt::format("; frames of {:g} ms had ", length_ms) +
          grouped(static_cast<std::uint64_t>(there)) + " when it was calibrated";
  if (there >= needed) return text;
  return text +
         ": too few, so that ranges may be wrong by as much; give more light, longer frames, or "
         "mode ambiguous";
}

}  // namespace splid::calibration
