#include "estimator/likelihood/small_matrix.hpp"

#include <gtest/gtest.h>

namespace splid {
namespace {

// By hand: the determinant is 11.
TEST(SmallMatrix, APositiveMatrixIsInvertedAndSolved) {
  SmallMatrix matrix(2, 2);
  matrix << 4, 1, 1, 3;
  const auto inverse = inverse_of_positive(matrix);
  ASSERT_TRUE(inverse);
  EXPECT_NEAR((*inverse)(0, 0), 3.0 / 11, 1e-15);
  EXPECT_NEAR((*inverse)(0, 1), -1.0 / 11, 1e-15);
  EXPECT_NEAR((*inverse)(1, 1), 4.0 / 11, 1e-15);
  SmallVector right(2);
  right << 1, 2;
  const auto x = solution_of_positive(matrix, right);
  ASSERT_TRUE(x);
  EXPECT_NEAR((*x)[0], 1.0 / 11, 1e-15);
  EXPECT_NEAR((*x)[1], 7.0 / 11, 1e-15);
}

TEST(SmallMatrix, WhatIsNotPositiveHasNoInverseAndNoSolution) {
  SmallMatrix matrix(2, 2);
  matrix << 1, 2, 2, 1;
  EXPECT_FALSE(inverse_of_positive(matrix));
  EXPECT_FALSE(solution_of_positive(matrix, SmallVector::Ones(2)));
}

}  // namespace
}  // namespace splid
