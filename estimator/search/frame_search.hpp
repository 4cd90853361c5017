#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "estimator/fold/dead_intervals.hpp"
#include "estimator/likelihood/maximizer.hpp"
#include "estimator/model/estimate.hpp"
#include "estimator/search/acceleration_search.hpp"
#include "estimator/search/target_search.hpp"
#include "protocol/pattern.hpp"

namespace splid {

// The ways to find a frame's target, the cheapest first: where the last frame had it, along all
// straight lines, and along all accelerated paths.
enum class Look { follow, straight, curved };

// Where a look has found the target.
struct Start {
  likelihood::Maximum at;  // of one target, as far as the look has fitted it
  double odds_nats = 0;    // of its range; 0 where it is not significant
  bool is_exact = false;   // the maximum of a straight line
};

// Finds the target of a frame by the look that is asked for.
//
// Errors: Error(Fault::usage) from the constructor, where there are too many accelerations to
// search.
class FrameSearch {
 public:
  // dead: of the detector whose dead time is modelled.
  FrameSearch(const Pattern& pattern, const PulseTrain& train, const PulseShape& shape,
              const SceneOptions& scene, const EstimatorOptions& options, double length_ns,
              std::size_t max_photons, std::optional<DeadIntervals> dead);

  std::optional<Start> straight(const FoldedFrame& frame, Effort most);
  std::optional<Start> curved(const FoldedFrame& frame, Effort most);
  // Looks where a track foretells the target. Empty where the track does not hold, or the target is
  // not there. scale: from the pattern's clock to that of the track.
  std::optional<Start> follow(const FoldedFrame& frame, const TargetTrack& track,
                              std::int64_t mid_ps, double scale);
  // Notes what a frame has shown, with the odds that its search gave.
  void remember(const FoldedFrame& frame, std::int64_t mid_ps, const Estimate& estimate,
                TargetTrack& track) const;
  // What a fit by other means is, beside the peaks of straight().
  Start judged(const FoldedFrame& frame, const likelihood::Model& at);
  // Whether a followed target's signal is not what it was.
  static bool has_changed(const TargetTrack& track, const likelihood::Maximum& now);

  // The largest range walk over a frame of nominal length.
  static double max_walk_ns(const SceneOptions& scene, double length_ns);
  // How far a photon of a target may then lie from its place at mid-frame; see FoldedFrame.
  static double reach_ns(const SceneOptions& scene, const PulseShape& shape, double length_ns);
  [[nodiscard]] bool moves() const { return max_walk_ns_ > 0; }
  [[nodiscard]] bool may_accelerate() const { return acceleration_ != nullptr; }
  // Whether every accelerated path stays in the delay bin of a straight line, which then leads to
  // the path too.
  [[nodiscard]] bool accelerates_little(double length_ns) const {
    return acceleration_->looks(length_ns) == 1;
  }
  // Whether accelerated paths are searched, and straight lines do not lead to them.
  [[nodiscard]] bool must_accelerate(double length_ns) const {
    return must_accelerate_ && may_accelerate() && !accelerates_little(length_ns);
  }
  [[nodiscard]] bool is_possible(const DelayTrack& track, double length_ns) const;
  [[nodiscard]] bool is_periodic() const { return is_periodic_; }
  // The circle that delays are told apart on: equal delays modulo this are the same.
  [[nodiscard]] double told_apart_ns() const { return told_apart_ns_; }
  [[nodiscard]] double threshold_nats() const { return threshold_nats_; }
  [[nodiscard]] double curved_threshold_nats() const { return curved_threshold_nats_; }
  [[nodiscard]] double least_odds_nats() const { return least_odds_nats_; }
  // A gain that the search takes for a target without looking any closer.
  [[nodiscard]] double settled_nats() const { return search_.settled_nats(); }
  [[nodiscard]] TargetSearch& targets() { return search_; }
  // Null: paths are straight.
  [[nodiscard]] AccelerationSearch* acceleration() { return acceleration_.get(); }

 private:
  void look_for_acceleration(const SceneOptions& scene, double false_alarm_rate, double length_ns,
                             std::size_t max_photons, std::optional<DeadIntervals> dead);
  [[nodiscard]] double odds_of(const likelihood::Maximum& fit) const;
  [[nodiscard]] double threshold_of(double quadratic_ns, double false_alarm_rate) const;

  const PulseTrain& train_;
  const PulseShape& shape_;
  bool must_accelerate_;  // motion `accelerating`
  bool is_periodic_;      // mode `ambiguous`: delays are told apart within the unambiguous delay
  double told_apart_ns_;
  double max_walk_ns_;  // over a frame of nominal length
  double threshold_nats_, curved_threshold_nats_;
  double least_odds_nats_;  // that a range needs to be taken as known
  TargetSearch search_;
  std::unique_ptr<AccelerationSearch> acceleration_;  // null: paths are taken as straight
};

}  // namespace splid
