#include "estimator/calibration/side_lobes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "estimator/model/pulse_train.hpp"
#include "estimator/model/units.hpp"
#include "protocol/pattern_side_lobes.hpp"

namespace splid::calibration {
namespace {

constexpr std::size_t most_pulses = 2'000;
constexpr std::size_t most_shifts = 4'096;
constexpr double nats_to_tell = 20;

// A pattern against itself at a shift.
struct OnItself {
  double nats = 0;              // that a photon tells against the shift
  double near = 0, off_ns = 0;  // the light of pulses that coincide, and how late it is
};

OnItself on_itself(const PulseTrain& train, double shift_ns, double width_ns, double most_nats) {
  OnItself sums;
  for (const PulseTrain::Segment& segment : train.segments) {
    const Comb& comb = segment.comb;
    const double turns = (segment.end_ns - segment.begin_ns) / comb.period_ns;
    const double share = turns / (train.amplitude_per_ns * train.period_ns);
    for (std::size_t p = 0; p < comb.times_ns.size(); ++p) {
      const double light = share * comb.amplitudes[p];
      const double off_ns = -comb.to_nearest_ns(comb.times_ns[p] + shift_ns);
      const double nats = std::pow(off_ns / width_ns, 2) / 2;
      sums.nats += light * std::min(nats, most_nats);
      if (std::abs(off_ns) > pulse_reach_widths * width_ns) continue;
      sums.near += light;
      sums.off_ns += light * off_ns;
    }
  }
  return sums;
}

std::vector<double> shifts_ns(const Pattern& pattern, const PulseTrain& train, double width_ns) {
  std::vector<double> shifts;
  if (train.single()) {
    const auto highest = highest_side_lobe(pattern, 2 * width_ns / ns_per_ps);
    if (highest) shifts.push_back(highest->shift_ps * ns_per_ps);
    const std::vector<double>& times_ns = train.segments.front().comb.times_ns;
    for (const double time_ns : times_ns) shifts.push_back(time_ns - times_ns.front());
  }
  for (const PulseTrain::Segment& segment : train.segments) {
    double shift_ns = segment.comb.period_ns;
    for (; shift_ns < train.circle_ns && shifts.size() < most_shifts;
         shift_ns += segment.comb.period_ns) {
      shifts.push_back(shift_ns);
    }
  }
  return shifts;
}

// What the photons of the recording tell of the pattern against the same pattern turned by so many
// pulses. The calibration's own deviations make a part of the differences, which is taken off.
double nats_against(const Calibration& found, std::size_t turned) {
  const std::size_t pulses = found.pulses.size();
  const double shift_ps =
      found.period_ps * static_cast<double>(turned) / static_cast<double>(pulses);
  double chi_squared = 0;
  for (std::size_t p = 0; p < pulses; ++p) {
    const CalibratedPulse& own = found.pulses[p];
    const CalibratedPulse& other = found.pulses[(p + turned) % pulses];
    const double later_ps = std::remainder(other.time_ps - own.time_ps - shift_ps, found.period_ps);
    const double time = later_ps / own.std_time_ps;
    const double amplitude = (other.amplitude - own.amplitude) / own.std_amplitude;
    chi_squared += time * time + amplitude * amplitude;
  }
  const double by_chance = 4 * static_cast<double>(pulses - 1);
  return std::max(0.0, chi_squared - by_chance) / 2;
}

}  // namespace

double SideLobe::photons_to_tell() const { return nats_to_tell / nats_per_photon; }

std::optional<SideLobe> hardest_delay(const Pattern& pattern, const PulseShape& shape,
                                      double background_per_signal) {
  for (const PatternSegment& segment : pattern.segments) {
    if (segment.pulse_times_ps.size() > most_pulses) return std::nullopt;
  }
  const PulseTrain train(pattern);
  const double width_ns = shape.width_ns();
  // The mean of log(h / background) over a gaussian.
  const double h_per_ns = 1 / (width_ns * std::sqrt(2 * std::numbers::pi * std::numbers::e));
  const double most_nats =
      std::max(1.0, std::log(h_per_ns / std::max(background_per_signal, 1e-4)));
  double noise = 0;
  if (train.single() && pattern.calibration) {
    const std::vector<double>& std_ps = pattern.calibration->std_pulse_times_ps;
    const double squares = std::inner_product(std_ps.begin(), std_ps.end(), std_ps.begin(), 0.0);
    const auto pulses = static_cast<double>(std::max<std::size_t>(1, std_ps.size()));
    noise = squares / pulses * std::pow(ns_per_ps / width_ns, 2);
  }
  std::optional<SideLobe> hardest;
  const double apart_ps = pulse_reach_widths * width_ns / ns_per_ps;
  for (double shift_ns : shifts_ns(pattern, train, width_ns)) {
    const OnItself there = on_itself(train, shift_ns, width_ns, most_nats);
    if (there.near > 0) shift_ns -= there.off_ns / there.near;
    const double shift_ps = shift_ns / ns_per_ps;
    if (shift_ps < apart_ps || shift_ps > pattern.unambiguous_delay_ps - apart_ps) continue;
    const double nats = on_itself(train, shift_ns, width_ns, most_nats).nats - noise;
    if (hardest && nats >= hardest->nats_per_photon) continue;
    hardest = SideLobe{shift_ps, std::max(0.0, nats)};
  }
  return hardest;
}

std::size_t ranges_alike(const Calibration& calibration, double frame_s) {
  const std::size_t pulses = calibration.pulses.size();
  for (std::size_t turned = 1; turned < pulses; ++turned) {
    if (pulses % turned != 0) continue;
    const double nats = nats_against(calibration, turned) * frame_s / calibration.seconds;
    if (nats < nats_to_tell) return pulses / turned;
  }
  return 1;
}

}  // namespace splid::calibration
