#include "estimator/paper/crt.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace splid::paper {
namespace {

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

// The cost of one choice of turns, with the best tau of [0, limit] for it.
CrtSolution with_turns(const std::vector<Remainder>& remainders, const std::vector<int>& turns,
                       double limit_ns) {
  long double weights = 0;
  long double moment = 0;
  for (std::size_t k = 0; k < turns.size(); ++k) {
    weights += remainders[k].weight;
    moment += remainders[k].weight * (remainders[k].value_ns + static_cast<long double>(turns[k]) *
                                                                   remainders[k].modulus_ns);
  }
  const long double tau = std::clamp<long double>(moment / weights, 0, limit_ns);
  long double cost = 0;
  for (std::size_t k = 0; k < turns.size(); ++k) {
    const long double off = tau - remainders[k].value_ns -
                            static_cast<long double>(turns[k]) * remainders[k].modulus_ns;
    cost += remainders[k].weight * off * off;
  }
  return {true, static_cast<double>(tau), static_cast<double>(cost)};
}

// Every choice of turns there is.
CrtSolution by_brute_force(const std::vector<Remainder>& remainders, double limit_ns) {
  CrtSolution best;
  best.cost = std::numeric_limits<double>::infinity();
  std::vector<int> turns(remainders.size(), -1);
  while (true) {
    const CrtSolution here = with_turns(remainders, turns, limit_ns);
    if (here.cost < best.cost) best = here;
    std::size_t k = 0;
    while (k < turns.size() && (turns[k] + 1) * remainders[k].modulus_ns > limit_ns) {
      turns[k++] = -1;
    }
    if (k == turns.size()) return best;
    ++turns[k];
  }
}

// Branch and bound, as a solver of mixed-integer programs goes about it: fix one n_k after the
// other; what the fixed ones cost among themselves, with tau free, bounds all that follow.
class BranchAndBound {
 public:
  BranchAndBound(const std::vector<Remainder>& remainders, double limit_ns)
      : remainders_(remainders), limit_ns_(limit_ns) {
    best_.cost = std::numeric_limits<double>::infinity();
    descend();
  }
  [[nodiscard]] const CrtSolution& best() const { return best_; }

 private:
  [[nodiscard]] double bound() const {
    const std::vector<Remainder> fixed(
        remainders_.begin(), remainders_.begin() + static_cast<std::ptrdiff_t>(turns_.size()));
    return with_turns(fixed, turns_, limit_ns_).cost;
  }
  void descend() {
    if (!turns_.empty() && bound() >= best_.cost) return;
    if (turns_.size() == remainders_.size()) {
      best_ = with_turns(remainders_, turns_, limit_ns_);
      return;
    }
    const Remainder& r = remainders_[turns_.size()];
    for (int n = -1; n * r.modulus_ns <= limit_ns_; ++n) {
      turns_.push_back(n);
      descend();
      turns_.pop_back();
    }
  }

  const std::vector<Remainder>& remainders_;
  double limit_ns_;
  std::vector<int> turns_;
  CrtSolution best_;
};

TEST(CrtMixedInteger, IsTheBestOfAllChoicesOfTurns) {
  std::mt19937_64 random(1);
  for (const std::size_t moduli : {2U, 3U, 4U}) {
    for (int trial = 0; trial < 40; ++trial) {
      std::uniform_real_distribution<double> modulus(80, 130);
      std::vector<double> moduli_ns;
      for (std::size_t k = 0; k < moduli; ++k) moduli_ns.push_back(modulus(random));
      const double limit_ns = moduli == 4 ? 900 : 2600;
      std::uniform_real_distribution<double> anywhere(0, limit_ns);
      const double truth_ns = anywhere(random);
      // From errors that hardly matter to ones that make any answer wrong.
      const auto remainders =
          remainders_of(truth_ns, moduli_ns, trial % 3 == 0 ? 20.0 : 0.3, random);
      const CrtSolution found = crt_mixed_integer(remainders, limit_ns);
      const CrtSolution expected = by_brute_force(remainders, limit_ns);
      ASSERT_TRUE(found.found);
      EXPECT_NEAR(found.cost, expected.cost, 1e-9 * (1 + expected.cost));
      EXPECT_NEAR(found.value_ns, expected.value_ns, 1e-7);
    }
  }
}

TEST(CrtMixedInteger, AgreesWithBranchAndBoundOverLongRanges) {
  std::mt19937_64 random(2);
  const std::vector<double> moduli_ns = {99.9, 104.1, 107.3, 111.7, 113.9};
  const double limit_ns = 30000;
  std::uniform_real_distribution<double> anywhere(0, limit_ns);
  for (int trial = 0; trial < 5; ++trial) {
    const double truth_ns = anywhere(random);
    const auto remainders = remainders_of(truth_ns, moduli_ns, 0.2, random);
    const CrtSolution found = crt_mixed_integer(remainders, limit_ns);
    const CrtSolution expected = BranchAndBound(remainders, limit_ns).best();
    EXPECT_NEAR(found.cost, expected.cost, 1e-9);
    EXPECT_NEAR(found.value_ns, expected.value_ns, 1e-7);
    EXPECT_NEAR(found.value_ns, truth_ns, 1);
  }
}

TEST(Crt, RefusesWhatIsNoProblem) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::vector<Remainder>> bad = {{},
                                                   {{1, 100, 1}},
                                                   {{nan, 100, 1}, {1, 104, 1}},
                                                   {{1, 0, 1}, {1, 104, 1}},
                                                   {{1, 100, 0}, {1, 104, 1}}};
  for (const auto& remainders : bad) {
    EXPECT_FALSE(crt_mixed_integer(remainders, 1000).found);
  }
  const std::vector<Remainder> good = {{1, 100, 1}, {1, 104, 1}};
  EXPECT_TRUE(crt_mixed_integer(good, 1000).found);
  EXPECT_FALSE(crt_mixed_integer(good, 0).found);
  EXPECT_FALSE(crt_mixed_integer(good, nan).found);
  EXPECT_FALSE(crt_mixed_integer(good, 1e12).found);
}

}  // namespace
}  // namespace splid::paper
