#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "estimator/checks/pattern_check.hpp"
#include "estimator/search/joint_start.hpp"
#include "estimator/search/target_search.hpp"
#include "estimator/several/joint_fit.hpp"
#include "estimator/several/target_claims.hpp"

namespace splid {

// One of a frame's targets. Its fit is that of all targets together: deviations are those with all
// others unknown too, and the gain is what this target adds to the others.
struct FoundTarget {
  Fit fit;
  double range_odds_nats = 0;
  std::optional<double> amplitude_misfit;
  std::optional<double> shape_odds_nats;  // where FlankCheck was asked
  // Of its light in what is left of the frame without the others.
  PulseVerdict pulse;
  PathVerdict path;
  bool moves = false;  // although targets are taken to be at rest
};

// The targets as one maximum. What the deviations of two have in common is left out.
likelihood::Maximum maximum_of(std::span<const FoundTarget> targets);

// Finds the targets that a frame shows beside its best one. What the frame shows at once is fitted
// at once (JointStart). Where not all of that is targets, and for those beyond, they are found one
// after the other:
//
//  1. Photons are taken out of the frame with the share that the targets found so far have in the
//     intensity at each of them. What is left is as if these targets were not there: their
//     shoulders, the delays at which a comb falls on itself in part, are gone too.
//  2. What is left is looked at close to each target, then at the strongest other peak of the
//     frame's search, and, where all targets move alike, at all delays of about their travel; where
//     none of these shows a target, TargetSearch looks for the best line in what is left, in its
//     finest cells alone.
//  3. All targets are fitted together (JointFit). The new target is claimed where it adds as much
//     to the gain as a frame's only target needs, so that it is there by chance as rarely. A target
//     that is plainly there and far from the others waits for this until all have been found.
//
// A new target is claimed where it is not what another target's pulse leaves over (TargetClaims).
// What is not claimed stays in the joint fit while further targets are looked for, so that neither
// it nor its shoulders are taken for them, and is left out of the fit whose values are published.
//
// Threads: one thread for each object. Errors: none. No allocation in find() for frames of up to
// max_photons.
class SeveralTargets {
 public:
  // search, pattern_check, train, shape: outlive this. most: targets, 1 to most_targets.
  SeveralTargets(TargetSearch& search, PatternCheck& pattern_check, const PulseTrain& train,
                 const PulseShape& shape, double threshold_nats, double false_alarm_rate,
                 std::size_t most, std::size_t max_photons);

  // The targets of a frame, the one with the most signal first. first: the frame's best target, as
  // search.find() has just found it; it is significant and has a covariance. moving: whether
  // targets may move. The result is empty where there is no other target than the first, whose fit
  // then stands, and is the maximum even where its climb had been left out. Valid until the next
  // call.
  std::span<const FoundTarget> find(const FoldedFrame& frame, Fit& first, bool moving, Effort most);

 private:
  bool find_all(const FoldedFrame& frame, bool moving, Effort most, bool at_once);
  void start_with_first();
  bool start_together(const FoldedFrame& frame, bool moving);
  [[nodiscard]] bool is_one_light(const JointParameters& at) const;
  std::optional<Fit> find_passed();
  std::optional<Fit> find_alike();
  std::optional<Fit> find_anywhere(Effort most);
  std::optional<Fit> find_beside();
  bool add_next(const FoldedFrame& frame, bool moving, Effort most);
  bool add(const FoldedFrame& frame, const Fit& next, bool moving, double least_nats);
  bool add_together(const FoldedFrame& frame, const Fit& next, bool moving);
  [[nodiscard]] bool is_plain(const Fit& next) const;
  JointMaximum climb(const FoldedFrame& frame, const JointParameters& start, double sum_nats,
                     bool moving);
  [[nodiscard]] bool may_be_shoulder(const TargetParameters& target,
                                     const TargetParameters& bright) const;
  void fit_claimed(const FoldedFrame& frame, bool moving);
  void compare_with_other_places(const FoldedFrame& frame, bool moving);
  void try_other_places(const FoldedFrame& frame, const JointMaximum& found,
                        std::array<std::size_t, 2> pair, bool moving);
  void take_places(const JointMaximum& other, const JointMaximum& found,
                   std::span<const std::size_t> pair);
  bool judge(const FoldedFrame& frame, bool moving);
  [[nodiscard]] std::optional<FoundTarget> judge_one(const FoldedFrame& frame, std::size_t target,
                                                     bool moving);
  [[nodiscard]] bool started_as_parting(std::size_t target) const;
  [[nodiscard]] bool is_half_of_best(std::size_t target) const;
  [[nodiscard]] FoundTarget target_of(std::size_t target) const;
  [[nodiscard]] std::optional<double> range_odds_nats(std::size_t target, const Fit& fit);
  void add_meetings(std::size_t target, std::vector<DelayLine>& lines) const;
  [[nodiscard]] bool move_alike(DelayLine one, DelayLine other) const;

  TargetSearch& search_;
  PatternCheck& pattern_check_;
  const PulseTrain& train_;
  const PulseShape& shape_;
  double threshold_nats_;
  std::size_t most_;
  JointFit joint_;
  TargetClaims claims_;  // of those in all_
  JointStart start_;
  JointMaximum all_;                // of all that was found
  JointMaximum best_;               // of the targets that are claimed
  std::size_t first_unlooked_ = 0;  // beside the targets from this one on
  bool is_refined_ = false;         // all_ is a maximum of the joint likelihood
  bool are_peaks_left_ = true;      // that the frame's search has climbed and may be targets
  std::size_t seen_by_ = 0;         // the number in all_ of what the last whole search has found
  std::size_t started_with_ = 1;    // so many, the first in all_, were fitted at once
  bool do_started_part_ = false;    // these are two in place of the first that part
  std::array<double, most_targets> least_nats_{};  // that each of these must gain
  // How a target was found: alone, with what had been found before it taken out. Of those that were
  // fitted at once, the first has the search that showed them.
  std::vector<TargetSearch::Search> searches_;        // of each in all_
  std::array<std::size_t, most_targets> searched_{};  // the number in all_ of each in best_
  // Of each in best_: whether it has that search, and by how much another pair of places is worse.
  std::array<bool, most_targets> was_searched_{};
  std::array<std::optional<double>, most_targets> pair_odds_nats_{};
  const CombMeetings& meetings_;
  Exposure exposure_;
  FoldedFrame rest_;
  std::vector<std::uint8_t> stays_;
  std::vector<FoundTarget> found_;
  std::vector<DelayLine> compared_;  // scratch: places that a target's has been compared with
};

}  // namespace splid
