#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "estimator/fold/folded_frame.hpp"
#include "estimator/fold/near_set.hpp"
#include "estimator/likelihood/exposure.hpp"
#include "estimator/likelihood/maximizer.hpp"
#include "estimator/likelihood/model.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"
#include "estimator/search/acceleration_search.hpp"
#include "estimator/search/target_search.hpp"

// The room selection/ decides how many targets a frame has. Open this file first. Its parts:
//   target_selection.hpp  the targets, one after the other, and the fit of all of them together:
//     target_selection.cpp  the rule
//     next_target.cpp       where one more target may be
//     pair_start.cpp        two that look like one
//     target_detection.cpp  whether a target is one, and not what another's pulse leaves over
//     last_fit.cpp          the last fit of all, gains and range odds
// TargetSelection uses Thinning, a frame without the light of targets, and PulseTail, which tells
// how well pulses of other shapes explain the photons.

namespace splid::selection {

// Takes the light of targets out of a frame: a photon stays with the chance that the background and
// all light that is not taken out have of the intensity at it. What stays is as if these targets
// were not there: the side lobes of their combs are gone too.
//
// A photon draws its lot by its place in the frame, so that the same frame gives the same rest.
class Thinning {
 public:
  // most_width: how many times as wide as configured a pulse may be.
  Thinning(const PulseShape& shape, const PulseTrain& train, std::size_t max_photons,
           double most_width);

  // The frame without the light of the model's targets, but for the target `kept` (no target's
  // number: without all). It comes without its dead time. Valid until the next call.
  const FoldedFrame& rest(const FoldedFrame& frame, const likelihood::Model& model,
                          std::size_t kept = most_targets);

 private:
  void add_light(const FoldedFrame& frame, const likelihood::Model& model, std::size_t target,
                 std::vector<double>& light);

  const PulseShape& shape_;
  const PulseTrain& train_;
  std::vector<CombWindow> windows_;
  NearSet near_;
  FoldedFrame rest_;
  std::vector<double> taken_, kept_;          // light at each photon of the frame
  std::vector<double> offset_, h_, d1_, d2_;  // scratch: one a photon and pulse
  std::vector<std::uint8_t> stays_;
};

// How well pulses of other shapes explain the photons about a track: of another width, and with a
// tail, which is a share of the light that is late by an exponential delay. The photons are counted
// by how far from the track's pulses they are.
class PulseTail {
 public:
  // How far from a pulse its light is looked at, in pulse widths.
  static constexpr double reach_widths = 32;

  PulseTail(const PulseShape& shape, const PulseTrain& train, std::size_t max_photons);

  // False where pulses are too close to each other.
  [[nodiscard]] bool looks() const { return cells_ > 0; }
  // Counts the photons about the track of a model's first target.
  void count(const FoldedFrame& frame, const likelihood::Model& about);
  // The log-likelihood of the counts under a model.
  double nats(const likelihood::Model& model);
  // The most of it with another place and width of the first target's pulse, and with a tail too;
  // the signals of the others are refitted. enough_nats: the look ends where it
  // reaches so much, or cannot.
  double other_width_nats(const likelihood::Model& model, double enough_nats);
  double with_tail_nats(double enough_nats);

 private:
  static constexpr double cells_a_width = 2;
  static constexpr std::size_t most_cells = 2 * static_cast<std::size_t>(reach_widths) * 2;
  using Cells = std::array<double, most_cells>;
  using Edges = std::array<double, most_cells + 1>;
  // The amounts that the counts are fitted by, in their order: photons of the pulse, of its tail
  // and of the other targets, an offset in ns, and the logarithm of the width.
  enum Amount : std::size_t { body, tail, first_other };
  static constexpr std::size_t most_amounts = first_other + (most_targets - 1) + 2;
  using Amounts = std::array<double, most_amounts>;

  void put(const likelihood::Model& model, std::size_t target, std::size_t column);
  double expect(const Amounts& at, double tail_ns);
  double maximize(Amounts& at, double tail_ns, double enough_nats);
  [[nodiscard]] std::size_t amounts() const { return first_other + others_ + 2; }
  [[nodiscard]] std::size_t offset_at() const { return first_other + others_; }

  const PulseShape& shape_;
  const PulseTrain& train_;
  double cell_ns_, first_ns_;
  std::size_t cells_ = 0;
  std::vector<CombWindow> windows_;
  NearSet near_;
  Cells counts_{}, expected_{};
  DelayTrack about_;
  Exposure exposure_;
  Amounts fitted_{};  // of the other width
  double dark_ = 0;   // photons of the background in each cell
  std::size_t others_ = 0;
  // Derivatives of the expected photons by each amount.
  Eigen::Matrix<double, static_cast<int>(most_cells), static_cast<int>(most_amounts)> by_;
  Eigen::Matrix<double, static_cast<int>(most_cells), static_cast<int>(most_amounts)> over_;
  Edges place_{}, light_{}, h_{}, d1_{}, d2_{};  // scratch
};

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
  // Two as close as this may be one wide pulse in their middle.
  static constexpr double one_pulse_widths = pulse_reach_widths;
  // What is left to gain where a maximum is only compared.
  static constexpr double greedy_nats = 3e-2;

  // How a target was found: alone, with what had been found before it taken out.
  struct Member {
    TargetSearch::Search search;
    bool is_detected = false;
  };
  bool add_next(Effort most);
  std::optional<Target> find_seen(const FoldedFrame& rest);
  std::optional<RangeOdds::Place> seen_beside();
  [[nodiscard]] bool may_be_side_lobe(const RangeOdds::Place& place, std::size_t member) const;
  [[nodiscard]] double least_gain_nats(const Target& next) const;
  std::optional<Target> find_next(const FoldedFrame& rest, Effort most);
  DelayTrack likeliest_lobe(const FoldedFrame& rest, const Maximum& found);
  bool add(const Target& next);
  bool add_together(const Target& next);
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
  [[nodiscard]] bool may_be_side_lobe(const Target& target, const Target& bright) const;
  [[nodiscard]] bool is_near(const Target& next) const;
  void keep_detected();
  void sort_by_signal();
  void drop(std::size_t target);
  void try_other_places();
  void try_places(const Maximum& found, std::size_t k, std::size_t m);
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
