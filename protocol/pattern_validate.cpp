#include <algorithm>
#include <cmath>

#include "protocol/json_writer.hpp"
#include "protocol/pattern.hpp"

namespace splid {
namespace {

using Finding = std::optional<std::string>;

// Design note: a pattern is played thousands of times a frame. A pattern that takes over a second
// is played less than once, and products of its times in picoseconds would exceed what doubles hold
// exactly.
constexpr double max_period_ps = 1e12;

// The search sorts photons by the segment that they may have left in, and by one more group for
// those between two, in numbers of 8 bits.
constexpr std::size_t max_segments = 255;

std::string as_text(double value) {
  return std::isfinite(value) ? number_text(value) : std::string("not finite");
}

Finding fault(const std::string& pointer, const std::string& value, const std::string& bound) {
  return pointer + ": " + value + "; " + bound;
}

Finding check_duration(const std::string& pointer, double value_ps, double max_ps) {
  if (value_ps > 0 && value_ps <= max_ps) return std::nullopt;
  return fault(pointer, as_text(value_ps),
               "it must be above 0 and at most " + number_text(max_ps) + " ps");
}

Finding check_times(const std::string& pointer, const PatternSegment& segment) {
  const std::vector<double>& times_ps = segment.pulse_times_ps;
  if (times_ps.empty()) return fault(pointer, "empty", "a segment has at least one pulse");
  for (std::size_t i = 0; i < times_ps.size(); ++i) {
    const std::string place = pointer + "/" + std::to_string(i);
    if (!(times_ps[i] >= 0 && times_ps[i] < segment.period_ps)) {
      return fault(place, as_text(times_ps[i]),
                   "it must be from 0 to below the segment's period, " +
                       number_text(segment.period_ps) + " ps");
    }
    if (i > 0 && !(times_ps[i] > times_ps[i - 1])) {
      return fault(place, as_text(times_ps[i]),
                   "it must be above the pulse before, " + number_text(times_ps[i - 1]) + " ps");
    }
  }
  return std::nullopt;
}

// Checks values that are weights: finite, not negative, not all zero.
Finding check_weights(const std::string& pointer, const std::vector<double>& weights) {
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (std::isfinite(weights[i]) && weights[i] >= 0) continue;
    return fault(pointer + "/" + std::to_string(i), as_text(weights[i]),
                 "it must be finite and at least 0");
  }
  const bool any = std::any_of(weights.begin(), weights.end(), [](double w) { return w > 0; });
  return any ? std::nullopt : fault(pointer, "all 0", "one at least must be above 0");
}

Finding check_amplitudes(const std::string& pointer, const PatternSegment& segment) {
  if (segment.amplitudes.size() != segment.pulse_times_ps.size()) {
    return fault(pointer, std::to_string(segment.amplitudes.size()) + " amplitudes",
                 "there must be one a pulse, " + std::to_string(segment.pulse_times_ps.size()));
  }
  return check_weights(pointer, segment.amplitudes);
}

Finding check_segment(const std::string& pointer, const PatternSegment& segment, bool only_one) {
  if (auto found = check_duration(pointer + "/period_ps", segment.period_ps, max_period_ps)) {
    return found;
  }
  if (auto found = check_times(pointer + "/pulse_times_ps", segment)) return found;
  if (auto found = check_amplitudes(pointer + "/amplitudes", segment)) return found;
  const std::int64_t least = only_one ? 0 : 1;
  const double most = max_period_ps / segment.period_ps;
  if (segment.repeats >= least && static_cast<double>(segment.repeats) <= most) return std::nullopt;
  return fault(pointer + "/repeats", std::to_string(segment.repeats),
               "it must be at least " + std::to_string(least) +
                   (only_one ? "" : ", as there are several segments,") + " and at most " +
                   number_text(std::floor(most)) + " (1 s in all)");
}

Finding check_segments(const Pattern& pattern) {
  const std::size_t count = pattern.segments.size();
  if (count == 0) return fault("/segments", "empty", "a pattern has at least one segment");
  const bool mrr = pattern.mode == Mode::mrr;
  if (mrr != (count > 1)) {
    return fault("/segments", std::to_string(count) + " segments",
                 std::string("mode ") + to_string(pattern.mode) +
                     (mrr ? " needs two or more" : " has exactly one"));
  }
  if (count > max_segments) {
    return fault("/segments", std::to_string(count) + " segments",
                 "there must be at most " + std::to_string(max_segments));
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::string pointer = "/segments/" + std::to_string(i);
    if (auto found = check_segment(pointer, pattern.segments[i], count == 1)) return found;
  }
  return std::nullopt;
}

// Design note: a generator's sample clock may stretch all times by parts in 1e6, each rounded on
// its own; a subperiod that is wrong at all is off by far more.
bool nearly_equal(double a, double b) { return std::abs(a - b) <= 1e-6 * std::abs(b); }

Finding check_subperiod(const Pattern& pattern, std::size_t k, double period_ps) {
  const std::string pointer = "/subperiods_ps/" + std::to_string(k);
  const double value_ps = pattern.subperiods_ps[k];
  if (auto found = check_duration(pointer, value_ps, period_ps)) return found;
  if (pattern.mode == Mode::mrr) {
    if (nearly_equal(value_ps, pattern.segments[k].period_ps)) return std::nullopt;
    return fault(pointer, as_text(value_ps),
                 "it must be the period of segment " + std::to_string(k) + ", " +
                     number_text(pattern.segments[k].period_ps) + " ps");
  }
  if (nearly_equal(value_ps * std::round(period_ps / value_ps), period_ps)) return std::nullopt;
  return fault(pointer, as_text(value_ps),
               "the pattern period, " + number_text(period_ps) + " ps, must be a multiple of it");
}

Finding check_subperiods(const Pattern& pattern, double period_ps) {
  const std::size_t count = pattern.subperiods_ps.size();
  const std::string mode = std::string("mode ") + to_string(pattern.mode);
  const std::string given = std::to_string(count) + " subperiods";
  if (pattern.mode == Mode::mrr && count != pattern.segments.size()) {
    return fault("/subperiods_ps", given, mode + " needs one a segment");
  }
  if (pattern.mode == Mode::interleaved && count < 2) {
    return fault("/subperiods_ps", given, mode + " needs two or more");
  }
  if (pattern.mode != Mode::mrr && pattern.mode != Mode::interleaved && count > 0) {
    return fault("/subperiods_ps", given, mode + " has none");
  }
  for (std::size_t k = 0; k < count; ++k) {
    if (auto found = check_subperiod(pattern, k, period_ps)) return found;
  }
  return std::nullopt;
}

Finding check_pulse(const TabulatedPulse& pulse) {
  if (!std::isfinite(pulse.first_ps)) {
    return fault("/pulse/first_ps", as_text(pulse.first_ps), "it must be finite");
  }
  if (auto found = check_duration("/pulse/step_ps", pulse.step_ps, max_period_ps)) return found;
  if (pulse.density.size() < 2) {
    return fault("/pulse/density", std::to_string(pulse.density.size()) + " values",
                 "a shape has at least 2");
  }
  return check_weights("/pulse/density", pulse.density);
}

// Design note: two crystals differ by 100 ppm at worst; a calibrated period off by 1 % belongs to
// another pattern.
Finding check_calibrated_period(double calibrated_ps, double period_ps) {
  if (std::abs(calibrated_ps - period_ps) <= 0.01 * period_ps) return std::nullopt;
  return fault("/calibrated_period_ps", as_text(calibrated_ps),
               "it must be within 1 % of the pattern period, " + number_text(period_ps) + " ps");
}

Finding check_deviations(const std::string& key, const std::vector<double>& values,
                         std::size_t count, const char* of_what) {
  const std::string pointer = "/calibration/" + key;
  if (values.size() != count) {
    return fault(pointer, std::to_string(values.size()) + " values",
                 std::string("there must be one a ") + of_what + ", " + std::to_string(count));
  }
  return std::all_of(values.begin(), values.end(),
                     [](double value) { return std::isfinite(value) && value >= 0; })
             ? std::nullopt
             : fault(pointer, "a value negative or not finite", "all must be at least 0");
}

Finding check_calibration(const Pattern& pattern) {
  const CalibrationFacts& facts = *pattern.calibration;
  const std::size_t pulses = pattern.segments.front().pulse_times_ps.size();
  if (auto found =
          check_deviations("std_pulse_times_ps", facts.std_pulse_times_ps, pulses, "pulse")) {
    return found;
  }
  if (auto found = check_deviations("std_amplitudes", facts.std_amplitudes, pulses, "pulse")) {
    return found;
  }
  return check_deviations("std_density", facts.std_density,
                          pattern.pulse ? pattern.pulse->density.size() : 0,
                          "value of /pulse/density");
}

}  // namespace

std::optional<std::string> validate(const Pattern& pattern) {
  if (auto found = check_segments(pattern)) return found;
  const double period_ps = pattern_period_ps(pattern);
  if (auto found = check_duration("/segments", period_ps, max_period_ps)) return found;
  if (auto found = check_subperiods(pattern, period_ps)) return found;
  // An MRR pattern tells delays apart up to the LCM of its periods, however long it plays.
  const double max_delay_ps = pattern.mode == Mode::mrr ? max_period_ps : period_ps;
  if (auto found =
          check_duration("/unambiguous_delay_ps", pattern.unambiguous_delay_ps, max_delay_ps)) {
    return found;
  }
  if (pattern.calibrated_period_ps) {
    if (auto found = check_calibrated_period(*pattern.calibrated_period_ps, period_ps)) {
      return found;
    }
  }
  if (pattern.pulse) {
    if (auto found = check_pulse(*pattern.pulse)) return found;
  }
  return pattern.calibration ? check_calibration(pattern) : std::nullopt;
}

}  // namespace splid
