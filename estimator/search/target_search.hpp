#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "estimator/fit/range_odds.hpp"
#include "estimator/fit/refinement.hpp"
#include "estimator/fold/folded_frame.hpp"
#include "estimator/model/options.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"
#include "estimator/search/line_search.hpp"
#include "estimator/search/zoom.hpp"

namespace splid {

// What is looked for, and how hard.
struct SearchScope {
  double frame_length_ns = 0;  // nominal
  double max_travel_ns = 0;    // largest |g t_a| over such a frame; 0: the target is at rest
  double threshold_nats = 0;   // gain over no target that is significant
  SearchVolume volume;         // delays told apart and travels possible, for the odds
  double least_odds_nats = 0;  // of a range that is known: what may be a rival is looked at
  Effort effort = Effort::balanced;
  bool near_copies = true;  // a comb that nearly fits itself at another delay is to be told apart
};

// Finds a frame's target: searches all delays and travels, coarse at first and finer only where
// that has shown nothing significant, zooms into the best cells and climbs to the best of their
// maxima.
//
// Threads: one an object. Errors: none. No allocation in the calls for frames of up to max_photons.
class TargetSearch {
 public:
  // A zoom reaches at least so many pulse widths in delay, and twice as far in travel: a comb's
  // near copies, and what travel makes up for, are within.
  static constexpr double least_reach_widths = 8;

  TargetSearch(const PulseTrain& train, const PulseShape& shape, const SearchScope& scope,
               std::size_t max_photons);

  // The best maximum found; empty where no cell held a photon. most: no level beyond this effort.
  std::optional<Fit> find(const FoldedFrame& frame, Effort most = Effort::exhaustive);
  // The maximum within a coarse search cell of a line, and nothing else.
  Fit find_near(const FoldedFrame& frame, DelayLine line);
  // What find_near() left out: the best of a fit and of all delays that its comb can be taken for.
  Fit look_beside(const FoldedFrame& frame, const Fit& fit);
  // The maximum near a delay for a target at rest.
  Fit fit_at_rest(const FoldedFrame& frame, double delay_ns);
  // The maximum near a line for a target that may move.
  Fit fit_moving(const FoldedFrame& frame, DelayLine line);
  // What the likelihood says of a target found otherwise.
  Fit judge(const FoldedFrame& frame, const FrameParameters& at);
  // How sure a fit's range is (see RangeOdds), given what the last find(), or find_near() and
  // look_beside(), came by.
  // Of a sampled frame those of the sample.
  [[nodiscard]] double range_odds_nats(const Fit& fit) const;

 private:
  // One way of looking: its grid, and the windows that a zoom into one of its cells needs.
  struct Level {
    SearchGrid grid;
    double reach_ns;
    std::vector<CombWindow> windows;  // one a stretch
  };
  // Where a zoom into a cell has ended.
  struct Spot {
    DelayLine line;
    double box_gain_nats;
  };

  [[nodiscard]] std::vector<Level> make_levels(const SearchScope& scope) const;
  [[nodiscard]] std::vector<SearchGrid> grids() const;
  [[nodiscard]] std::size_t widest_level_overlap() const;
  [[nodiscard]] bool has_shoulders() const;
  std::optional<Fit> find_by_sample(const FoldedFrame& frame);
  std::optional<Fit> find_in(const FoldedFrame& photons, Effort most);
  std::optional<Fit> find_at_level(const FoldedFrame& photons, const Level& level);
  Fit fit_cell(const FoldedFrame& photons, const Level& level, const Exposure& exposure,
               DelayLine line, double to_beat_nats = -std::numeric_limits<double>::infinity());
  void recheck_delay(const FoldedFrame& photons, const Level& level, const Exposure& exposure,
                     Fit& best);
  void try_delay(const FoldedFrame& photons, const Level& level, const Exposure& exposure,
                 double shift_ns, DelayLine from, Fit& best);
  Fit climb(const FoldedFrame& photons, const Exposure& exposure, DelayLine line,
            double to_beat_nats = -std::numeric_limits<double>::infinity());
  bool is_tried(double delay_ns);
  ZoomResult zoom_into(const FoldedFrame& photons, const Level& level, DelayLine line);
  [[nodiscard]] double box_gain_nats(const FoldedFrame& photons, std::uint32_t count,
                                     double box_ns) const;
  [[nodiscard]] double least_gain_nats(const Fit& best) const;
  [[nodiscard]] static double most_gain_nats(double box_gain_nats);
  [[nodiscard]] double best_possible_gain(const FoldedFrame& photons, const SearchCell& cell,
                                          const SearchGrid& grid, const Exposure& exposure) const;
  [[nodiscard]] bool is_shoulder(DelayLine line, const SearchGrid& grid, const Fit& best) const;

  const PulseTrain& train_;
  const PulseShape& shape_;
  double threshold_nats_;
  double rival_nats_;  // as far below the best peak another one counts
  double max_slope_;   // of a line: the largest g
  bool moving_;
  std::vector<Level> levels_;
  SearchGrid recheck_;             // three widths: a pulse fills one or two bins
  std::vector<double> copies_ns_;  // see near_copies_ns
  FoldedFrame sample_;             // of very many photons
  LineSearch search_;
  NearSet near_;
  Zoom zoom_;
  Refinement refinement_;
  std::vector<Spot> spots_;
  RangeOdds odds_;
  std::optional<double> sample_odds_nats_;  // of the last find(), where the sample settled it
  std::vector<double> tried_ns_;            // delays that recheck_delay() has looked at
};

}  // namespace splid
