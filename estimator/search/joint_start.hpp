#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "estimator/search/target_search.hpp"
#include "estimator/several/joint_likelihood.hpp"
#include "estimator/several/range_profile.hpp"
#include "estimator/several/target_claims.hpp"

namespace splid {

// Where a joint fit of several targets begins: what the search of the frame, and the photons about
// its best target, already show of others. Nothing is looked for.
//
// Threads: one thread for each object, which holds scratch. Errors: none. No allocation.
class JointStart {
 public:
  // The photons of a target whose pulse fits are spread as those of two that are less than so far
  // apart: a gaussian pulse of 100 photons has half of that by chance.
  static constexpr double least_spread_widths = 1.5;

  // search, shape, train, likelihood, claims: outlive this. sure_nats: a target that gains so much
  // is there, however the others are refitted. most: targets, 1 to most_targets.
  JointStart(const TargetSearch& search, const PulseShape& shape, const PulseTrain& train,
             const JointLikelihood& likelihood, const TargetClaims& claims, double sure_nats,
             std::size_t most)
      : search_(search),
        shape_(shape),
        train_(train),
        likelihood_(likelihood),
        claims_(claims),
        sure_nats_(sure_nats),
        most_(most),
        profile_(shape) {}

  struct Guess {
    JointParameters at;
    bool is_row = false;   // they are in place of the best target, close to each other
    bool do_part = false;  // two that part over the frame, closer than others are told apart
    // Of each target, the gain without which it is none: three quarters of what it gains alone, for
    // those that stand elsewhere, or of what its own pulses gain where some are another's too.
    std::array<double, most_targets> least_nats{};
  };
  // What the frame shows at once: two targets or a row of more in place of the best one, where its
  // photons are spread as those of so many; or else targets at the other peaks of the search that
  // are nearly as high as the best one, but for peaks where the combs of two others meet. The guess
  // is the best target alone where there is no such.
  //
  // alone: the best target, about which the likelihood has been collected. first: its search.
  // moving: whether targets may move.
  [[nodiscard]] Guess guess(const Exposure& exposure, const JointParameters& alone,
                            const TargetSearch::Search& first, bool moving);
  // Two targets of equal signals in place of one and the last one, which are close to each other.
  // The likelihood has been collected about `start`.
  [[nodiscard]] JointParameters pair_about(const Exposure& exposure, const JointParameters& start,
                                           std::size_t target, bool moving) const;

 private:
  struct Spread {
    DelayLine middle, off;
  };
  [[nodiscard]] Spread spread_about(const Exposure& exposure, const JointParameters& at,
                                    std::size_t target, DelayLine line) const;
  [[nodiscard]] std::optional<JointParameters> parting_pair(const JointParameters& pair) const;
  [[nodiscard]] Guess row_about(const Exposure& exposure, const JointParameters& alone,
                                const TargetSearch::Search& first, bool moving);
  [[nodiscard]] bool are_told_apart(const JointParameters& row) const;
  [[nodiscard]] JointParameters as_profile_has_it(const Exposure& exposure,
                                                  const JointParameters& pair,
                                                  const TargetParameters& alone);
  [[nodiscard]] RangeProfile::Row likelier_with_middle(const RangeProfile::Row& pair);
  void see_profile(const Exposure& exposure, DelayLine line, double background_per_ns);
  [[nodiscard]] Guess with_peaks(const Exposure& exposure, const JointParameters& alone,
                                 const TargetSearch::Search& first) const;
  void share_light(const Exposure& exposure, const JointParameters& alone, Guess& guess) const;
  [[nodiscard]] std::size_t partner_of_first(std::span<const DelayLine> peaks) const;
  [[nodiscard]] bool is_far_from(std::span<const DelayLine> others, DelayLine line) const;

  const TargetSearch& search_;
  const PulseShape& shape_;
  const PulseTrain& train_;
  const JointLikelihood& likelihood_;
  const TargetClaims& claims_;
  double sure_nats_;
  std::size_t most_;
  RangeProfile profile_;
};

}  // namespace splid
