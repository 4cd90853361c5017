#include "estimator/likelihood/small_matrix.hpp"

#include <Eigen/Cholesky>

namespace splid {

std::optional<SmallMatrix> inverse_of_positive(const SmallMatrix& matrix) {
  const Eigen::LLT<SmallMatrix> cholesky(matrix);
  if (cholesky.info() != Eigen::Success) return std::nullopt;
  SmallMatrix inverse = SmallMatrix::Identity(matrix.rows(), matrix.cols());
  for (auto column : inverse.colwise()) cholesky.solveInPlace(column);
  return inverse;
}

std::optional<SmallVector> solution_of_positive(const SmallMatrix& matrix,
                                                const SmallVector& right) {
  const Eigen::LLT<SmallMatrix> cholesky(matrix);
  if (cholesky.info() != Eigen::Success) return std::nullopt;
  return cholesky.solve(right);
}

}  // namespace splid
