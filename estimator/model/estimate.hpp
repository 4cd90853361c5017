#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "protocol/messages.hpp"

namespace splid {

// Why the refinement stopped.
enum class Stop {
  not_run,
  step_small,    // |d tau| < 1e-6 sigma and |d v| < 1e-6 sigma c / t_a
  gain_small,    // l(k+1) - l(k) < 1e-10
  rounds_spent,  // k == 40; the estimate may be improved
  beaten,        // l(k) and three times what a parabola through it gains are below another maximum
};

// What the estimator found in a frame. status is one of ok, no_target, ambiguous, no_sync and, for
// the caller's use, not_run. Values are finite whenever has_values.
struct Estimate {
  FrameStatus status = FrameStatus::not_run;
  bool has_values = false;    // a fit was made; false: only background_per_ns holds
  double delay_ns = 0;        // round trip at mid-frame, in [0, unambiguous delay)
  double delay_start_ns = 0;  // round trip at the frame's start, as [P] gives it
  double velocity_mps = 0;
  double signal_per_pulse = 0;   // S, counts
  double background_per_ns = 0;  // b, counts
  double std_delay_ns = 0;       // one standard deviation each, from the observed information
  double std_velocity_mps = 0;
  double std_signal_per_pulse = 0;
  double std_background_per_ns = 0;
  double significance_nats = 0;  // log-likelihood gained over no target
  double threshold_nats = 0;     // what false_alarm_rate asks of it
  double range_odds_nats = 0;    // of the range against all others; see RangeOdds
  // Relative rms deviation of the pulses' light from the pattern's amplitudes, where it is surely
  // there; see PatternCheck.
  std::optional<double> amplitude_misfit;
  // What the photons have against the pattern itself; the status is then no_target.
  PatternFault pattern_fault = PatternFault::none;
  Stop stop = Stop::not_run;
  std::size_t photons = 0;
};

// Where a target was when it was last seen, so that the next frame can look there first. A target
// is followed for 20 frames at most before the whole range is searched again: what looks like it at
// a wrong place (a comb fits itself in part) cannot hold on for longer than that.
struct TargetTrack {
  bool valid = false;
  std::int64_t mid_ps = 0;  // of the frame, tagger's clock
  double delay_ns = 0;      // round trip at mid_ps
  double velocity_mps = 0;
  double nats_per_ns = 0;   // log-likelihood gained by the frame of the last search, per time seen
  double odds_per_nat = 0;  // of that frame's range, over the same
  int followed = 0;         // frames since that search
};

}  // namespace splid
