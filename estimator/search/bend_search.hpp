#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "estimator/fold/blind_time.hpp"
#include "estimator/fold/folded_frame.hpp"
#include "estimator/likelihood/maximizer.hpp"
#include "estimator/model/options.hpp"
#include "estimator/search/target_search.hpp"

namespace splid {

// A maximum of the likelihood over paths that bend, and what the search found of it.
struct BentFit {
  likelihood::Maximum best;
  // The target's straight line in the frame without its bend, as TargetSearch found it there: for
  // the odds of the range.
  likelihood::Maximum straight;
};

// Finds targets that accelerate. The delay of a target with the acceleration a is, at the share s
// of the frame from -1/2 to 1/2,
//   delay + range walk s + bend (s^2 - 1/12),   bend = a t_a^2 / c,
// so that the bend is six times the quadratic term of its track. A bend is tried by straightening
// the frame by it; what is left is a straight line for TargetSearch. The bends that are tried lie
// so close that between them a path stays in a delay bin of the search, and all photons count for
// each of them. The best cells of all bends are then looked into with finer bends, and the
// likelihood is maximized in the bend too.
//
// Design note: cost grows with the bends that are possible, a t_a^2 / c. At 100 m/s^2 and bins of
// ten widths of 0.1 ns a frame of 50 ms takes one look, 200 ms take five, and 1 s takes 37 looks.
class BendSearch {
 public:
  // How far beyond the largest bend is looked, in pulse widths, for the threshold: what a zoom and
  // the maximum may add.
  static constexpr double least_reach_widths = 20;

  // max_acceleration_mps2: >= 0, towards and away. straight_blind: room for the blind time of a
  // straightened frame; empty: frames come without.
  BendSearch(TargetSearch& search, const PulseTrain& train, double width_ns,
             double max_acceleration_mps2, std::size_t max_photons,
             std::optional<BlindTime> straight_blind = std::nullopt);

  // How far a path may bend in a frame of this length: the largest |bend|.
  [[nodiscard]] double max_bend_ns(double length_ns) const;

  // How many bends the first look at a frame takes: one where a straight line stays in a delay bin
  // of the search wherever the path may bend to. They grow with the square of the frame's length.
  [[nodiscard]] double looks(double length_ns) const { return 2 * steps(length_ns, 0) + 1; }
  // More take seconds a frame.
  static constexpr double most_looks = 400;
  // What to say to people where there are more.
  [[nodiscard]] std::string too_many_looks_text(double length_ns) const;

  // The best maximum over all delays, range walks and bends; empty where no cell held a photon. The
  // odds of `search` are then those of the range in the frame as it was straightened.
  std::optional<BentFit> find(const FoldedFrame& frame, Effort most);

  // The frame without a bend, with its blind time where it has that. Valid until the next call.
  const FoldedFrame& straightened(const FoldedFrame& frame, double bend_ns);

 private:
  struct Cell {
    DelayTrack line;
    double bend_ns;
    std::uint32_t count;
  };
  struct Start {
    DelayTrack line;
    double bend_ns;
    double box_gain_nats;
    double signal_photons;  // in the box
  };
  [[nodiscard]] likelihood::Maximum maximize(const FoldedFrame& frame, DelayTrack line,
                                             double bend_ns);
  std::optional<Start> find_start(const FoldedFrame& frame, Effort most);
  std::optional<Start> find_at_level(const FoldedFrame& photons, std::size_t level);
  [[nodiscard]] double steps(double length_ns, std::size_t level) const;
  // Without the blind time, which no look at cells needs.
  const FoldedFrame& straightened_photons(const FoldedFrame& photons, double bend_ns);
  void look(const FoldedFrame& photons, std::size_t level);
  void keep(const Cell& cell);
  Start zoom_into(const FoldedFrame& photons, std::size_t level, const Cell& cell);

  TargetSearch& search_;
  const PulseTrain& train_;
  double width_ns_;
  double max_acceleration_mps2_;
  FoldedFrame straight_;
  std::optional<BlindTime> straight_blind_;
  FoldedFrame sample_;
  std::vector<Cell> best_;
};

}  // namespace splid
