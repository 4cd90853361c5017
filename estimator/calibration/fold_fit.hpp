#pragma once

#include <Eigen/Core>

#include "estimator/calibration/fold_model.hpp"

namespace splid::calibration {

// The fit of a fold by its Poisson likelihood, with the pulses' shape given. Parameters 0 .. P-1
// are the counts of the P pulses, P .. 2P-1 their times (ps), and 2P is the background (1/ps).

// Brings the model to the maximum by Fisher scoring; counts and background stay above zero.
// Allocates a matrix of 2P + 1 rows.
void fit_fold(FoldModel& model);

// The covariance of the parameters: the inverse of the expected Fisher information at the model's
// values.
Eigen::MatrixXd fold_covariance(FoldModel& model);

}  // namespace splid::calibration
