#include "bench/studies/crt_wang.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace splid::studies {
namespace {

using paper::crt_mixed_integer;
using paper::CrtSolution;
using paper::Remainder;

std::vector<Remainder> remainders_of(double value_ns, const std::vector<double>& moduli_ns,
                                     double sigma_ns, std::mt19937_64& random) {
  std::normal_distribution<double> error(0, 1);
  std::uniform_real_distribution<double> weight(0.3, 3);
  std::vector<Remainder> remainders;
  for (const double modulus : moduli_ns) {
    const double read = value_ns + sigma_ns * error(random);
    remainders.push_back({read - modulus * std::floor(read / modulus), modulus, weight(random)});
  }
  return remainders;
}

// [P] Fig. 5: the periods' ratio is no ratio of small integers, and rounding them to 100 and 104 ns
// takes the two remainders 0.2 ns further apart with every turn. After ten that is more than the
// method bears, half of the common divisor of 4 ns.
TEST(CrtWang, FailsWhereModuliAreNotWholeAndTheProgramDoesNot) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> anywhere(1100, 2400);
  int wang_right = 0;
  int program_right = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const double truth_ns = anywhere(random);
    const auto remainders = remainders_of(truth_ns, {99.9, 104.1}, 0.02, random);
    const CrtSolution wang = crt_wang(remainders, 1);
    ASSERT_TRUE(wang.found);
    wang_right += std::abs(wang.value_ns - truth_ns) < 1 ? 1 : 0;
    program_right +=
        std::abs(crt_mixed_integer(remainders, 2600).value_ns - truth_ns) < 0.1 ? 1 : 0;
  }
  EXPECT_EQ(program_right, 200);
  EXPECT_EQ(wang_right, 0);
}

TEST(CrtWang, IsTheProgramWhereModuliAreWhole) {
  std::mt19937_64 random(3);
  const std::vector<std::vector<double>> sets = {
      {100, 104}, {180, 189}, {90, 150, 210}, {7, 9, 10, 11}};
  const std::vector<double> multiples = {2600, 3780, 3150, 6930};
  for (std::size_t s = 0; s < sets.size(); ++s) {
    const double common_ns = s == 0 ? 4 : s == 1 ? 9 : s == 2 ? 30 : 1;
    std::uniform_real_distribution<double> anywhere(common_ns, multiples[s] - common_ns);
    for (int trial = 0; trial < 50; ++trial) {
      const double truth_ns = anywhere(random);
      const auto remainders = remainders_of(truth_ns, sets[s], common_ns / 20, random);
      const CrtSolution wang = crt_wang(remainders, 1);
      const CrtSolution program = crt_mixed_integer(remainders, multiples[s]);
      ASSERT_TRUE(wang.found);
      EXPECT_NEAR(wang.value_ns, truth_ns, common_ns / 4);
      EXPECT_NEAR(wang.value_ns, program.value_ns, 1e-7);
      EXPECT_NEAR(wang.cost, program.cost, 1e-7);
    }
  }
}

// Remainders on either side of a turn of the common divisor: a mean on a line would be wrong.
TEST(CrtWang, TakesTheCommonRemainderOnACircle) {
  const std::vector<Remainder> remainders = {{179.9, 180, 1}, {0.2, 189, 1}};
  const CrtSolution wang = crt_wang(remainders, 1);
  ASSERT_TRUE(wang.found);
  EXPECT_NEAR(std::remainder(wang.value_ns, 3780.0), 0.05, 1e-9);
}

TEST(CrtWang, RefusesRatiosThatShareAFactor) {
  EXPECT_FALSE(crt_wang(std::vector<Remainder>{{1, 60, 1}, {1, 100, 1}, {1, 150, 1}}, 1).found);
  EXPECT_TRUE(crt_wang(std::vector<Remainder>{{1, 60, 1}, {1, 100, 1}}, 1).found);
  // A least common multiple beyond what doubles count.
  EXPECT_FALSE(crt_wang(std::vector<Remainder>{{1, 1e9 + 7, 1}, {1, 1e9 + 9, 1}}, 1).found);
  EXPECT_FALSE(crt_wang(std::vector<Remainder>{{1, 0.2, 1}, {1, 100, 1}}, 1).found);
}

TEST(CrtWang, RefusesWhatIsNoProblem) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::vector<Remainder>> bad = {{},
                                                   {{1, 100, 1}},
                                                   {{nan, 100, 1}, {1, 104, 1}},
                                                   {{1, 0, 1}, {1, 104, 1}},
                                                   {{1, 100, 0}, {1, 104, 1}}};
  for (const auto& remainders : bad) {
    EXPECT_FALSE(crt_wang(remainders, 1).found);
  }
}

}  // namespace
}  // namespace splid::studies
