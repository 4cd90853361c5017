#include "estimator/calibration/side_lobes.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "estimator/model/units.hpp"

namespace splid::calibration {
namespace {

constexpr std::size_t max_pulses = 2'000;
constexpr std::size_t max_shifts = 4'096;
constexpr double nats_to_tell = 20;
constexpr double same_widths = 4;  // shifts that are no further apart count as the same
constexpr double steps_a_width = 8;

// A segment of the pattern, and its share of the pattern's light.
struct Part {
  const PatternSegment& segment;
  double share;
};

// What the light x of a pulse of amplitude a tells against the light y of a pulse of amplitude b
// that is `off` later, both over a background of `dark` per ns: the integral of x log(x / y) - x +
// y. Either amplitude may be zero.
class PulseContrast {
 public:
  PulseContrast(const PulseShape& shape, double dark_per_ns)
      : shape_(shape),
        dark_per_ns_(dark_per_ns),
        step_ns_(shape.width_ns() / steps_a_width),
        first_ns_(std::max(shape.first_ns(),
                           shape.peak_offset_ns() - pulse_reach_widths * shape.width_ns())),
        last_ns_(std::min(shape.last_ns(),
                          shape.peak_offset_ns() + 4 * pulse_reach_widths * shape.width_ns())) {}

  [[nodiscard]] double of(double a, double b, double off_ns) const {
    const double from = std::min(first_ns_, first_ns_ + off_ns);
    const double to = std::max(last_ns_, last_ns_ + off_ns);
    double sum = 0;
    const auto steps = static_cast<int>(std::ceil((to - from) / step_ns_));
    for (int step = 0; step < steps; ++step) {
      const double t = from + (step + 0.5) * step_ns_;
      const double x = (a > 0 ? a * std::exp(shape_.log_h(t)) : 0) + dark_per_ns_;
      const double y = (b > 0 ? b * std::exp(shape_.log_h(t - off_ns)) : 0) + dark_per_ns_;
      sum += x * std::log(x / y) - x + y;
    }
    return sum * step_ns_;
  }

