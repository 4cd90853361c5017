#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <span>

#include "estimator/fit/likelihood.hpp"
#include "estimator/model/estimate.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid {

// A maximum of the likelihood, and its curvature there.
struct Fit {
  FrameParameters parameters;
  double gain_nats = 0;  // log-likelihood over that of no target
  // The inverse of the observed information at the maximum, in the order of ParameterIndex. The row
  // and the column of the travel are zero for a target at rest.
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  bool has_covariance = false;  // false where the likelihood does not fall off in all directions
  Stop stop = Stop::not_run;
};

// Climbs to the maximum of the likelihood near a line, by Newton's method on (delay, travel) with
// the best (S, b) at every step. [P] runs L-BFGS on the two pairs in turn; the maximum is the same.
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
  Fit climb(const FoldedFrame& frame, const Exposure& exposure, DelayLine start, bool moving,
            double to_beat_nats = -std::numeric_limits<double>::infinity(), bool roughly = false,
            Until until = Until::top);

  // The best signal and background of a line, and the curvature there, without a climb.
  Fit fit_rates(const FoldedFrame& frame, const Exposure& exposure, DelayLine line, bool moving);

  // Whether the light of the fit that was made last comes from all along the frame. It does not
  // where quarters of the frame differ by more than they do by chance in one of 10,000, and two of
  // them or more have less than a fourth of the brightest one's. Quarters in which the line passes
  // by one of those that were taken out do not count, as hardly any light of a weak target is left
  // there, and of a frame of which a tenth was not seen they say nothing. exposure: of that frame.
  // taken_out: lines of targets.
  //
  // Design note: a line that crosses the path of a bright target has its light in a part of the
  // frame.
  [[nodiscard]] bool is_all_along(const Exposure& exposure, const Fit& fit,
                                  std::span<const DelayLine> taken_out) const;

  // The likelihood and its curvature at given parameters, without a climb.
  Fit judge(const FoldedFrame& frame, const Exposure& exposure, const FrameParameters& at,
            bool moving);

 private:
  // What holds for all of a climb.
  struct Way {
    const FoldedFrame& frame;
    const Exposure& exposure;
    bool moving;
    double to_beat_nats;
    Until until;
  };
  Fit climb_gathered(const Way& way, DelayLine start, std::size_t gather_from);
  void collect(const FoldedFrame& frame, DelayLine about, double gather_width_ns,
               std::size_t gather_from);
  Fit climb_within(const Way& way, DelayLine start);
  struct Spread {
    double photons;          // about the line
    double light;            // of these, without the background's
    double mean_square_ns2;  // of the light's offsets from its mean line
    double deviations;       // by which it is spread by more than a pulse is
  };
  [[nodiscard]] Spread spread_about(const Exposure& exposure, const FrameParameters& at) const;
  [[nodiscard]] bool is_of_several(const Way& way, const FrameParameters& at) const;
  [[nodiscard]] bool passes_by(DelayLine line, double from, double to,
                               std::span<const DelayLine> others) const;
  void add_covariance_of_spread(const Exposure& exposure, bool moving, Fit& fit) const;
  void add_covariance(const Exposure& exposure, bool moving, Fit& fit);

  const PulseTrain& train_;
  double width_ns_;
  double peak_ns_;     // the pulse's peak beside its time
  double spread_ns2_;  // the mean square of the pulse's offsets from its peak, within spread_widths
  double margin_ns_;   // how far the line may move before the near set is collected anew
  std::vector<CombWindow> windows_;  // one for each stretch
  NearSet near_;
  Likelihood likelihood_;
  std::optional<BlindLight> blind_;
};

}  // namespace splid
