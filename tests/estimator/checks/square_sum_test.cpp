#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "estimator/checks/findings.hpp"
#include "tests/support/sanitized.hpp"

namespace splid::checks {
namespace {

// The rate at which chance exceeds 2 gain = 9.5, in cells that have few or many counts; a normal
// number exceeds sqrt(9.5) on its upper side in one of a thousand.
TEST(SquareSum, ChanceIsAsRareAsItSays) {
  struct Case {
    int cells;
    double mean;
  };
  const int draws = test::times(20000);
  for (const Case& of : {Case{4096, 0.03}, Case{4096, 2.1}, Case{40, 0.5}, Case{40, 18}}) {
    std::mt19937_64 random(5);
    std::poisson_distribution<int> all(of.cells * of.mean);
    std::uniform_int_distribution<int> any(0, of.cells - 1);
    std::vector<int> counts(static_cast<std::size_t>(of.cells));
    int said = 0;
    const int some = of.cells > 100 && of.mean > 1 ? draws / 20 : draws;
    for (int n = 0; n < some; ++n) {
      std::fill(counts.begin(), counts.end(), 0);
      for (int k = all(random); k > 0; --k) ++counts[static_cast<std::size_t>(any(random))];
      SquareSum sum;
      double total = 0, squares = 0;
      for (const int count : counts) total += count, squares += count * count;
      sum.add_alike(of.cells, total / of.cells, total, squares);
      said += 2 * sum.gain_nats() > 9.5 ? 1 : 0;
    }
    EXPECT_LE(said, 2.5e-3 * some + 3) << of.cells << ' ' << of.mean;
  }
}

TEST(SquareSum, SumsOfCountsAreThoseOfEach) {
  SquareSum each, together;
  double sum = 0, squares = 0;
  for (const double n : {0.0, 3.0, 1.0, 7.0}) {
    each.add(n, 2.5);
    sum += n, squares += n * n;
  }
  together.add_alike(4, 2.5, sum, squares);
  EXPECT_DOUBLE_EQ(each.excess, together.excess);
  EXPECT_DOUBLE_EQ(each.variance, together.variance);
  EXPECT_DOUBLE_EQ(each.third, together.third);
}

}  // namespace
}  // namespace splid::checks
