#pragma once

#include <optional>
#include <span>
#include <vector>

#include "estimator/likelihood/maximizer.hpp"
#include "estimator/search/significance.hpp"

namespace splid {

// How sure a frame's range is: the logarithm of the posterior mass of its best peak over that of
// everything else in the plane of delay and range walk, which is even beforehand. A range with odds
// of x nats is wrong with a probability of about 1 / (1 + e^x).
//
// The mass of a peak is exp(gain) times its Laplace volume: of delay and range walk, relative to
// all that are possible, and of the signal, relative to the best peak's; the part beyond the
// largest speed is left out. Against the best peak stand the other maxima that the search found,
// and chance, of mass 1: the mean likelihood ratio to no target of all places nobody looked at.
//
// Design note: that mean comes from rare high places, which a frame that has them counts among its
// peaks too: the odds are too low by 1 to 2 nats, but need no sum over the plane.
class RangeOdds {
 public:
  // volume: all delays and range walks that are possible. Its period is the circle that delays are
  // told apart on; in mode `ambiguous` that is the unambiguous delay.
  explicit RangeOdds(const SearchVolume& volume);

  void clear() { peaks_.clear(); }
  // Adds a maximum of the likelihood. Of those with the same range the highest one counts; the
  // strongest 64 are kept.
  void add(const likelihood::Maximum& peak);
  // Adds a place that is no maximum, and whose gain is known only about.
  void add(DelayTrack line, double gain_nats);

  // The odds of a maximum that has a covariance, in nats. others: lines of other targets of the
  // frame, whose peaks do not speak against this one.
  [[nodiscard]] double of(const likelihood::Maximum& best,
                          std::span<const DelayTrack> others = {}) const;
  // The strongest place that is not at one of these lines, or none.
  struct Place {
    DelayTrack line;
    double gain_nats = 0;
  };
  [[nodiscard]] std::optional<Place> best_beside(std::span<const DelayTrack> lines) const;

 private:
  struct Peak : Place {
    // The log of the Laplace volume; where there is none, the best peak's counts.
    std::optional<double> volume_nats;
  };
  [[nodiscard]] double volume_nats(const likelihood::Maximum& fit) const;
  // Whether a line has the range and the velocity of another, or of one of several.
  [[nodiscard]] bool is_same_range(DelayTrack a, DelayTrack b) const;
  [[nodiscard]] bool is_one_of(DelayTrack line, std::span<const DelayTrack> lines) const;
  void keep(const Peak& peak);

  SearchVolume volume_;
  std::vector<Peak> peaks_;
};

// The least odds, in nats, that leave a risk of being wrong (above 0, to 0.5): log((1 - risk) /
// risk).
double odds_at_risk_nats(double risk);

}  // namespace splid
