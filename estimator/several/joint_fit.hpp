#pragma once

#include <array>
#include <limits>

#include "estimator/model/estimate.hpp"
#include "estimator/several/joint_likelihood.hpp"

namespace splid {

// The maximum of the likelihood of several targets, and its curvature there.
struct JointMaximum {
  JointParameters at;
  double gain_nats = 0;         // log-likelihood over that of no target
  SmallMatrix covariance;       // in the order of JointParameters; no travel: rows of zeros
  bool has_covariance = false;  // false where the likelihood does not fall off in all directions
  Stop stop = Stop::not_run;
};

// Climbs to the maximum of the likelihood of several targets in all their parameters at once:
// Newton's method, damped as Levenberg and Marquardt do where the surface is no hill.
//
// Threads: one thread for each object. Errors: none. No allocation in the calls for frames of up to
// max_photons.
class JointFit {
 public:
  JointFit(const PulseShape& shape, const PulseTrain& train, std::size_t max_photons);

  // A frame comes, which the calls up to the next begin() are about.
  void begin(const FoldedFrame& frame, const Exposure& exposure);
  // The maximum near `start`, of which each line should be within some two pulse widths of the
  // maximum's. moving: false keeps the travels of `start`. to_beat_nats: a maximum that surely has
  // less gain than this is given up (Stop::beaten); its gain is then what a parabola promises, and
  // it has no covariance.
  JointMaximum climb(const FoldedFrame& frame, const Exposure& exposure,
                     const JointParameters& start, bool moving,
                     double to_beat_nats = -std::numeric_limits<double>::infinity());
  // The gain of a maximum without one of its targets, where the other targets' lines stay and their
  // signals and the background become their best. likelihood() must have been collected about the
  // maximum.
  double gain_without(std::size_t target, const Exposure& exposure, const JointMaximum& of);
  // The gain at parameters about which likelihood() has been collected.
  double gain(const Exposure& exposure, const JointParameters& at) {
    return likelihood_.value(exposure, at) - no_target_nats_;
  }
  // The likelihood with the photons about the last maximum.
  JointLikelihood& likelihood() { return likelihood_; }

 private:
  using Fixed = std::array<bool, most_small_rows>;
  void climb_within(const Exposure& exposure, const Fixed& fixed, double to_beat_nats,
                    JointMaximum& best);
  void add_covariance(const Exposure& exposure, const Fixed& fixed, JointMaximum& maximum);
  [[nodiscard]] SmallVector units_of(const JointParameters& at, const Exposure& exposure) const;

  double width_ns_;
  JointLikelihood likelihood_;
  double no_target_nats_ = 0;  // the log-likelihood of no target, of the frame
  JointPoint point_;
};

}  // namespace splid
