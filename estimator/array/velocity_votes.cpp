#include "estimator/array/velocity_votes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "estimator/model/chance.hpp"

namespace splid::array {
namespace {

// A velocity is tried where the best votes are; others cannot be the best without these.
constexpr std::size_t most_tried = 128;

double off_deviations(const Vote& vote, double mps) {
  return (mps - vote.velocity.mps) / vote.velocity.std_mps;
}

double evidence_at(std::span<const Vote> votes, double mps) {
  double sum = 0;
  for (std::size_t i = 0; i < votes.size();) {
    const std::size_t pixel = votes[i].pixel;
    double likelihood = 0;
    for (; i < votes.size() && votes[i].pixel == pixel; ++i) {
      const double off = off_deviations(votes[i], mps);
      if (std::abs(off) > 40) continue;
      likelihood += std::exp(std::min(votes[i].evidence_nats - off * off / 2, 600.0));
    }
    sum += std::log1p(likelihood);  // over log 1/2 + 0, which chance has
  }
  return sum;
}

// The mean of the best vote of each pixel that agrees, weighted.
Velocity mean_about(std::span<const Vote> votes, double mps) {
  double weights = 0, sum = 0;
  for (std::size_t i = 0; i < votes.size();) {
    const std::size_t pixel = votes[i].pixel;
    const Vote* best = nullptr;
    for (; i < votes.size() && votes[i].pixel == pixel; ++i) {
      if (std::abs(off_deviations(votes[i], mps)) > unlikely_deviations) continue;
      if (best == nullptr || votes[i].evidence_nats > best->evidence_nats) best = &votes[i];
    }
    if (best == nullptr || best->evidence_nats < 0) continue;
    const double weight = 1 / (best->velocity.std_mps * best->velocity.std_mps);
    weights += weight;
    sum += weight * best->velocity.mps;
  }
  return weights > 0 ? Velocity{sum / weights, 1 / std::sqrt(weights)} : Velocity{mps, 0};
}

// The evidence that a vote needs to be among the best, so that its velocity is tried. votes: one or
// more.
double least_tried(std::span<const Vote> votes) {
  std::array<Vote, most_tried> best;
  const auto end = std::partial_sort_copy(
      votes.begin(), votes.end(), best.begin(), best.end(),
      [](const Vote& a, const Vote& b) { return a.evidence_nats > b.evidence_nats; });
  return (end - 1)->evidence_nats;
}

}  // namespace

double evidence_nats(double gain_nats, double std_delay_ns, double circle_ns) {
  return gain_nats + std::log(std::sqrt(2 * std::numbers::pi) * std_delay_ns / circle_ns);
}

std::optional<SharedVelocity> most_voted(std::span<const Vote> votes, double max_speed_mps) {
  if (votes.empty()) return std::nullopt;
  const double least = least_tried(votes);
  const Vote* best = nullptr;
  double best_nats = 0;
  for (const Vote& vote : votes) {
    if (vote.evidence_nats < least) continue;
    const double nats = evidence_at(votes, vote.velocity.mps);
    if (best != nullptr && nats <= best_nats) continue;
    best = &vote;
    best_nats = nats;
  }
  const Velocity mean = mean_about(votes, best->velocity.mps);
  const double ways = std::max(1.0, 2 * max_speed_mps / best->velocity.std_mps);
  return SharedVelocity{mean.std_mps > 0 ? mean : best->velocity, best_nats - std::log(ways)};
}

}  // namespace splid::array
