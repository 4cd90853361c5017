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
  std::vector<double> amplitudes;  // relative, >= 0, one a pulse; 1 is the mean of an even train
  std::int64_t repeats = 0;        // 0: for ever

  friend bool operator==(const PatternSegment&, const PatternSegment&) = default;
};

// A measured pulse shape: h at evenly spaced offsets from the pulse time, smooth between them (a
// quadratic B-spline of which these are the coefficients: see make_tabulated), zero outside.
// Normalised by its user.
struct TabulatedPulse {
  double first_ps = 0;          // offset of the first value from the pulse time
  double step_ps = 0;           // > 0
  std::vector<double> density;  // >= 0, any scale, at least two, not all zero

  friend bool operator==(const TabulatedPulse&, const TabulatedPulse&) = default;
};

// Where a calibrated pattern comes from, and how well it is known: standard deviations.
struct CalibrationFacts {
  std::string recording;                   // file
  double seconds = 0;                      // of it that were used
  std::uint64_t photons = 0;               // in it
  double signal_photons = 0;               // of which so many from the pulses
  double std_period_ps = 0;                // of calibrated_period_ps
  std::vector<double> std_pulse_times_ps;  // one a pulse, of the only segment
  std::vector<double> std_amplitudes;      // likewise
  std::vector<double> std_density;         // one a value of the pulse's table
  std::optional<double> distance_m;  // of the target, where it was given; absent: distances are
                                     // relative to it

  friend bool operator==(const CalibrationFacts&, const CalibrationFacts&) = default;
};

// What the waveform generator plays: the pulse times and amplitudes of one pattern period, which it
// loops, sending one sync at the start of each. Times are doubles and never rounded to a grid.
struct Pattern {
  Mode mode = Mode::baseline;
  double unambiguous_delay_ps = 0;             // largest delay that the mode can tell apart
  std::vector<double> subperiods_ps;           // t_k of interleaved and MRR patterns; else empty
  std::vector<PatternSegment> segments;        // one; for MRR one a repetition period, run in turn
  std::optional<double> calibrated_period_ps;  // t_r,cal of [P] Eq. 20, in the tagger's clock
  std::optional<TabulatedPulse> pulse;         // calibrated shape
  std::optional<CalibrationFacts> calibration;

  friend bool operator==(const Pattern&, const Pattern&) = default;
};

// The time after which the generator starts over, one sync each: the only segment's period, or for
// MRR the sum over segments of period times repeats. In ps of the calibrated clock.
double pattern_period_ps(const Pattern& pattern);

// All pulses in one pattern period.
std::size_t pulses_per_period(const Pattern& pattern);

// Null if the pattern can be used; otherwise one sentence naming the member (as a JSON pointer such
// as /segments/0/period_ps), its value and the bound that it breaks.
std::optional<std::string> validate(const Pattern& pattern);

}  // namespace splid
