#include "estimator/model/chance.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace splid {
namespace {

// The C library's functions are right to the last bits, but not the same bits on all processors.
TEST(Chance, TheNormalIntegralIsErfc) {
  for (double deviations = -12; deviations <= 12; deviations += 1.0 / 1024) {
    const long double exact = std::erfc(-deviations / std::sqrt(2.0L)) / 2;
    ASSERT_LT(std::abs(normal_integral(deviations) - exact), 1e-14L * exact) << deviations;
  }
  EXPECT_EQ(normal_integral(0), 0.5);
  EXPECT_EQ(normal_integral(-std::numeric_limits<double>::infinity()), 0);
  EXPECT_EQ(normal_integral(std::numeric_limits<double>::infinity()), 1);
  EXPECT_TRUE(std::isnan(normal_integral(std::numeric_limits<double>::quiet_NaN())));
}

TEST(Chance, DeviationsOfChiSquaredAreWhatItIsOf) {
  for (const double degrees : {2.0, 7.0, 100.0}) {
    EXPECT_NEAR(deviations_of(chi_squared_of(sure_deviations, degrees), degrees), sure_deviations,
                1e-13);
  }
}

TEST(Chance, DeviationsAddInQuadrature) {
  EXPECT_EQ(in_quadrature(3, -4), 5);
  for (double a = 1e-9; a < 1e9; a *= 1.7) {
    const double exact = std::hypot(a, 2.3);
    ASSERT_NEAR(in_quadrature(a, 2.3), exact, std::nextafter(exact, 2 * exact) - exact) << a;
  }
}

}  // namespace
}  // namespace splid
