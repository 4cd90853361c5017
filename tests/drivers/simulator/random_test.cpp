#include "drivers/simulator/random.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace splid::simulator {
namespace {

constexpr int draws = 2'000'000;

// Chi-square of draws against equal shares; its mean is cells - 1, its standard deviation the root
// of twice that.
template <std::size_t cells, class Share>
double chi_square(const Share& share) {
  std::array<int, cells> counts{};
  for (int i = 0; i < draws; ++i) {
    ++counts[std::min(cells - 1, static_cast<std::size_t>(share() * cells))];
  }
  double sum = 0;
  for (const int count : counts) {
    const double expected = static_cast<double>(draws) / cells;
    sum += (count - expected) * (count - expected) / expected;
  }
  return sum;
}

// 99 cells of freedom, +- 4 standard deviations of 14.
constexpr double low = 43;
constexpr double high = 156;

TEST(Random, UniformIsUniform) {
  Random random(1, 0);
  const double chi = chi_square<100>([&] { return random.uniform(); });
  EXPECT_GT(chi, low);
  EXPECT_LT(chi, high);
}

TEST(Random, ExponentialHasItsDistribution) {
  Random random(2, 0);
  const double chi = chi_square<100>([&] { return 1 - std::exp(-random.exponential()); });
  EXPECT_GT(chi, low);
  EXPECT_LT(chi, high);
}

TEST(Random, NormalHasItsDistribution) {
  Random random(3, 0);
  const double chi =
      chi_square<100>([&] { return 0.5 * std::erfc(-random.normal() / std::sqrt(2.0)); });
  EXPECT_GT(chi, low);
  EXPECT_LT(chi, high);
}

// The ziggurats' base layers, which the cells above hardly see.
TEST(Random, TailsHaveTheirWeight) {
  Random random(4, 0);
  int far_normal = 0;
  int far_exponential = 0;
  for (int i = 0; i < draws; ++i) {
    far_normal += std::abs(random.normal()) > 3.8 ? 1 : 0;
    far_exponential += random.exponential() > 8.5 ? 1 : 0;
  }
  const double normals = draws * std::erfc(3.8 / std::sqrt(2.0));
  const double exponentials = draws * std::exp(-8.5);
  EXPECT_NEAR(far_normal, normals, 4 * std::sqrt(normals));
  EXPECT_NEAR(far_exponential, exponentials, 4 * std::sqrt(exponentials));
}

TEST(Random, SeedAndStreamTellSequencesApart) {
  EXPECT_EQ(Random(5, 1).bits(), Random(5, 1).bits());
  EXPECT_NE(Random(5, 1).bits(), Random(5, 2).bits());
  EXPECT_NE(Random(5, 1).bits(), Random(6, 1).bits());
}

}  // namespace
}  // namespace splid::simulator
