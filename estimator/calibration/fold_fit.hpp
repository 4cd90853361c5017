#pragma once

#include <Eigen/Core>

#include "estimator/calibration/fold_model.hpp"

namespace splid {

// Poisson likelihood of a fold in its pulses' times and counts and the background, their shape
// given: parameters 0 .. P-1 are the counts, P .. 2P-1 the times (ps), 2P the background (1/ps).

// Climbs to the maximum by Fisher scoring, neighbours' tails and the background with it; returns
// how far the times went, the furthest, ps. The counts and the background stay above zero.
double fit_fold(FoldModel& model);

// Inverse of the expected Fisher information at the model's values.
Eigen::MatrixXd fold_covariance(FoldModel& model);

}  // namespace splid
