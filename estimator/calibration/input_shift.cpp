#include "estimator/calibration/input_shift.hpp"

#include <cmath>
#include <cstddef>
#include <vector>

#include "estimator/model/chance.hpp"

namespace splid::calibration {
namespace {

constexpr double agreeing_widths = 0.2;

// The shift if pulse `lag` of the second input is pulse 0 of the first.
InputShift shift_at(const Calibration& first, const Calibration& second, std::size_t lag) {
  const std::size_t pulses = first.pulses.size();
  const double period_ps = first.period_ps;
  std::vector<double> offs_ps(pulses);
  const double about_ps =
      std::remainder(second.pulses[lag].time_ps - first.pulses[0].time_ps, period_ps);
  double mean_ps = 0, variance = 0;
  for (std::size_t p = 0; p < pulses; ++p) {
    const CalibratedPulse& a = first.pulses[p];
    const CalibratedPulse& b = second.pulses[(p + lag) % pulses];
    offs_ps[p] = about_ps + std::remainder(b.time_ps - a.time_ps - about_ps, period_ps);
    mean_ps += offs_ps[p] / static_cast<double>(pulses);
    variance += a.std_time_ps * a.std_time_ps + b.std_time_ps * b.std_time_ps;
  }
  InputShift shift{std::remainder(mean_ps, period_ps),
                   std::sqrt(variance) / static_cast<double>(pulses), 0};
  for (const double off_ps : offs_ps) {
    shift.rms_ps += (off_ps - mean_ps) * (off_ps - mean_ps) / static_cast<double>(pulses);
  }
  shift.rms_ps = std::sqrt(shift.rms_ps);
  return shift;
}

}  // namespace

std::optional<InputShift> shift_between(const Calibration& first, const Calibration& second) {
  const std::size_t pulses = first.pulses.size();
  if (pulses == 0 || second.pulses.size() != pulses) return std::nullopt;
  std::optional<InputShift> best;
  for (std::size_t lag = 0; lag < pulses; ++lag) {
    const InputShift shift = shift_at(first, second, lag);
    // The deviation of this pulse in both inputs together.
    const double noise_ps = shift.std_ps * std::sqrt(static_cast<double>(pulses));
    const bool as_good = best && std::abs(shift.rms_ps - best->rms_ps) < noise_ps;
    if (!best || (as_good ? std::abs(shift.shift_ps) < std::abs(best->shift_ps)
                          : shift.rms_ps < best->rms_ps)) {
      best = shift;
    }
  }
  const double noise_ps = best->std_ps * std::sqrt(static_cast<double>(pulses));
  const double agreeing_ps = std::max(agreeing_widths * first.width_ps, sure_deviations * noise_ps);
  if (best->rms_ps > agreeing_ps) return std::nullopt;
  return best;
}

}  // namespace splid::calibration
