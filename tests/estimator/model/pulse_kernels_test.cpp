#include "estimator/model/pulse_kernels.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "estimator/model/vector_level.hpp"

namespace splid {
namespace {

struct Gaussian {
  std::vector<double> h, d1, d2;

  Gaussian(VectorLevel level, const std::vector<double>& offsets, double sigma, double peak)
      : h(offsets.size()), d1(offsets.size()), d2(offsets.size()) {
    pulse_kernels(level).gaussian(h.data(), d1.data(), d2.data(), offsets.data(), 1 / sigma, peak,
                                  offsets.size());
  }
};

// Offsets of up to so many standard deviations, and their number is no multiple of any vector.
std::vector<double> offsets_to(double most) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> any(-most, most);
  std::vector<double> offsets = {0, -0.0, 1e-300, most, -most};
  while (offsets.size() < 20003) offsets.push_back(any(random));
  return offsets;
}

// The exponential is exact to 0.7 units in the last place and is rounded once more with the peak.
// The rounding of x^2 / 2 is in the density with so many times its size.
TEST(PulseKernels, GaussianIsThatOfLongDouble) {
  const std::vector<double> offsets = offsets_to(37);
  for (const VectorLevel level : runnable_vector_levels()) {
    const Gaussian found(level, offsets, 1, 4);
    for (std::size_t i = 0; i < offsets.size(); ++i) {
      const long double x = offsets[i];
      const long double h = 4 * std::exp(-x * x / 2);
      const auto most = static_cast<double>(h * (2.7e-16L + 1.2e-16L * x * x / 2));
      ASSERT_NEAR(found.h[i], static_cast<double>(h), most) << offsets[i];
      ASSERT_NEAR(found.d1[i], static_cast<double>(-x * h), 2 * most * (1 + std::abs(offsets[i])));
      ASSERT_NEAR(found.d2[i], static_cast<double>((x * x - 1) * h),
                  2 * most * (2 + offsets[i] * offsets[i]));
    }
  }
}

TEST(PulseKernels, GaussianHasTheSameBitsAtEachLevel) {
  const std::vector<double> offsets = offsets_to(4);
  const Gaussian expected(VectorLevel::generic, offsets, 0.1, 3.98);
  for (const VectorLevel level : runnable_vector_levels()) {
    const Gaussian found(level, offsets, 0.1, 3.98);
    EXPECT_EQ(found.h, expected.h) << vector_level_name(level);
    EXPECT_EQ(found.d1, expected.d1) << vector_level_name(level);
    EXPECT_EQ(found.d2, expected.d2) << vector_level_name(level);
  }
}

TEST(PulseKernels, NothingIsLeftOfAGaussianFarOut) {
  for (const VectorLevel level : runnable_vector_levels()) {
    const Gaussian found(level, {37.3, 37.5, -37.5, 50, 1e6, -1e100}, 1, 4);
    EXPECT_GT(found.h[0], 0);
    for (std::size_t i = 1; i < found.h.size(); ++i) {
      EXPECT_EQ(found.h[i], 0) << i;
      EXPECT_EQ(found.d1[i], 0) << i;
      EXPECT_EQ(found.d2[i], 0) << i;
    }
  }
}

}  // namespace
}  // namespace splid
