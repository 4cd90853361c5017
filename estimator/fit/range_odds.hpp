#pragma once

#include <cstddef>
#include <vector>

#include "estimator/fit/refinement.hpp"
#include "estimator/fit/significance.hpp"

namespace splid {

// How sure a frame's range is: the log of the posterior mass of its best peak over that of
// everything else in the plane of delay and travel, with all delays and travels alike before the
// frame is looked at. A frame with odds of x nats is wrong with a probability of about
// 1 / (1 + e^x).
//
// A peak's mass is exp(gain) times its Laplace volume, sqrt(det 2 pi covariance) of delay and
// travel over what is possible, and of the signal over the best peak's own; less of it where it is
// faster than is possible. Against the best one stand
//  - the peaks that the search came by: other cells, and where the comb fits itself (nearly);
//  - chance, all that it did not come by. Light that has nothing to do with a place gains nothing
//    there on average: the likelihood ratio to no target has the mean 1 over the plane, whatever
//    the pattern, the signal and the number of photons. Its mass is that of the prior, 1.
//
// Design note: chance is taken at its mean and not as this frame has it. The mean is made by rare
// high places; a frame that has such a one has it among its peaks, too, and counts it twice. Odds
// are low by some 1 to 2 nats for it, and need no sum over the plane.
//
// Threads: one an object. No allocation after construction.
class RangeOdds {
 public:
  // volume: all delays and travels that are possible; its period is what delays are told apart by,
  // the unambiguous delay: in mode `ambiguous` the odds are those of the delay within it.
  explicit RangeOdds(const SearchVolume& volume);

  void clear() { peaks_.clear(); }
  // A maximum of the likelihood; the same one as often as it is found. The strongest 64 are kept.
  void add(const Fit& peak);
  // A place whose gain is known about, and that was not climbed to.
  void add(DelayLine line, double gain_nats);

  // Of a maximum that is a hill in all directions; nats.
  [[nodiscard]] double of(const Fit& best) const;

 private:
  struct Peak {
    DelayLine line;
    double gain_nats;
    double volume_nats;  // log of the Laplace volume; that of the best peak where it is not known
    bool has_volume;
  };
  [[nodiscard]] double volume_nats(const Fit& fit) const;
  [[nodiscard]] double apart_ns(DelayLine a, DelayLine b) const;
  [[nodiscard]] bool is_same_range(DelayLine a, DelayLine b) const;
  void keep(const Peak& peak);

  SearchVolume volume_;
  std::vector<Peak> peaks_;
};

// The least odds that a risk of being wrong (0 to 0.5) asks for: log((1 - risk) / risk).
double odds_at_risk_nats(double risk);

}  // namespace splid
