#pragma once

#include <limits>
#include <optional>
#include <span>

#include "estimator/fit/fit.hpp"
#include "estimator/likelihood/maximizer.hpp"
#include "estimator/model/estimate.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid {

// Climbs to the maximum of the likelihood near a line, by likelihood::Maximizer.
//
// Threads: one thread for each object. Errors: none. No allocation in the calls for frames of up to
// max_photons.
class Refinement {
 public:
  // Where a climb may end: at the top; or near it, with a short step of Newton's method that gained
  // less than 0.1 nats, after which some hundredths of a deviation are left. top_of_one: where the
  // photons are spread as those of a single pulse are not, the climb ends where it begins, with the
  // stop reason `spread` and the covariance of these photons' mean line, since what they show is
  // then fitted by several targets.
  enum class Until { top, near_top, top_of_one };

  // Memory is reserved for max_photons, each of them near as many pulses as overlap at most.
  // may_be_blind: frames may come with their blind time.
  Refinement(const PulseShape& shape, const PulseTrain& train, std::size_t max_photons,
             bool may_be_blind = false);

  // The maximum near `start`, which should be within two pulse widths of it. moving: false keeps
  // the travel of `start`. to_beat_nats: a maximum that surely has less gain than this is given up
  // before it is reached; the result then has the stop reason `beaten`, no covariance, and less
  // gain. roughly: a thousandth of a deviation does not matter, as where a sample of a frame's
  // photons says where to look.
  Fit climb(const FoldedFrame& frame, DelayLine start, bool moving,
            double to_beat_nats = -std::numeric_limits<double>::infinity(), bool roughly = false,
            Until until = Until::top);

  // The best signal and background of a line, and the curvature there, without a climb.
  Fit fit_rates(const FoldedFrame& frame, DelayLine line, bool moving);

  // Whether the light of the fit that was made last comes from all along the frame. It does not
  // where quarters of the frame differ by more than they do by chance in one of 10,000, and two of
  // them or more have less than a fourth of the brightest one's. Quarters in which the line passes
  // by one of those that were taken out do not count, as hardly any light of a weak target is left
  // there, and of a frame of which a tenth was not seen they say nothing.
  // taken_out: lines of targets.
  //
  // Design note: a line that crosses the path of a bright target has its light in a part of the
  // frame.
  [[nodiscard]] bool is_all_along(const Fit& fit, std::span<const DelayLine> taken_out) const;

  // The likelihood and its curvature at given parameters, without a climb.
  Fit judge(const FoldedFrame& frame, const FrameParameters& at, bool moving);

 private:
  struct Spread {
    double photons;          // about the line
    double light;            // of these, without the background's
    double mean_square_ns2;  // of the light's offsets from its mean line
    double deviations;       // by which it is spread by more than a pulse is
  };
  [[nodiscard]] Spread spread_about(const FrameParameters& at) const;
  [[nodiscard]] bool is_of_several(const FrameParameters& at) const;
  [[nodiscard]] bool passes_by(DelayLine line, double from, double to,
                               std::span<const DelayLine> others) const;
  void add_covariance_of_spread(bool moving, Fit& fit) const;

  const PulseTrain& train_;
  double width_ns_;
  double peak_ns_;     // the pulse's peak beside its time
  double spread_ns2_;  // the mean square of the pulse's offsets from its peak, within spread_widths
  likelihood::Maximizer maximizer_;
};

}  // namespace splid
