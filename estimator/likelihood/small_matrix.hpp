#pragma once

#include <Eigen/Core>
#include <optional>

#include "estimator/model/options.hpp"

// Symmetric matrices of a few rows, as curvatures and informations are, factored. All fits and
// bounds call these, so that Eigen's factorizations are compiled for one size instead of for seven,
// each of which takes a second.

namespace splid {

// Of several targets: four parameters each, the width and the background (model.hpp); on the stack.
constexpr int most_small_rows = 4 * static_cast<int>(most_targets) + 2;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, most_small_rows, 1>;
using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor,
                                  most_small_rows, most_small_rows>;

// Absent where the matrix is not positive definite.
std::optional<SmallMatrix> inverse_of_positive(const SmallMatrix& matrix);

// The x for which matrix x = right; absent where the matrix is not positive definite.
std::optional<SmallVector> solution_of_positive(const SmallMatrix& matrix,
                                                const SmallVector& right);

}  // namespace splid
