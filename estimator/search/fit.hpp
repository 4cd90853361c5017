#pragma once

#include <Eigen/Core>

#include "estimator/fold/folded_frame.hpp"
#include "estimator/likelihood/maximizer.hpp"
#include "estimator/model/estimate.hpp"

namespace splid {

// What the intensity of one target depends on. The line is in the pattern's clock (see
// FoldedFrame); the rates count photons in the tagger's clock.
struct FrameParameters {
  DelayTrack line;
  double signal_per_pulse = 0;   // S >= 0, counts for a pulse of amplitude 1
  double background_per_ns = 0;  // b >= 0
};

// The order of the parameters in a fit's covariance.
enum ParameterIndex { delay_index, walk_index, signal_index, background_index };

// A maximum of the likelihood, and its curvature there.
struct Fit {
  FrameParameters parameters;
  double gain_nats = 0;  // log-likelihood over that of no target
  // The inverse of the observed information at the maximum, in the order of ParameterIndex. The row
  // and the column of the range walk are zero for a target at rest.
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  bool has_covariance = false;  // false where the likelihood does not fall off in all directions
  Stop stop = Stop::not_run;
};

// The model of such parameters, and the fit that a maximum with one target is, and back. What the
// maximum has beside the four parameters is left out.
likelihood::Model model_of(const FrameParameters& parameters);
Fit fit_of(const likelihood::Maximum& maximum);
likelihood::Maximum maximum_of(const Fit& fit);

}  // namespace splid
