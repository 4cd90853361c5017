#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "estimator/array/known_velocity.hpp"

namespace splid::array {

// A maximum of one pixel's likelihood.
struct Vote {
  std::size_t pixel = 0;
  Velocity velocity;
  // The logarithm of the likelihood ratio to no target, averaged over all delays: the gain plus the
  // share of the delays that the maximum fills.
  double evidence_nats = 0;
};

// What a maximum of such a gain says. circle_ns: of all delays.
double evidence_nats(double gain_nats, double std_delay_ns, double circle_ns);

// A velocity that several pixels may share.
struct SharedVelocity {
  Velocity velocity;
  double odds_nats = 0;  // that it is there, against chance: all velocities as likely beforehand
};

// The velocity that most pixels show. Each pixel is taken to see the velocity's target or not, with
// even odds beforehand, so that dark pixels and pixels that see another target do not matter:
//   evidence(v) = sum over pixels of log(1/2 + 1/2 sum over the pixel's votes of
//                                                    exp(evidence - (v - v_k)^2 / 2 s_k^2)).
// Against it stands chance, which no pixel has a vote of: log(1/2) a pixel, at each of the
// 2 v_max / s velocities.
//
// votes: sorted by pixel. max_speed_mps: velocities that are possible. Absent without votes.
std::optional<SharedVelocity> most_voted(std::span<const Vote> votes, double max_speed_mps);

}  // namespace splid::array
