#include "estimator/search/target_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "estimator/fold/kernel_choice.hpp"

namespace splid {
namespace {

using likelihood::Maximum;

// Design note: in [P]'s background, bins of 10 pulse widths find a target of 1/7 of [P]'s signal
// without a wrong peak, and bins of 5 widths one of 1/9. A third level with bins of 2.5 widths
// doubled the time to find less than one target in a hundred more (docs/evidence/performance.md).
constexpr double level_widths[] = {10, 5};
constexpr std::size_t level_cells[] = {std::size_t{1} << 18, std::size_t{1} << 20};

// The bins of a search that costs little: of a short frame, or of a target at rest.
constexpr double finest_widths = 2.5;

constexpr std::size_t cheap_cells = std::size_t{1} << 16;  // take a tenth of a millisecond

std::size_t levels_of(Effort effort) { return static_cast<std::size_t>(effort) + 1; }

std::uint32_t fitting_bins(const PulseTrain& train) {
  return CombRows(train, 0, best_search_kernels()).fitting_bins();
}

// most_cells: with bins of `widths`; finer ones are taken where they are cheap.
SearchGrid level_grid(const PulseTrain& train, double width_ns, double widths,
                      std::size_t most_cells, double max_walk_ns) {
  // A cell that is wider than half the pulses' spacing takes a pulse's neighbour for the pulse.
  // Only where pulses overlap are they one to the search.
  const double widest_ns = std::max(train.closest_ns / 2, finest_widths * width_ns);
  const double wanted_ns = std::min(widest_ns, widths * width_ns);
  const std::uint32_t fitting = fitting_bins(train);
  double bin_ns = std::min(wanted_ns, finest_widths * width_ns);
  while (true) {
    const SearchGrid grid = SearchGrid::cover(train.circle_ns, bin_ns, max_walk_ns, fitting);
    const std::size_t most = bin_ns < wanted_ns ? cheap_cells : most_cells;
    if (grid.cells() <= most || bin_ns >= widest_ns) return grid;
    bin_ns = std::min(bin_ns < wanted_ns ? wanted_ns : widest_ns, bin_ns * 1.25);
  }
}

// The grids of all levels, the coarsest first.
std::vector<SearchGrid> level_grids(const PulseTrain& train, double width_ns, double max_walk_ns,
                                    Effort effort) {
  // For a target at rest the finest cells are a single row, so that a coarser level saves nothing.
  if (!(max_walk_ns > 0)) {
    return {level_grid(train, width_ns, finest_widths, level_cells[1], max_walk_ns)};
  }
  std::vector<SearchGrid> grids;
  for (std::size_t level = 0; level < levels_of(effort); ++level) {
    const SearchGrid grid =
        level_grid(train, width_ns, level_widths[level], level_cells[level], max_walk_ns);
    if (grids.empty() || grid.cells() != grids.back().cells()) grids.push_back(grid);
  }
  return grids;
}

SearchGrid recheck_grid(const PulseTrain& train, double width_ns) {
  const double bin_ns = std::max(3 * width_ns, train.circle_ns / level_cells[0]);
  return SearchGrid::cover(train.circle_ns, bin_ns, 0, fitting_bins(train));
}

// The most that a fit in a box of this gain may reach.
//
// Design note: a box of four widths gains 0.75 to 0.9 of what the pulse itself gains. A fit that
// gains more than 1.5 times the box's gain and six nats was not seen in 10,000 frames.
double most_gain_nats(double box_gain_nats) { return 1.5 * box_gain_nats + 6; }

}  // namespace

// Design note: with few photons many cells are alike, and each costs little. With 19 signal
// photons, eight cells miss the best maximum in 0.03 % of the frames, sixteen cells in none of
// 6,000. With a million photons a single zoom costs 3 ms.
std::size_t TargetSearch::cells_tried(std::size_t photons) {
  if (photons < 4096) return DelayVelocitySearch::max_cells;
  return photons < 131072 ? 8 : 4;
}

TargetSearch::TargetSearch(const PulseTrain& train, const PulseShape& shape,
                           const SearchScope& scope, std::size_t max_photons)
    : train_(train),
      shape_(shape),
      volume_(scope.volume),
      threshold_nats_(scope.threshold_nats),
      rival_nats_(scope.least_odds_nats + likely_nats),
      max_slope_(scope.max_walk_ns / scope.frame_length_ns),
      moving_(scope.max_walk_ns > 0),
      free_(likelihood::free_set(1, moving_ ? 2 : 1)),
      levels_(make_levels(scope)),
      recheck_(recheck_grid(train, shape.width_ns())),
      side_lobes_ns_(scope.side_lobes ? strong_side_lobes_ns(train, shape.width_ns())
                                      : std::vector<double>()),
      meetings_(train, shape.width_ns()),
      sample_(train, max_photons < sampled_from ? 0 : sampled_from),
      search_(train, max_photons, grids()),
      near_(max_photons, max_photons * widest_overlap(levels_.front().windows)),
      zoom_(shape.width_ns(), shape.peak_offset_ns()),
      maximizer_(shape, train, max_photons, {1, 1, scope.may_be_dead}),
      peaks_(no_peaks()) {
  spots_.reserve(DelayVelocitySearch::max_cells);
}

std::vector<TargetSearch::Level> TargetSearch::make_levels(const SearchScope& scope) const {
  std::vector<Level> made;
  for (const SearchGrid& grid :
       level_grids(train_, shape_.width_ns(), scope.max_walk_ns, scope.effort)) {
    const double reach_ns = std::max(1.5 * grid.bin_ns, least_reach_widths * shape_.width_ns());
    const double about_ns = 2 * reach_ns + 4 * shape_.width_ns();
    const double peak_ns = shape_.peak_offset_ns();
    made.push_back({grid, reach_ns, comb_windows(train_, peak_ns - about_ns, peak_ns + about_ns)});
  }
  return made;
}

std::vector<SearchGrid> TargetSearch::grids() const {
  std::vector<SearchGrid> all = {recheck_};
  for (const Level& level : levels_) all.push_back(level.grid);
  return all;
}

std::size_t TargetSearch::table_bytes(const PulseTrain& train, const PulseShape& shape,
                                      double max_walk_ns, Effort effort) {
  std::vector<SearchGrid> grids = level_grids(train, shape.width_ns(), max_walk_ns, effort);
  grids.push_back(recheck_grid(train, shape.width_ns()));
  return DelayVelocitySearch::bytes(train, grids);
}

bool TargetSearch::has_side_lobes() const {
  return !train_.single() || train_.segments.front().comb.times_ns.size() > 1;
}

void TargetSearch::begin() {
  peaks_.odds.clear();
  peaks_.sample_best.reset();
}

std::optional<Maximum> TargetSearch::find(const FoldedFrame& frame, Effort most, Effort least) {
  begin();
  if (frame.size() >= sampled_from) {
    if (std::optional<Maximum> found = find_by_sample(frame)) return found;
  }
  std::optional<Maximum> best = find_in(frame, most, least);
  if (best) maximize_beside(frame, *best);
  return best;
}

// Design note: a few photons of a target and of the background line up along several tracks that
// are some ten deviations apart. A zoom ends at one of these maxima, which was not the highest one
// in two of 6,000 frames with 19 signal photons.
void TargetSearch::maximize_beside(const FoldedFrame& photons, Maximum& best) {
  // In delay and range walk, pulse widths.
  constexpr DelayTrack places[] = {{-2, 0}, {2, 0}, {0, -4}, {0, 4}, {0, -8}, {0, 8}};
  if (best.gain_nats < threshold_nats_ || best.gain_nats > sure_nats()) return;
  const DelayTrack about = best.track();
  const double width_ns = shape_.width_ns();
  for (const DelayTrack& place : places) {
    if (!moving_ && place.walk_ns != 0) continue;
    const DelayTrack from = {about.delay_ns + place.delay_ns * width_ns,
                             about.walk_ns + place.walk_ns * width_ns};
    const Maximum fit = maximize(photons, from, best.gain_nats);
    if (fit.gain_nats > best.gain_nats) best = fit;
  }
}

// A target that shows plainly in a sample of the photons is found by the sample, and then refined
// with all photons.
//
// Design note: to search 65,536 (sampled_photons) of a million photons takes 3 ms instead of 20.
std::optional<Maximum> TargetSearch::find_by_sample(const FoldedFrame& frame) {
  sample_.take_every(frame.size() / sampled_photons, frame);
  const std::optional<Maximum> found = find_at_level(sample_, levels_.front());
  if (!found || found->gain_nats < sure_nats()) return std::nullopt;
  peaks_.sample_best = found;
  return maximize(frame, found->track());
}

std::optional<Maximum> TargetSearch::find_in(const FoldedFrame& photons, Effort most,
                                             Effort least) {
  std::optional<Maximum> best;
  const std::size_t end = levels(most);
  for (std::size_t n = std::min(levels_of(least), end) - 1; n < end; ++n) {
    const Level& level = levels_[n];
    std::optional<Maximum> found = find_at_level(photons, level);
    if (found && (!best || found->gain_nats > best->gain_nats)) best = found;
    if (best && best->gain_nats > settled_nats()) break;
  }
  return best;
}

std::optional<Maximum> TargetSearch::find_at_level(const FoldedFrame& photons, const Level& level) {
  const Exposure exposure(photons, train_);
  std::optional<Maximum> best;
  const auto maximize_from = [&](const Spot& spot) {
    if (best && is_side_lobe(spot.line, level.grid, *best)) return;
    if (best && most_gain_nats(spot.box_gain_nats) < least_gain_nats(*best)) return;
    const Maximum fit = maximize(photons, spot.line);
    if (!best || fit.gain_nats > best->gain_nats) best = fit;
  };
  spots_.clear();
  const auto best_cells = cells(photons, level);
  const std::size_t tried = std::min(best_cells.size(), cells_tried(photons.size()));
  for (const SearchCell& cell : best_cells.first(tried)) {
    if (best &&
        (best->gain_nats - rival_nats_ > best_possible_gain(photons, cell, level.grid, exposure) ||
         is_side_lobe(cell.line, level.grid, *best))) {
      continue;
    }
    const Spot spot = zoom_into(photons, level, cell.line);
    // The maximum of a cell with a certain target comes first: most other cells then need none.
    if (spot.box_gain_nats > settled_nats()) {
      maximize_from(spot);
    } else {
      spots_.push_back(spot);
    }
  }
  std::sort(spots_.begin(), spots_.end(),
            [](const Spot& a, const Spot& b) { return a.box_gain_nats > b.box_gain_nats; });
  for (const Spot& spot : spots_) maximize_from(spot);
  if (best && has_side_lobes() && best->gain_nats > threshold_nats_) {
    recheck_delay(photons, level, *best);
  }
  return best;
}

TargetSearch::Spot TargetSearch::zoom_into(const FoldedFrame& photons, const Level& level,
                                           DelayTrack line, bool is_cell, double step_ns,
                                           int steps) {
  // The search sees where the photons are, and a pulse may have its peak beside its time. A delay
  // outside the circle is brought back, as it would put the photons into the wrong segment.
  if (is_cell) line.delay_ns -= shape_.peak_offset_ns();
  line.delay_ns -= train_.circle_ns * std::floor(line.delay_ns / train_.circle_ns);
  near_.collect(photons, level.windows, train_, line);
  if (steps > 0) near_.straighten(-steps * step_ns);
  ZoomResult best;
  Spot spot = {line};
  for (int step = -steps; step <= steps; ++step) {
    const ZoomResult zoomed = zoom_.find(near_, level.reach_ns, moving_);
    if (step < steps) near_.straighten(step_ns);
    if (zoomed.count <= best.count) continue;
    best = zoomed;
    spot.line = zoomed.line;
    spot.line.quadratic_ns = step * step_ns;
  }
  spot.box_gain_nats = box_gain_nats(photons, best.count, best.box_ns);
  spot.signal_photons = signal_photons(photons, best.box_ns, best.count);
  return spot;
}

double TargetSearch::signal_photons(const FoldedFrame& photons, double bin_ns,
                                    std::uint32_t count) const {
  return count - static_cast<double>(photons.size()) * train_.pulses_per_ns * bin_ns;
}

// The gain of a box pulse: the log-likelihood ratio for a box that holds `count` photons where the
// background has `expected` of them.
double TargetSearch::box_gain_nats(const FoldedFrame& photons, std::uint32_t count,
                                   double box_ns) const {
  const double all = static_cast<double>(photons.size());
  const double expected = all * train_.pulses_per_ns * box_ns;
  const double n = count;
  return n > expected ? n * std::log(n / expected) - (n - expected) : 0.0;
}

// The least gain that is worth a maximum beside the best peak so far: that of a peak which may be
// better, or, where the best peak is significant, of one which counts against its range.
double TargetSearch::least_gain_nats(const Maximum& best) const {
  return best.gain_nats < threshold_nats_ ? threshold_nats_ : best.gain_nats - rival_nats_;
}

Maximum TargetSearch::maximize(const FoldedFrame& photons, DelayTrack line, double to_beat_nats) {
  maximizer_.begin(photons);
  Maximum fit = maximizer_.maximize(likelihood::model_of(line), {free_, to_beat_nats});
  peaks_.odds.add(fit);
  return fit;
}

Maximum TargetSearch::fit_near(const FoldedFrame& photons, const Level& level, DelayTrack line,
                               double to_beat_nats) {
  return maximize(photons, zoom_into(photons, level, line, false).line, to_beat_nats);
}

// Tries the side lobes: delays at which half of an interleaved comb's pulses fall on others, or all
// of a nearly even comb, but not quite. Each that is no better counts against the best one's range.
void TargetSearch::recheck_delay(const FoldedFrame& photons, const Level& level, Maximum& best) {
  const DelayTrack found = best.track();
  for (const DelayCell& cell : search_.best_delays(photons, found.walk_ns, recheck_)) {
    const double apart =
        std::remainder(cell.delay_ns - shape_.peak_offset_ns() - found.delay_ns, train_.circle_ns);
    const double gain = box_gain_nats(photons, cell.with_neighbour, 2 * recheck_.bin_ns);
    if (std::abs(apart) <= 3 * recheck_.bin_ns) {
      // This is the best peak itself.
    } else if (most_gain_nats(gain) > best.gain_nats - rival_nats_) {
      try_delay(photons, level, apart, found, best);
    } else {
      peaks_.odds.add({found.delay_ns + apart, found.walk_ns}, gain);
    }
  }
  try_side_lobes(photons, level, best);
}

// Tries the strong side lobes of the best peak, and those of one that is better.
void TargetSearch::try_side_lobes(const FoldedFrame& photons, const Level& level, Maximum& best) {
  constexpr int most_steps = 8;
  for (int step = 0; step < most_steps; ++step) {
    const double before = best.gain_nats;
    const DelayTrack from = best.track();
    for (const double copy : side_lobes_ns_) try_delay(photons, level, copy, from, best);
    if (best.gain_nats == before) return;
  }
}

// Takes the maximum there where it is better.
void TargetSearch::try_delay(const FoldedFrame& photons, const Level& level, double shift_ns,
                             DelayTrack from, Maximum& best) {
  const Maximum fit = fit_near(photons, level, {from.delay_ns + shift_ns, from.walk_ns},
                               best.gain_nats - no_doubt_nats);
  if (fit.gain_nats > best.gain_nats) best = fit;
}

// The gain that no fit in a cell of so many photons exceeds. It takes all photons beyond the
// background's mean, and three deviations more, as signal, and allows for three neighbouring cells
// with as many.
double TargetSearch::best_possible_gain(const FoldedFrame& photons, const SearchCell& cell,
                                        const SearchGrid& grid, const Exposure& exposure) const {
  const double all = static_cast<double>(photons.size());
  const double mean = all * train_.pulses_per_ns * grid.bin_ns;
  const double signal = 4 * (std::max(0.0, cell.count - mean) + 3 * std::sqrt(mean));
  const double peak_density = std::exp(shape_.log_h(shape_.peak_offset_ns()));
  const double background = all / exposure.seen_ns;
  return signal * std::log1p(signal / exposure.amplitude * peak_density / background);
}

// Whether a line may be a side lobe of the best peak, which has the range walk of the peak.
// recheck_delay() looks at all of these delays at once.
bool TargetSearch::is_side_lobe(DelayTrack line, const SearchGrid& grid,
                                const Maximum& best) const {
  return best.gain_nats > sure_nats() &&
         std::abs(line.walk_ns - best.track().walk_ns) < 2.2 * grid.bin_ns;
}

std::size_t TargetSearch::levels(Effort most) const {
  return std::min(levels_.size(), levels_of(most));
}

std::span<const SearchCell> TargetSearch::cells(const FoldedFrame& photons, const Level& level) {
  return search_.run(photons, level.grid, max_slope_ * photons.length_ns);
}

Maximum TargetSearch::fit(const FoldedFrame& frame, const DelayTrack& line,
                          std::size_t track_terms) {
  maximizer_.begin(frame);
  return maximizer_.maximize(likelihood::model_of(line), {likelihood::free_set(1, track_terms)});
}

Maximum TargetSearch::judge(const FoldedFrame& frame, const likelihood::Model& at) {
  maximizer_.begin(frame);
  return maximizer_.judge(at, free_);
}

Maximum TargetSearch::find_near(const FoldedFrame& frame, DelayTrack line) {
  begin();
  return fit_near(frame, levels_.front(), line);
}

Maximum TargetSearch::look_beside(const FoldedFrame& frame, const Maximum& fit) {
  Maximum best = fit;
  if (has_side_lobes()) recheck_delay(frame, levels_.front(), best);
  return best;
}

std::optional<double> TargetSearch::range_odds_in(const FoldedFrame& rest, const Maximum& fit) {
  begin();
  peaks_.odds.add(fit);
  const Maximum best = look_beside(rest, fit);
  if (best.gain_nats > fit.gain_nats) return std::nullopt;
  return peaks_.odds.of(fit);
}

double TargetSearch::range_odds_nats(const Maximum& fit) const {
  const double odds_nats = peaks_.range_odds_nats(fit, {});
  return odds_nats > 0 && is_where_combs_meet(fit) ? 0 : odds_nats;
}

// Design note: a place where two combs meet has a half of the photons of each target. It is higher
// than the brighter of the two, by chance, only where their photons differ by some deviations. The
// combs of two side lobes meet at the target itself, but share its photons: one of the two gains
// half of what it does at most.
bool TargetSearch::is_where_combs_meet(const Maximum& fit) const {
  constexpr auto S = static_cast<Eigen::Index>(likelihood::signal);
  const double deviation = std::sqrt(fit.covariance(S, S)) / fit.signal_per_pulse();
  const double least_nats =
      fit.gain_nats * std::max(strong_side_lobe, 1 - unlikely_deviations * deviation);
  std::array<DelayTrack, 4> seen = {fit.track()};
  for (std::size_t count = 1; count < seen.size(); ++count) {
    const auto known = std::span(seen).first(count);
    const std::optional<RangeOdds::Place> place = peaks_.odds.best_beside(known);
    if (!place || place->gain_nats < least_nats) return false;
    seen.at(count) = place->line;
    for (std::size_t k = 1; k < count; ++k) {
      if (meetings_.do_meet(place->line.delay_ns, seen.at(k).delay_ns, fit.track().delay_ns)) {
        return true;
      }
    }
  }
  return false;
}

double TargetSearch::Peaks::range_odds_nats(const Maximum& fit,
                                            std::span<const DelayTrack> others) const {
  const double of_all = odds.of(fit, others);
  return sample_best ? std::min(odds.of(*sample_best, others), of_all) : of_all;
}

}  // namespace splid
