#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "estimator/model/finding.hpp"
#include "estimator/model/options.hpp"
#include "protocol/frame_status.hpp"

// The room model/ holds what goes into the estimator and what comes out of it. Open this file
// first. Its parts:
//   frame_view.hpp     one frame: photons, losses, and the pattern's clock
//   estimate.hpp       the result for one frame, and the track from one frame to the next
//   finding.hpp        what the photons say beyond the fitted model
//   options.hpp        the estimator's sections of the configuration
//   pulse_train.hpp    the pattern, as combs of pulses that are played in turn
//   comb.hpp           one comb, and which of its pulses are near a phase
//   comb_meetings.hpp  where the combs of two targets meet
//   pulse_shape.hpp    the detected pulse, and the one that the configuration asks for
//   pulse_kernels.hpp  its inner loop, and vector_level.hpp, for which vectors that is compiled
//   units.hpp          constants
//   chance.hpp         what chance exceeds how rarely

namespace splid {

// Why a maximization stopped, as a condition on its last step from l(k) to l(k+1).
enum class Stop {
  not_run,
  step_small,    // |d tau| < 1e-6 sigma and |d v| < 1e-6 sigma c / t_a
  gain_small,    // l(k+1) - l(k) < 1e-10
  rounds_spent,  // k == 40; more rounds might improve the estimate
  beaten,        // l(k), and three times what a parabola through it still gains, stay below another
                 // maximum that has been found already
};

// A target of a frame. Where has_values is true all values are finite. Delays are in the clock of
// `drift.reference`, the tagger's by default; rates count the tagger's nanoseconds. The velocity is
// the same in either clock, as it is a ratio of two rates that the same tagger has counted. std_*:
// one standard deviation, from the observed information.
struct TargetEstimate {
  FrameStatus status = FrameStatus::not_run;
  double delay_ns = 0;          // round trip at mid-frame, in [0, unambiguous delay)
  double delay_start_ns = 0;    // round trip at the frame's start, as [P] gives it
  double velocity_mps = 0;      // radial, positive away from the lidar
  double signal_per_pulse = 0;  // S, counts for each pulse of amplitude 1
  double std_delay_ns = 0;
  double std_velocity_mps = 0;
  double std_signal_per_pulse = 0;
  double significance_nats = 0;  // log-likelihood gained over no target
  double range_odds_nats = 0;    // how sure this range is against all others; see RangeOdds
  FoundList findings;            // the surest first
};

// What the estimator found in a frame: the output of FrameEstimator. status is one of ok,
// no_target, ambiguous, no_sync and, before the estimator ran, not_run.
struct Estimate : TargetEstimate {
  bool has_values = false;           // false: of the values only background_per_ns holds
  double acceleration_mps2 = 0;      // holds where its deviation is above 0
  double background_per_ns = 0;      // b, counts
  double std_acceleration_mps2 = 0;  // 0: the path was taken as straight
  double std_background_per_ns = 0;
  double pulse_sigma_ns = 0;      // of the detected pulse, tagger's clock; holds where its
  double std_pulse_sigma_ns = 0;  // deviation is above 0, which it is where the width was fitted
  double threshold_nats = 0;      // the significance that false_alarm_rate asks for
  FoundList recent_findings;      // of the last 50 to 100 frames together
  // Whether the dead time is modelled: false where it is not known, not to be modelled, or
  // contradicted by detections that follow each other sooner.
  bool dead_time_modelled = false;
  // The share of the time seen in which the detector was dead (of several inputs that share
  // the light, the share of the light that came on a dead one); 0 where dead_time_modelled is
  // false.
  double blind_fraction = 0;
  // By how much of itself the signal is too low, as inputs share the light unevenly and pulses are
  // bright; 0 where the dead time does not matter. See low_by_split().
  double low_by_split = 0;
  Stop stop = Stop::not_run;
  std::size_t photons = 0;
  // The targets, in descending order of their signal, where the frame shows more than one target;
  // the values above are those of the first target. Of each the deviations are those with the other
  // targets unknown too, and the significance is what it adds to the others.
  std::array<TargetEstimate, most_targets> targets;
  std::size_t target_count = 0;  // 0 where there is one target at most

  [[nodiscard]] const TargetEstimate& first_target() const { return *this; }
};

inline constexpr int most_followed = 20;

// Where a target was when it was last seen, so that the next frame can look there first. A target
// is followed for most_followed frames at most before the whole range is searched again, so that a
// wrong delay at a side lobe of the pattern's autocorrelation is not held for longer.
struct TargetTrack {
  bool valid = false;       // false: there is nothing to follow
  std::int64_t mid_ps = 0;  // the middle of the frame it was seen in, tagger's clock
  double delay_ns = 0;      // round trip at mid_ps
  double velocity_mps = 0;
  double acceleration_mps2 = 0;
  double nats_per_ns = 0;   // significance of the last frame that was searched, over its time seen
  double odds_per_nat = 0;  // range odds of that frame, over its significance
  double signal_per_pulse = 0, std_signal_per_pulse = 0;  // of the last frame
  int followed = 0;                                       // frames since then
};

}  // namespace splid
