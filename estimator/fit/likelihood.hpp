#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimator/fit/blind_light.hpp"
#include "estimator/fold/near_set.hpp"
#include "estimator/likelihood/exposure.hpp"
#include "estimator/model/pulse_shape.hpp"

// The room fit/ judges places in the plane of delay and travel by the likelihood of the photons.
// Open this file first. Its parts:
//
// The fit of one target:
//   likelihood.hpp       value, gradient and Hessian of the likelihood: [P] Eq. 4 and 7
//   blind_light.hpp      the light that comes while the detector is blind
//   dead_time_model.hpp  whether that is part of what is fitted
//   refinement.hpp       the climb to its maximum, with the covariance there
//   width_fit.hpp        the same with the pulse's width unknown, with width_likelihood.hpp
//   significance.hpp     the gain over no target that noise does not reach
//   range_odds.hpp       how sure a range is against all others
//   bound.hpp            the bound of Cramer and Rao, for studies: [P] Eq. 12 and 13, with
//                        alive_fraction.hpp
// Of several targets at once:
//   joint_fit.hpp        the climb, with joint_likelihood.hpp and the photons of near_several.hpp
//                        and near_sets.hpp
//   target_claims.hpp    which targets of it are claimed
//   flank_check.hpp      whether light beside a bright pulse is another target's
//   moving_light.hpp     whether light beside a bright target moves
//   crossing_check.hpp   whether two targets' lines part, or one pulse is wide; light_about.hpp is
//                        what these two see
//   range_profile.hpp    the light beside a line, where a joint fit of close targets begins
//   joint_bound.hpp      the bound of several targets
// What the photons say against a fit:
//   pattern_check.hpp    whether the light is that of the pattern
//   path_check.hpp       whether the target's path is straight
//   pulse_check.hpp      whether the detected pulse is the configured one
//   detector_check.hpp   whether the detector is what the likelihood knows, by dead_time_check.hpp
//                        and afterpulse_check.hpp, with middle_photons.hpp and pulse_mask.hpp
//   input_split.hpp      whether the detector's inputs share the light too unevenly
// For people to look at:
//   frame_fold.hpp       pictures of a frame's photons

namespace splid {

// What the likelihood depends on. The line is in the pattern's clock (see FoldedFrame); the rates
// count photons in the tagger's clock.
struct FrameParameters {
  DelayLine line;
  double signal_per_pulse = 0;   // S >= 0, counts for a pulse of amplitude 1
  double background_per_ns = 0;  // b >= 0
};

// The order of the parameters in gradients and matrices.
enum ParameterIndex { delay_index, travel_index, signal_index, background_index };

// Value, gradient and Hessian of the log-likelihood, in nats, by the parameters in the order of
// ParameterIndex. Their units are ns, ns, counts per pulse and counts per ns.
struct LikelihoodPoint {
  double value = 0;
  Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
  Eigen::Matrix4d hessian = Eigen::Matrix4d::Zero();
};

// The log-likelihood of a frame's photons,
//   l = -integral lambda + sum over photons of log lambda
// ([P] Eq. 4 and 7, whose print lacks the logarithm), with lambda = b + S sum_p a_p h about the
// line's pulses ([P] Eq. 2). Of a detector with a dead time the integral is over the time that it
// was alive, which is the exact likelihood of such a detector's times. A photon without an entry in
// the near set adds log b, so b must be above 0 where there are such photons.
//
// Threads: one thread for each object, which holds scratch. Errors: none. No allocation after
// construction for sets of up to max_entries.
class Likelihood {
 public:
  Likelihood(const PulseShape& shape, std::size_t max_entries);

  // From now on the integral leaves the blind light out; null: there is none. blind: collected with
  // the near set that the other calls are given; is used as scratch.
  void leave_out(BlindLight* blind) { blind_ = blind; }

  // Value, gradient and Hessian at some parameters. near: collected about a line so near that its
  // window holds all entries that matter. is_loaded: the last call was profile() of the same set at
  // this line, whose shape values are used again.
  LikelihoodPoint evaluate(const NearSet& near, const Exposure& exposure, const FrameParameters& at,
                           bool is_loaded = false);

  // The best signal and background of a line. They are found by the signal fraction
  // f = S A / (S A + b t), in [0, 1], with S A + b t equal to the number of photons, as it is at
  // every maximum with S and b above 0.
  struct Profile {
    FrameParameters parameters;
    double value = 0;      // log-likelihood
    double gain_nats = 0;  // over no target, which is S = 0 and b = N / t
    double signal_fraction = 0;
  };
  // about_fraction: the best fraction of a line nearby, from which this line's is found in fewer
  // rounds; negative where none is known.
  Profile profile(const NearSet& near, const Exposure& exposure, DelayLine line,
                  double about_fraction = -1);

 private:
  void load(const NearSet& near, const Exposure& exposure, DelayLine line);
  void give_back_missed(double S, LikelihoodPoint& point) const;
  // How offsets stretch with the line: by the dilation, and by 1 / ((1 - g) t_a) a unit of travel.
  struct Stretching {
    double dilation, turn;
  };
  void add_photons(const NearSet& near, const FrameParameters& at, const Stretching& by,
                   LikelihoodPoint& point) const;

  const PulseShape& shape_;
  BlindLight* blind_ = nullptr;
  BlindLight::Amplitude missed_;              // on the line of the last load()
  std::vector<double> offset_, h_, d1_, d2_;  // one value for each entry
  std::vector<double> density_;               // one value for each photon: sum_p a_p h
};

}  // namespace splid
