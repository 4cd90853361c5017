#include "daemon/study/calibration/side_lobe_report.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "daemon/base/text.hpp"
#include "estimator/calibration/side_lobes.hpp"
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

std::string describe_side_lobe(const Pattern& pattern, const PulseShape& shape, double length_ms) {
  if (pattern.mode == Mode::ambiguous) return {};
  const CalibrationFacts* facts = pattern.calibration ? &*pattern.calibration : nullptr;
  double background_per_signal = usual_background_per_signal;
  if (facts != nullptr && facts->signal_photons > 0) {
    const double photons = static_cast<double>(facts->photons) - facts->signal_photons;
    const double a_pulse = facts->signal_photons / static_cast<double>(pulses_per_period(pattern));
    background_per_signal =
        std::max(0.0, photons) / (pattern_period_ps(pattern) * ns_per_ps) / a_pulse;
  }
  const auto delay = hardest_delay(pattern, shape, background_per_signal);
  if (!delay) return {};
  const double needed = delay->photons_to_tell();
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
