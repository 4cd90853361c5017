#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "estimator/fold/dead_intervals.hpp"
#include "estimator/fold/folded_frame.hpp"
#include "estimator/likelihood/maximizer.hpp"
#include "estimator/model/options.hpp"
#include "estimator/search/target_search.hpp"

namespace splid {

// A maximum of the likelihood over paths of targets that accelerate, and what the search found.
struct AcceleratedFit {
  likelihood::Maximum best;
  // The target's straight line in the straightened frame, as TargetSearch found it there: for the
  // odds of the range.
  likelihood::Maximum straight;
};

// Finds targets that accelerate. A quadratic term is tried by straightening the frame by it, which
// leaves a straight line for TargetSearch. The terms lie so close that a path stays in a delay bin
// between them. The best cells of all terms are looked into with finer terms, then maximized.
//
// Design note: cost grows as a t_a^2 / 6 c. At 100 m/s^2 and bins of ten widths of 0.1 ns a frame
// of 50 ms takes one look, 200 ms take five, and 1 s takes 37 looks.
class AccelerationSearch {
 public:
  // max_acceleration_mps2: >= 0, towards and away. straight_dead: room for the dead time of a
  // straightened frame; empty: frames come without.
  AccelerationSearch(TargetSearch& search, const PulseTrain& train, double width_ns,
                     double max_acceleration_mps2, std::size_t max_photons,
                     std::optional<DeadIntervals> straight_dead = std::nullopt);

  // The largest quadratic term in a frame of this length, and the largest that is looked at: a zoom
  // and the maximum may add as much as a zoom's box is wide.
  [[nodiscard]] double max_quadratic_ns(double length_ns) const;
  [[nodiscard]] double reach_ns(double length_ns) const;

  // How many quadratic terms the first look at a frame takes: one where any path stays within a
  // delay bin of a straight line. They grow with the square of the frame's length.
  [[nodiscard]] double looks(double length_ns) const { return 2 * steps(length_ns, 0) + 1; }

  // The best maximum over all delays, range walks and quadratic terms; empty where no cell held a
  // photon. The odds of `search` are then those of the range in the frame as it was straightened.
  std::optional<AcceleratedFit> find(const FoldedFrame& frame, Effort most);

  // The frame without a quadratic term, with its dead time where it has that. Valid until the next
  // call.
  const FoldedFrame& straightened(const FoldedFrame& frame, double quadratic_ns);

 private:
  using Start = TargetSearch::Spot;
  std::optional<Start> find_start(const FoldedFrame& frame, Effort most);
  std::optional<Start> find_at_level(const FoldedFrame& photons, std::size_t level);
  [[nodiscard]] double half_step_ns(std::size_t level) const;
  [[nodiscard]] double steps(double length_ns, std::size_t level) const;
  // Without the dead time, which no look at cells needs.
  const FoldedFrame& straightened_photons(const FoldedFrame& photons, double quadratic_ns);
  void look(const FoldedFrame& photons, std::size_t level);
  Start zoom_into(const FoldedFrame& photons, std::size_t level, DelayTrack track);

  TargetSearch& search_;
  const PulseTrain& train_;
  double width_ns_;
  double max_acceleration_mps2_;
  FoldedFrame straight_;
  std::optional<DeadIntervals> straight_dead_;
  FoldedFrame sample_;
  std::vector<SearchCell> best_;
};

}  // namespace splid
