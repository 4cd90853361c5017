#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "estimator/fold/folded_frame.hpp"
#include "estimator/likelihood/maximizer.hpp"
#include "estimator/model/chance.hpp"
#include "estimator/model/comb_meetings.hpp"
#include "estimator/model/options.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"
#include "estimator/search/delay_velocity_search.hpp"
#include "estimator/search/range_odds.hpp"
#include "estimator/search/zoom.hpp"

// The room search/ finds the line that most photons of a frame lie on, among all delays and all
// range walks. Open this file first. Its parts:
//   frame_search.hpp    the looks at a frame: where the last target was, straight, curved
//   target_fit.hpp      the fit of what a look has found
//   significance.hpp    the gain over no target that noise does not reach
//   range_odds.hpp      how sure a range is against all others
//   target_search.hpp   the search of a frame: coarse cells, zoom, maximum, side lobes
//   acceleration_search.hpp  the same for targets that accelerate
//   delay_velocity_search.hpp  the best cells of the plane, by a Taylor tree over slices of a frame
//   taylor_tree.hpp     the tree: sums along all straight lines of a block of delays
//   part_lines.hpp      the same for each rate of a comb that has several
//   comb_rows.hpp       the rows that the tree adds up: a slice's photons at each delay
//   zoom.hpp            from a cell down to a place where the likelihood has a single maximum

namespace splid {

// What is looked for, and how hard.
struct SearchScope {
  double frame_length_ns = 0;  // nominal
  double max_walk_ns = 0;      // largest |g t_a| over such a frame; 0: the target is at rest
  double threshold_nats = 0;   // gain over no target from which on it is significant
  SearchVolume volume;         // delays told apart and range walks possible, for the odds
  double least_odds_nats = 0;  // that a range needs: peaks that may lower the odds below are tried
  Effort effort = Effort::balanced;
  bool side_lobes = true;    // whether the side lobes of the comb's autocorrelation are tried
  bool may_be_dead = false;  // whether frames may come with their dead time
};

// Finds a frame's target. All delays and range walks are searched, with coarse cells at first and
// with finer cells only while nothing significant shows. The search zooms into the best cells and
// finds the maximum of the likelihood near each that may be the best.
class TargetSearch {
 public:
  using Maximum = likelihood::Maximum;
  // A zoom reaches at least so many pulse widths in delay, and twice as far in range walk. A near
  // copy of the comb, and the wrong range walk that makes up for its difference, are within that.
  static constexpr double least_reach_widths = 8;
  // So many nats leave no doubt: a maximum so far below the best one is given up, and a peak so far
  // above the threshold is not there by chance, nor a side lobe of the comb's autocorrelation,
  // which gains two thirds of it at most.
  static constexpr double no_doubt_nats = 40;

  TargetSearch(const PulseTrain& train, const PulseShape& shape, const SearchScope& scope,
               std::size_t max_photons);
  // The tables of such a search, bytes: what it allocates but for what grows with max_photons.
  // max_walk_ns and effort: see SearchScope.
  static std::size_t table_bytes(const PulseTrain& train, const PulseShape& shape,
                                 double max_walk_ns, Effort effort);

  // The best maximum of a frame; empty where no cell held a photon. most: levels beyond this effort
  // are left out. least: the level to begin with, where nothing bright is there.
  std::optional<Maximum> find(const FoldedFrame& frame, Effort most = Effort::balanced,
                              Effort least = Effort::fast);
  // The maximum within a coarse search cell about a line. Other delays are not looked at.
  Maximum find_near(const FoldedFrame& frame, DelayTrack line);
  // The look that find_near() leaves out: at all delays that can be taken for that of a fit. The
  // result is the best of them and the fit.
  Maximum look_beside(const FoldedFrame& frame, const Maximum& fit);
  // The maximum near a line, with so many free terms of the track (likelihood::free_set).
  Maximum fit(const FoldedFrame& frame, const DelayTrack& line, std::size_t track_terms);
  // What the likelihood says of a target that was found by other means.
  Maximum judge(const FoldedFrame& frame, const likelihood::Model& at);
  [[nodiscard]] likelihood::Maximizer& maximizer() { return maximizer_; }
  // How sure a fit's range is, in nats (see RangeOdds), against the peaks that the last find(), or
  // find_near() and look_beside(), came by, and no surer than in a sample that settled the search.
  // 0 where the combs of two places as high meet at the fit's: either pair may be the two targets.
  [[nodiscard]] double range_odds_nats(const Maximum& fit) const;
  // Where the combs of two targets meet.
  [[nodiscard]] const CombMeetings& meetings() const { return meetings_; }
  // The peaks that a search came by, which outlive the next search.
  struct Peaks {
    RangeOdds odds;
    // What a sample of the photons found, where it settled the search.
    std::optional<Maximum> sample_best;
    // How sure the range of a fit is against these peaks, less those of other targets.
    [[nodiscard]] double range_odds_nats(const Maximum& fit,
                                         std::span<const DelayTrack> others) const;
  };
  // How a target was found.
  struct Search {
    Maximum fit;
    Peaks peaks;
  };
  // With room for as many peaks as a search keeps.
  [[nodiscard]] Peaks no_peaks() const { return {RangeOdds(volume_), std::nullopt}; }
  // Notes a fit with the peaks of the last find(), or find_near() and look_beside().
  void keep(const Maximum& fit, Search& kept) const {
    kept.fit = fit;
    kept.peaks = peaks_;
  }
  // How sure the range of a target is that was not searched for, by a look at all delays with its
  // range walk, in a frame from which all others have been taken out. Nothing where another delay
  // is better.
  std::optional<double> range_odds_in(const FoldedFrame& rest, const Maximum& fit);

