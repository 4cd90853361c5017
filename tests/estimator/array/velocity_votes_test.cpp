#include "estimator/array/velocity_votes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace splid::array {
namespace {

TEST(VelocityVotes, ManyWeakVotesBeatAStrongOne) {
  std::vector<Vote> votes;
  for (std::size_t k = 0; k < 6; ++k) {
    votes.push_back({k, {10 + 0.01 * static_cast<double>(k), 0.05}, 5});
    votes.push_back({k, {-100 + 30.0 * static_cast<double>(k), 0.05}, 6});  // chance
  }
  votes.push_back({6, {50, 0.05}, 20});
  const auto shared = most_voted(votes, 150);
  ASSERT_TRUE(shared);
  EXPECT_NEAR(shared->velocity.mps, 10.025, 1e-9);
  EXPECT_NEAR(shared->velocity.std_mps, 0.05 / std::sqrt(6.0), 1e-9);
  // Six times log(1 + e^5), less the part of the votes that are not quite there, against 6,000
  // velocities.
  EXPECT_NEAR(shared->odds_nats, 6 * std::log1p(std::exp(5)) - std::log(6000), 0.5);
}

TEST(VelocityVotes, OfChanceHaveNoOdds) {
  std::vector<Vote> votes;
  for (std::size_t k = 0; k < 200; ++k) {
    votes.push_back({k, {-149 + 1.49 * static_cast<double>(k), 0.05}, 3});
  }
  const auto shared = most_voted(votes, 150);
  ASSERT_TRUE(shared);
  EXPECT_LT(shared->odds_nats, 0);
  EXPECT_FALSE(most_voted({}, 150));
}

// The best vote counts wherever it stands among more votes than are tried.
TEST(VelocityVotes, TheBestOfManyIsTried) {
  for (const std::size_t best : {0U, 150U, 299U}) {
    std::vector<Vote> votes;
    for (std::size_t k = 0; k < 300; ++k) {
      votes.push_back({k, {static_cast<double>(k) / 3, 0.05}, k == best ? 30.0 : 1.0});
    }
    EXPECT_NEAR(most_voted(votes, 150)->velocity.mps, static_cast<double>(best) / 3, 1e-9);
  }
}

TEST(VelocityVotes, EvidenceIsTheGainOverAllDelays) {
  EXPECT_NEAR(evidence_nats(20, 0.01, 3780), 20 + std::log(std::sqrt(2 * M_PI) * 0.01 / 3780),
              1e-12);
}

}  // namespace
}  // namespace splid::array
