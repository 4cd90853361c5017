#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "estimator/likelihood/maximizer.hpp"
#include "estimator/search/acceleration_search.hpp"
#include "estimator/search/target_search.hpp"
#include "estimator/selection/pulse_tail.hpp"
#include "estimator/selection/thinning.hpp"

// The room selection/ decides how many targets a frame has. Open this file first. Its parts:
//   target_selection.hpp  the targets, one after the other, and the fit of all of them together:
//     target_selection.cpp  the rule
//     next_target.cpp       where one more target may be, also two that look like one
//     target_detection.cpp  whether a target is one, and not what another's pulse leaves over
//     last_fit.cpp          the last fit of all, gains and range odds
//   thinning.hpp          a frame without the light of targets
//   pulse_tail.hpp        what a tail of a pulse explains

namespace splid::selection {

using likelihood::Maximum;
using likelihood::Model;
using likelihood::Target;

struct SelectionScope {
  double threshold_nats = 0;  // gain from which on a frame's only target is significant
  std::size_t targets = 1;    // that a frame may have
  bool is_width_free = false;
  bool may_be_dead = false;  // whether frames may come with their dead time
};

struct SelectedTarget {
  double gain_nats = 0;  // of the log-likelihood, over the maximum without this target
  double range_odds_nats = 0;
};

// All targets of a frame. There may be more than asked for; these were fitted with them.
struct Selection {
  Maximum best;  // of all together, the one with the most signal first
  std::array<SelectedTarget, most_targets> targets;
  std::size_t count = 0;
};

// Finds the targets of a frame by one rule, one after the other:
//
//  1. The light of those found is taken out of the frame (Thinning). A place that a search has seen
//     is looked at in what is left, or what is left is searched. Two that look like one are parted
//     without a search.
//  2. All are fitted together. A further target is there where the maximum with it exceeds the
//     maximum without by the threshold of a frame's only target.
//  3. Within tail_widths of a brighter one that moves alike, a target must also gain more than that
//     one does with a free width and a tail. Two closer than closest_widths are one wide pulse.
//
// Light that fails the third test stays in the fit while further targets are looked for, so that
// neither it nor its side lobes are taken for them. It is then left out.
class TargetSelection {
 public:
  static constexpr double closest_widths = 2.5;
  static constexpr double tail_widths = 30;

  // acceleration: null where paths are straight.
  TargetSelection(TargetSearch& search, AccelerationSearch* acceleration, const PulseTrain& train,
                  const PulseShape& shape, const SelectionScope& scope, std::size_t max_photons);

  // first: the frame's best target, which `search` has just found. track_terms: see
  // likelihood::free_set(). Valid until the next call.
  const Selection& select(const FoldedFrame& frame, const Maximum& first, std::size_t track_terms,
                          Effort most);
  // What the last frame gains where its targets may move that were taken to be at rest.
  double gain_by_moving_nats();

 private:
  // A target far from all others that gains so much more than the threshold waits for the last fit.
  static constexpr double plain_margin_nats = 20;
  // From so much on, over the frame, the photons show which of two that cross is which.
  static constexpr double crossing_widths = 4;

  // How a target was found: alone, with what had been found before it taken out.
  struct Member {
    TargetSearch::Search search;
    bool is_detected = false;
  };
  bool add_next(Effort most);
  std::optional<Target> find_seen(const FoldedFrame& rest);
  std::optional<RangeOdds::Place> seen_beside();
  std::optional<Target> find_next(const FoldedFrame& rest, Effort most);
  bool add(const Target& next);
  void refine();
  [[nodiscard]] Maximum best_split(bool is_early);
  [[nodiscard]] bool is_plain_pair(const Maximum& pair) const;
  bool accept(const Maximum& together);
  [[nodiscard]] std::optional<std::array<Target, 2>> pair_about(std::size_t target);
  [[nodiscard]] Maximum maximize(const Model& start, double enough_nats);
  [[nodiscard]] std::size_t detected() const;
  void judge_targets();
  [[nodiscard]] bool stands(std::size_t target, std::span<const std::size_t> brighter);
  [[nodiscard]] bool beats_other_pulse(std::size_t target, std::size_t bright);
  [[nodiscard]] bool beats_shapes(const Model& without);
  [[nodiscard]] double apart_ns(const DelayTrack& a, const DelayTrack& b) const;
  [[nodiscard]] double apart_widths(const DelayTrack& a, const DelayTrack& b) const;
  [[nodiscard]] double parting_widths(const DelayTrack& a, const DelayTrack& b) const;
  [[nodiscard]] bool is_plain(const Target& next, double gain_nats) const;
  void sort_by_signal();
  void drop(std::size_t target);
  void try_other_places();
  void try_places(const Maximum& found, std::size_t k, std::size_t m);
  void try_model(const Model& other, const Maximum& found, std::size_t k, std::size_t m);
  [[nodiscard]] double gain_of(std::size_t target);
  [[nodiscard]] const TargetSearch::Search* searched_about(std::size_t target) const;
  [[nodiscard]] double range_odds_nats(std::size_t target);
  void finish();

  TargetSearch& search_;
  AccelerationSearch* acceleration_;
  const PulseTrain& train_;
  const PulseShape& shape_;
  SelectionScope scope_;
  likelihood::Maximizer maximizer_, wide_;
  Thinning thinning_;
  PulseTail tail_;
  const FoldedFrame* frame_ = nullptr;
  std::size_t terms_ = 2;
  Maximum all_;                  // of all that was found
  bool is_refined_ = false;      // all_ is a maximum of them together
  std::vector<Member> members_;  // of each target in all_, and room for more
  std::array<std::optional<double>, most_targets> pair_odds_nats_{};
  std::vector<DelayTrack> lines_;  // scratch
  Selection selection_;
};

}  // namespace splid::selection