  // What AccelerationSearch needs to look for targets that accelerate, level by level.
  // One size of cells, and the windows that a zoom into such a cell needs.
  struct Level {
    SearchGrid grid;
    double reach_ns;
    std::vector<CombWindow> windows;  // one for each segment
  };
  // Where a zoom has ended.
  struct Spot {
    DelayTrack line;
    double box_gain_nats = 0;
    double signal_photons = 0;  // in the box, beyond the background's
  };
  static constexpr std::size_t sampled_photons = 65536;
  static constexpr std::size_t sampled_from = 3 * sampled_photons;
  static std::size_t cells_tried(std::size_t photons);
  [[nodiscard]] std::size_t levels(Effort most) const;
  [[nodiscard]] const Level& level(std::size_t number) const { return levels_[number]; }
  // A gain that ends the search of a frame, which noise hardly reaches, and one that ends the
  // search of a sample.
  [[nodiscard]] double settled_nats() const { return threshold_nats_ + likely_nats; }
  [[nodiscard]] double sure_nats() const { return threshold_nats_ + no_doubt_nats; }
  // The photons of so many in bins of such a width that are beyond their mean background.
  [[nodiscard]] double signal_photons(const FoldedFrame& photons, double bin_ns,
                                      std::uint32_t count) const;
  // The best cells of a frame. Valid until the next call.
  std::span<const SearchCell> cells(const FoldedFrame& photons, const Level& level);
  // Zooms into a cell, and tries `steps` quadratic terms on either side of none. is_cell: the line
  // is where the photons are, as a cell's is, and not where the target is.
  Spot zoom_into(const FoldedFrame& photons, const Level& level, DelayTrack line,
                 bool is_cell = true, double step_ns = 0, int steps = 0);

 private:
  [[nodiscard]] std::vector<Level> make_levels(const SearchScope& scope) const;
  [[nodiscard]] std::vector<SearchGrid> grids() const;
  [[nodiscard]] bool has_side_lobes() const;
  void begin();
  std::optional<Maximum> find_by_sample(const FoldedFrame& frame);
  std::optional<Maximum> find_in(const FoldedFrame& photons, Effort most, Effort least);
  std::optional<Maximum> find_at_level(const FoldedFrame& photons, const Level& level);
  Maximum fit_near(const FoldedFrame& photons, const Level& level, DelayTrack line,
                   double to_beat_nats = -std::numeric_limits<double>::infinity());
  void recheck_delay(const FoldedFrame& photons, const Level& level, Maximum& best);
  void maximize_beside(const FoldedFrame& photons, Maximum& best);
  void try_side_lobes(const FoldedFrame& photons, const Level& level, Maximum& best);
  void try_delay(const FoldedFrame& photons, const Level& level, double shift_ns, DelayTrack from,
                 Maximum& best);
  Maximum maximize(const FoldedFrame& photons, DelayTrack line,
                   double to_beat_nats = -std::numeric_limits<double>::infinity());
  [[nodiscard]] bool is_where_combs_meet(const Maximum& fit) const;
  [[nodiscard]] double box_gain_nats(const FoldedFrame& photons, std::uint32_t count,
                                     double box_ns) const;
  [[nodiscard]] double least_gain_nats(const Maximum& best) const;
  [[nodiscard]] double best_possible_gain(const FoldedFrame& photons, const SearchCell& cell,
                                          const SearchGrid& grid, const Exposure& exposure) const;
  [[nodiscard]] bool is_side_lobe(DelayTrack line, const SearchGrid& grid,
                                  const Maximum& best) const;

  const PulseTrain& train_;
  const PulseShape& shape_;
  SearchVolume volume_;
  double threshold_nats_;
  double rival_nats_;  // peaks that are no further below the best one than this count against it
  double max_slope_;   // the largest g of a line
  bool moving_;
  likelihood::FreeSet free_;
  std::vector<Level> levels_;  // the coarsest first
  SearchGrid recheck_;         // its bins are three widths, so that a pulse fills one or two
  std::vector<double> side_lobes_ns_;  // see strong_side_lobes_ns
  CombMeetings meetings_;
  FoldedFrame sample_;  // of a frame with very many photons
  DelayVelocitySearch search_;
  NearSet near_;
  Zoom zoom_;
  likelihood::Maximizer maximizer_;
  std::vector<Spot> spots_;
  Peaks peaks_;  // of the last search
};

}  // namespace splid
