#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace splid {

enum class Mode { baseline, ambiguous, mrr, random, interleaved };

const char* to_string(Mode mode);
std::optional<Mode> mode_from_string(const std::string& name);

// One stretch of a pattern: a pulse train of its own period, played `repeats` times.
struct PatternSegment {
  double period_ps = 0;                // > 0
  std::vector<double> pulse_times_ps;  // in [0, period_ps), ascending, at least one
  std::vector<double> amplitudes;  // relative, >= 0, for each pulse; 1: the mean of an even train
  std::int64_t repeats = 0;        // 0: for ever

  friend bool operator==(const PatternSegment&, const PatternSegment&) = default;
};

// A measured pulse shape: the density of photons at evenly spaced offsets from the pulse time. The
// values are the coefficients of a quadratic B-spline (see make_tabulated), which is smooth between
// them and zero outside. Whoever uses the shape normalises it.
struct TabulatedPulse {
  double first_ps = 0;          // offset of the first value from the pulse time
  double step_ps = 0;           // > 0
  std::vector<double> density;  // >= 0, any scale, at least two, not all zero

  friend bool operator==(const TabulatedPulse&, const TabulatedPulse&) = default;
};

// Where a calibrated pattern comes from, and how well it is known: each std_ member is a standard
// deviation.
struct CalibrationFacts {
  std::string recording;                   // the file that it was calibrated with
  double seconds = 0;                      // of the recording that were used
  std::uint64_t photons = 0;               // in these seconds
  double signal_photons = 0;               // of these photons, those that came from the pulses
  double std_period_ps = 0;                // of calibrated_period_ps
  std::vector<double> std_pulse_times_ps;  // of each pulse of the only segment
  std::vector<double> std_amplitudes;      // of each pulse of the only segment
  std::vector<double> std_density;         // of each value of the pulse's table
  // Of the target, where it was given. Where absent, the target reads the middle of the range.
  std::optional<double> distance_m;

  friend bool operator==(const CalibrationFacts&, const CalibrationFacts&) = default;
};

// What the waveform generator plays: the pulse times and amplitudes of one pattern period, which it
// loops, sending one sync at the start of each. Times are doubles and never rounded to a grid.
struct Pattern {
  Mode mode = Mode::baseline;
  double unambiguous_delay_ps = 0;    // largest delay that the mode can tell apart
  std::vector<double> subperiods_ps;  // t_k of interleaved and MRR patterns; else empty
  // One segment; an MRR pattern has a segment for each repetition period, and plays them in turn.
  std::vector<PatternSegment> segments;
  std::optional<double> calibrated_period_ps;  // t_r,cal of [P] Eq. 20, in the tagger's clock
  std::optional<TabulatedPulse> pulse;         // the calibrated shape
  std::optional<CalibrationFacts> calibration;

  friend bool operator==(const Pattern&, const Pattern&) = default;
};

// The time after which the generator starts over and sends a sync: the only segment's period, or
// for MRR the sum over segments of period times repeats. In ps of the calibrated clock.
double pattern_period_ps(const Pattern& pattern);

// The number of pulses in one pattern period.
std::size_t pulses_per_period(const Pattern& pattern);

// The sum of the amplitudes of these pulses, and their mean.
double amplitude_per_period(const Pattern& pattern);
double mean_amplitude(const Pattern& pattern);

// Null if the pattern can be used; otherwise one sentence naming the member (as a JSON pointer such
// as /segments/0/period_ps), its value and the bound that it breaks.
std::optional<std::string> validate(const Pattern& pattern);

}  // namespace splid