 private:
  const PulseShape& shape_;
  double dark_per_ns_;
  double step_ns_;
  double first_ns_, last_ns_;
};

// Which pulse of a segment is nearest to a time, around the circle, and how far before it that time
// lies.
struct Nearest {
  std::size_t pulse;
  double off_ps;
};

Nearest nearest(const PatternSegment& segment, double time_ps) {
  const std::vector<double>& times = segment.pulse_times_ps;
  const double at = time_ps - segment.period_ps * std::floor(time_ps / segment.period_ps);
  const auto next = std::lower_bound(times.begin(), times.end(), at);
  const std::size_t after =
      next == times.end() ? 0 : static_cast<std::size_t>(next - times.begin());
  const std::size_t before = after == 0 ? times.size() - 1 : after - 1;
  const double to_after = std::remainder(times[after] - at, segment.period_ps);
  const double to_before = std::remainder(times[before] - at, segment.period_ps);
  return std::abs(to_after) <= std::abs(to_before) ? Nearest{after, to_after}
                                                   : Nearest{before, to_before};
}

// The mean distance by which the shifted pulses of all parts lie before the pulses that they fall
// on. Pulses that fall on none do not count.
double mean_off_ps(const std::vector<Part>& parts, double shift_ps, double tolerance_ps) {
  double sum = 0, light = 0;
  for (const Part& part : parts) {
    const PatternSegment& segment = part.segment;
    for (std::size_t p = 0; p < segment.pulse_times_ps.size(); ++p) {
      const Nearest on = nearest(segment, segment.pulse_times_ps[p] + shift_ps);
      if (std::abs(on.off_ps) > tolerance_ps) continue;
      const double weight = part.share * segment.amplitudes[p];
      sum += weight * on.off_ps;
      light += weight;
    }
  }
  return light > 0 ? sum / light : 0;
}

// What a segment tells against itself when it is shifted, for each unit of its amplitude.
// deviations: the standard deviations of its times, or empty.
double segment_nats(const PatternSegment& segment, const std::vector<double>& std_ps,
                    double shift_ps, const PulseContrast& contrast, double width_ps) {
  const std::size_t pulses = segment.pulse_times_ps.size();
  const double within_ps = 2 * pulse_reach_widths * width_ps;
  std::vector<bool> is_met(pulses);
  // A pulse that falls on no other tells the same at every place, and so does a pulse that no other
  // falls on. So these values are kept by amplitude.
  double alone_of = -1, alone = 0, new_of = -1, anew = 0;
  double nats = 0, light = 0, noise = 0;
  for (std::size_t p = 0; p < pulses; ++p) {
    // The light is that of the pattern itself; the shifted pattern is compared with it.
    const Nearest on = nearest(segment, segment.pulse_times_ps[p] - shift_ps);
    const double a = segment.amplitudes[p];
    light += a;
    if (std::abs(on.off_ps) > within_ps) {
      if (a != alone_of) alone = contrast.of(alone_of = a, 0, 0);
      nats += alone;
      continue;
    }
    is_met[on.pulse] = true;
    nats += contrast.of(a, segment.amplitudes[on.pulse], on.off_ps * ns_per_ps);
    if (!std_ps.empty()) {
      noise += a * (std_ps[p] * std_ps[p] + std_ps[on.pulse] * std_ps[on.pulse]);
    }
  }
  for (std::size_t q = 0; q < pulses; ++q) {
    if (is_met[q]) continue;
    const double b = segment.amplitudes[q];
    if (b != new_of) anew = contrast.of(0, new_of = b, 0);
    nats += anew;
  }
  return std::max(0.0, nats - noise / (2 * width_ps * width_ps)) / light;
}

// The shifts worth a look: differences of two pulse times around the circle, ascending. Where there
// are many, those that most pairs of pulses share.
std::vector<double> shifts_of(const PatternSegment& segment, double same_ps, std::size_t most) {
  std::vector<double> all;
  for (const double from : segment.pulse_times_ps) {
    for (const double to : segment.pulse_times_ps) {
      const double apart = to - from;
      if (apart != 0) all.push_back(apart > 0 ? apart : apart + segment.period_ps);
    }
  }
  std::sort(all.begin(), all.end());
  struct Lobe {
    std::size_t pairs;
    double shift_ps;
  };
  std::vector<Lobe> lobes;
  for (std::size_t begin = 0; begin < all.size();) {
    std::size_t end = begin;
    while (end < all.size() && all[end] - all[begin] <= same_ps) ++end;
    lobes.push_back({end - begin, all[begin + (end - begin) / 2]});
    begin = end;
  }
  std::sort(lobes.begin(), lobes.end(), [](const Lobe& a, const Lobe& b) {
    return a.pairs != b.pairs ? a.pairs > b.pairs : a.shift_ps < b.shift_ps;
  });
  lobes.resize(std::min(lobes.size(), most));
  std::vector<double> shifts;
  shifts.reserve(lobes.size());
  for (const Lobe& lobe : lobes) shifts.push_back(lobe.shift_ps);
  return shifts;
}

// The shifts worth a look of segments that are played in turn: the shifts of each segment, and
// these and whole periods of the segment added up, up to the range.
std::vector<double> shifts_in_turn(const Pattern& pattern, double same_ps, std::size_t most) {
  std::vector<double> shifts;
  for (const PatternSegment& segment : pattern.segments) {
    std::vector<double> within = shifts_of(segment, same_ps, most);
    within.push_back(segment.period_ps);
    for (const double shift : within) {
      for (double at = shift;
           at < pattern.unambiguous_delay_ps - same_ps && shifts.size() < max_shifts;
           at += segment.period_ps) {
        if (at > same_ps) shifts.push_back(at);
      }
    }
  }
  std::sort(shifts.begin(), shifts.end());
  return shifts;
}

std::vector<Part> parts_of(const Pattern& pattern) {
  std::vector<Part> parts;
  double all = 0;
  for (const PatternSegment& segment : pattern.segments) {
    double light = 0;
    for (const double amplitude : segment.amplitudes) light += amplitude;
    light *= pattern.segments.size() == 1 ? 1 : static_cast<double>(segment.repeats);
    parts.push_back({segment, light});
    all += light;
  }
  for (Part& part : parts) part.share /= all;
  return parts;
}

}  // namespace

std::vector<SideLobe> side_lobes(const Pattern& pattern, const PulseShape& shape,
                                 const PatternLight& light, std::size_t most) {
  for (const PatternSegment& segment : pattern.segments) {
    if (segment.pulse_times_ps.size() > max_pulses) return {};
  }
  const double width_ps = shape.width_ns() / ns_per_ps;
  const double same_ps = same_widths * width_ps;
  const bool single = pattern.segments.size() == 1;
  const std::vector<Part> parts = parts_of(pattern);
  // Without any background a single photon would settle what in truth takes several.
  const PulseContrast contrast(shape, std::max(light.background_per_signal, 1e-4));
  const std::vector<double> std_ps = single && pattern.calibration
                                         ? pattern.calibration->std_pulse_times_ps
                                         : std::vector<double>();
  std::vector<SideLobe> found;
  for (double shift_ps : single ? shifts_of(pattern.segments.front(), same_ps, most)
                                : shifts_in_turn(pattern, same_ps, most)) {
    shift_ps += mean_off_ps(parts, shift_ps, 8 * width_ps);
    double nats = 0;
    for (const Part& part : parts) {
      nats += part.share * segment_nats(part.segment, std_ps, shift_ps, contrast, width_ps);
    }
    const bool is_known = std::any_of(found.begin(), found.end(), [&](const SideLobe& other) {
      return std::abs(other.shift_ps - shift_ps) < same_ps;
    });
    if (!is_known) found.push_back({shift_ps, nats});
  }
  std::sort(found.begin(), found.end(), [](const SideLobe& a, const SideLobe& b) {
    return a.nats_per_photon != b.nats_per_photon ? a.nats_per_photon < b.nats_per_photon
                                                  : a.shift_ps < b.shift_ps;
  });
  found.resize(std::min(found.size(), most));
  return found;
}

double photons_to_tell(const SideLobe& delay) {
  return delay.nats_per_photon > 0 ? nats_to_tell / delay.nats_per_photon
                                   : std::numeric_limits<double>::infinity();
}

std::optional<double> even_spacing_ps(const std::vector<SideLobe>& delays,
                                      double unambiguous_delay_ps, double signal_photons,
                                      double width_ps) {
  double least_ps = unambiguous_delay_ps;
  for (const SideLobe& delay : delays) {
    if (photons_to_tell(delay) <= signal_photons) continue;
    least_ps = std::min({least_ps, delay.shift_ps, unambiguous_delay_ps - delay.shift_ps});
  }
  const double turns = std::round(unambiguous_delay_ps / least_ps);
  if (turns < 2) return std::nullopt;
  const double spacing_ps = unambiguous_delay_ps / turns;
  if (std::abs(spacing_ps - least_ps) > width_ps) return std::nullopt;
  return spacing_ps;
}

}  // namespace splid::calibration
