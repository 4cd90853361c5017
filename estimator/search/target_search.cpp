#include "estimator/search/target_search.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "estimator/fold/vector_level.hpp"

namespace splid {
namespace {

// Design note: measured in the trial of the search: bins of 10, 5 and 2.5 pulse widths find a
// target of 1/7, 1/9 and less of [P]'s signal in [P]'s background without a wrong peak. A level is
// only looked at when the one before it found nothing significant.
constexpr double level_widths[] = {10, 5, 2.5};
constexpr std::size_t level_cells[] = {std::size_t{1} << 18, std::size_t{1} << 20,
                                       std::size_t{1} << 22};

constexpr std::size_t cheap_cells = std::size_t{1} << 16;  // a tenth of a millisecond

// A gain this far above the threshold ends the search: e^-6 of the false-alarm rate.
constexpr double settled_margin_nats = 6;

// A gain this far above it tells a target's peak from the shoulders that its comb makes, which have
// two thirds of it at most; in weaker frames every cell is tried.
constexpr double shoulder_margin_nats = 60;

// Peaks that are below the best one by so much more than the least odds do not count against it.
constexpr double rival_margin_nats = 3;

// Design note: of a million photons 65,536 are searched in 3 ms instead of 20. A target that is
// 30 nats above the threshold in them is no chance, nor taken for a shoulder of its own.
constexpr std::size_t sampled_photons = 65536;
constexpr std::size_t sampled_from = 3 * sampled_photons;
constexpr double sample_margin_nats = 30;

// Design note: few photons make many cells alike and each costs little; of 19 signal photons eight
// cells miss the best maximum in 0.03 % of frames, sixteen in none of 6,000. Of a million photons a
// zoom costs 3 ms.
std::size_t cells_tried(std::size_t photons) {
  if (photons < 4096) return LineSearch::max_cells;
  return photons < 131072 ? 8 : 4;
}

// Copies of a comb are copies of one another: each is climbed once.
constexpr std::size_t most_tried = 256;

// A maximum that has surely so much less gain than the best is left on the way up.
constexpr double left_behind_nats = 60;

std::size_t levels_of(Effort effort) { return static_cast<std::size_t>(effort) + 1; }

constexpr double most_recheck_bins = 262144;

std::uint32_t fitting_bins(const PulseTrain& train) {
  return CombRows(train, 0, best_search_kernels()).fitting_bins();
}

SearchGrid level_grid(const PulseTrain& train, double width_ns, std::size_t level,
                      double max_travel_ns) {
  // Wider than half the pulses' spacing, a cell would take a pulse's neighbour for the pulse; but
  // pulses that overlap are one to the search.
  const double widest_ns = std::max(train.closest_ns / 2, level_widths[2] * width_ns);
  const double wanted_ns = std::min(widest_ns, level_widths[level] * width_ns);
  const std::uint32_t fitting = fitting_bins(train);
  // Short frames have few cells however fine: then the finest cost nothing.
  double bin_ns = std::min(wanted_ns, level_widths[2] * width_ns);
  while (true) {
    const SearchGrid grid = SearchGrid::cover(train.circle_ns, bin_ns, max_travel_ns, fitting);
    const std::size_t most = bin_ns < wanted_ns ? cheap_cells : level_cells[level];
    if (grid.cells() <= most || bin_ns >= widest_ns) return grid;
    bin_ns = std::min(bin_ns < wanted_ns ? wanted_ns : widest_ns, bin_ns * 1.25);
  }
}

}  // namespace

TargetSearch::TargetSearch(const PulseTrain& train, const PulseShape& shape,
                           const SearchScope& scope, std::size_t max_photons)
    : train_(train),
      shape_(shape),
      threshold_nats_(scope.threshold_nats),
      rival_nats_(scope.least_odds_nats + rival_margin_nats),
      max_slope_(scope.max_travel_ns / scope.frame_length_ns),
      moving_(scope.max_travel_ns > 0),
      levels_(make_levels(scope)),
      recheck_(SearchGrid::cover(
          train.circle_ns, std::max(3 * shape.width_ns(), train.circle_ns / most_recheck_bins), 0,
          fitting_bins(train))),
      copies_ns_(scope.near_copies ? near_copies_ns(train, shape.width_ns())
                                   : std::vector<double>()),
      sample_(train, max_photons < sampled_from ? 0 : sampled_from),
      search_(train, max_photons, grids()),
      near_(max_photons, max_photons * widest_level_overlap()),
      zoom_(shape.width_ns(), shape.peak_offset_ns()),
      refinement_(shape, train, max_photons),
      odds_(scope.volume) {
  spots_.reserve(LineSearch::max_cells);
  tried_ns_.reserve(most_tried);
}

std::vector<TargetSearch::Level> TargetSearch::make_levels(const SearchScope& scope) const {
  std::vector<Level> made;
  // At rest the finest level is a single row of bins: nothing is gained by a coarser one.
  const std::size_t first = moving_ ? 0 : std::size(level_widths) - 1;
  const std::size_t end = moving_ ? levels_of(scope.effort) : std::size(level_widths);
  for (std::size_t level = first; level < end; ++level) {
    const SearchGrid grid = level_grid(train_, shape_.width_ns(), level, scope.max_travel_ns);
    if (!made.empty() && grid.cells() == made.back().grid.cells()) continue;
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

std::size_t TargetSearch::widest_level_overlap() const {
  std::size_t overlap = 1;
  for (const Level& level : levels_) overlap = std::max(overlap, widest_overlap(level.windows));
  return overlap;
}

// A comb of several pulses, or of several periods, fits itself in part at other delays.
bool TargetSearch::has_shoulders() const {
  return !train_.single() || train_.stretches.front().comb.times_ns.size() > 1;
}

std::optional<Fit> TargetSearch::find(const FoldedFrame& frame, Effort most) {
  odds_.clear();
  sample_odds_nats_.reset();
  if (frame.size() >= sampled_from) {
    if (std::optional<Fit> found = find_by_sample(frame)) return found;
  }
  return find_in(frame, most);
}

// A target that shows plainly in a part of the photons is found by that part, and refined on all.
std::optional<Fit> TargetSearch::find_by_sample(const FoldedFrame& frame) {
  sample_.take_every(frame.size() / sampled_photons, frame);
  const std::optional<Fit> found = find_at_level(sample_, levels_.front());
  if (!found || found->gain_nats < threshold_nats_ + sample_margin_nats) return std::nullopt;
  sample_odds_nats_ = odds_.of(*found);
  return climb(frame, Exposure(frame, train_), found->parameters.line);
}

std::optional<Fit> TargetSearch::find_in(const FoldedFrame& photons, Effort most) {
  std::optional<Fit> best;
  for (const Level& level : std::span(levels_).first(std::min(levels_.size(), levels_of(most)))) {
    std::optional<Fit> found = find_at_level(photons, level);
    if (found && (!best || found->gain_nats > best->gain_nats)) best = found;
    if (best && best->gain_nats > threshold_nats_ + settled_margin_nats) break;
  }
  return best;
}

std::optional<Fit> TargetSearch::find_at_level(const FoldedFrame& photons, const Level& level) {
  const Exposure exposure(photons, train_);
  const double limit_ns = max_slope_ * photons.length_ns;
  std::optional<Fit> best;
  const auto climb_from = [&](const Spot& spot) {
    if (best && (most_gain_nats(spot.box_gain_nats) < least_gain_nats(*best) ||
                 is_shoulder(spot.line, level.grid, *best))) {
      return;
    }
    const Fit fit = climb(photons, exposure, spot.line);
    if (!best || fit.gain_nats > best->gain_nats) best = fit;
  };
  spots_.clear();
  const auto cells = search_.run(photons, level.grid, limit_ns);
  for (const SearchCell& cell : cells.first(std::min(cells.size(), cells_tried(photons.size())))) {
    if (best &&
        (best->gain_nats - rival_nats_ > best_possible_gain(photons, cell, level.grid, exposure) ||
         is_shoulder(cell.line, level.grid, *best))) {
      continue;
    }
    const ZoomResult zoomed = zoom_into(photons, level, cell.line);
    const Spot spot = {zoomed.line, box_gain_nats(photons, zoomed.count, zoomed.box_ns)};
    // What is surely a target settles the other cells.
    if (spot.box_gain_nats > threshold_nats_ + settled_margin_nats) {
      climb_from(spot);
    } else {
      spots_.push_back(spot);
    }
  }
  std::sort(spots_.begin(), spots_.end(),
            [](const Spot& a, const Spot& b) { return a.box_gain_nats > b.box_gain_nats; });
  for (const Spot& spot : spots_) climb_from(spot);
  if (best && has_shoulders() && best->gain_nats > threshold_nats_) {
    recheck_delay(photons, level, exposure, *best);
  }
  return best;
}

ZoomResult TargetSearch::zoom_into(const FoldedFrame& photons, const Level& level, DelayLine line) {
  // The search sees where the photons are; a pulse may have its peak beside its time. A delay
  // beyond the circle would have photons leave in a stretch before the right one.
  line.delay_ns -= shape_.peak_offset_ns();
  line.delay_ns -= train_.circle_ns * std::floor(line.delay_ns / train_.circle_ns);
  near_.collect(photons, level.windows, train_, line);
  return zoom_.find(near_, level.reach_ns, moving_);
}

// Log-likelihood ratio of a box that counts n photons where the background has m: what a pulse that
// fills it evenly gains.
double TargetSearch::box_gain_nats(const FoldedFrame& photons, std::uint32_t count,
                                   double box_ns) const {
  const double all = static_cast<double>(photons.size());
  const double expected = all * train_.pulses_per_ns * box_ns;
  const double n = count;
  return n > expected ? n * std::log(n / expected) - (n - expected) : 0.0;
}

// Design note: a box of four widths gains 0.75 to 0.9 of what the pulse itself does; a fit that
// gains half as much again and six nats more has not been seen in 10,000 frames.
double TargetSearch::most_gain_nats(double box_gain_nats) { return 1.5 * box_gain_nats + 6; }

// What is worth a climb beside the best peak so far: a better one, or a rival of one that counts.
double TargetSearch::least_gain_nats(const Fit& best) const {
  return best.gain_nats < threshold_nats_ ? threshold_nats_ : best.gain_nats - rival_nats_;
}

Fit TargetSearch::climb(const FoldedFrame& photons, const Exposure& exposure, DelayLine line,
                        double to_beat_nats) {
  Fit fit = refinement_.climb(photons, exposure, line, moving_, to_beat_nats);
  odds_.add(fit);
  return fit;
}

Fit TargetSearch::fit_cell(const FoldedFrame& photons, const Level& level, const Exposure& exposure,
                           DelayLine line, double to_beat_nats) {
  return climb(photons, exposure, zoom_into(photons, level, line).line, to_beat_nats);
}

// A comb fits itself in part at other delays: an interleaved one by half of its pulses, a nearly
// even one by all of them and not quite. Where the best cell was such a shoulder, the peak has the
// same travel; a near copy's own copies may be better again. What is no better counts against the
// best one's range.
void TargetSearch::recheck_delay(const FoldedFrame& photons, const Level& level,
                                 const Exposure& exposure, Fit& best) {
  constexpr int most_steps = 8;
  const DelayLine found = best.parameters.line;
  tried_ns_.assign(1, found.delay_ns);
  bool is_first = true;
  for (const DelayCell& cell : search_.best_delays(photons, found.travel_ns, recheck_)) {
    const double apart =
        std::remainder(cell.delay_ns - shape_.peak_offset_ns() - found.delay_ns, train_.circle_ns);
    const double gain = box_gain_nats(photons, cell.with_neighbour, 2 * recheck_.bin_ns);
    if (std::abs(apart) <= 3 * recheck_.bin_ns) {
      // The best one itself.
    } else if (is_first || most_gain_nats(gain) > best.gain_nats - rival_nats_) {
      try_delay(photons, level, exposure, apart, found, best);
    } else {
      odds_.add({found.delay_ns + apart, found.travel_ns}, gain);
    }
    is_first = false;
  }
  for (int step = 0; step < most_steps; ++step) {
    const double before = best.gain_nats;
    const DelayLine from = best.parameters.line;
    for (const double copy : copies_ns_) try_delay(photons, level, exposure, copy, from, best);
    if (best.gain_nats == before) break;
  }
}

void TargetSearch::try_delay(const FoldedFrame& photons, const Level& level,
                             const Exposure& exposure, double shift_ns, DelayLine from, Fit& best) {
  if (is_tried(from.delay_ns + shift_ns)) return;
  const double photons_at = from.delay_ns + shift_ns + shape_.peak_offset_ns();
  const Fit fit = fit_cell(photons, level, exposure, {photons_at, from.travel_ns},
                           best.gain_nats - left_behind_nats);
  if (fit.gain_nats > best.gain_nats) best = fit;
}

// Whether a delay has been looked at since tried_ns_ was cleared, to within what a zoom settles.
bool TargetSearch::is_tried(double delay_ns) {
  const bool is = std::any_of(tried_ns_.begin(), tried_ns_.end(), [&](double tried_ns) {
    return std::abs(std::remainder(delay_ns - tried_ns, train_.circle_ns)) < shape_.width_ns();
  });
  if (!is && tried_ns_.size() < most_tried) tried_ns_.push_back(delay_ns);
  return is;
}

// No fit in a cell of so many photons gains more, even if all those beyond the background's mean
// (and three deviations) are signal, in this cell and in three neighbours that share it.
double TargetSearch::best_possible_gain(const FoldedFrame& photons, const SearchCell& cell,
                                        const SearchGrid& grid, const Exposure& exposure) const {
  const double all = static_cast<double>(photons.size());
  const double mean = all * train_.pulses_per_ns * grid.bin_ns;
  const double signal = 4 * (std::max(0.0, cell.count - mean) + 3 * std::sqrt(mean));
  const double peak_density = std::exp(shape_.log_h(shape_.peak_offset_ns()));
  const double background = all / exposure.seen_ns;
  return signal * std::log1p(signal / exposure.amplitude * peak_density / background);
}

// A target that is surely there shows at the delays where its comb fits itself in part, with its
// own travel. recheck_delay() looks at all of those at once.
bool TargetSearch::is_shoulder(DelayLine line, const SearchGrid& grid, const Fit& best) const {
  return best.gain_nats > threshold_nats_ + shoulder_margin_nats &&
         std::abs(line.travel_ns - best.parameters.line.travel_ns) < 2.2 * grid.bin_ns;
}

Fit TargetSearch::fit_at_rest(const FoldedFrame& frame, double delay_ns) {
  return refinement_.climb(frame, Exposure(frame, train_), {delay_ns, 0}, false);
}

Fit TargetSearch::fit_moving(const FoldedFrame& frame, DelayLine line) {
  return refinement_.climb(frame, Exposure(frame, train_), line, true);
}

Fit TargetSearch::judge(const FoldedFrame& frame, const FrameParameters& at) {
  return refinement_.judge(frame, Exposure(frame, train_), at, moving_);
}

Fit TargetSearch::find_near(const FoldedFrame& frame, DelayLine line) {
  odds_.clear();
  sample_odds_nats_.reset();
  line.delay_ns += shape_.peak_offset_ns();
  return fit_cell(frame, levels_.front(), Exposure(frame, train_), line);
}

Fit TargetSearch::look_beside(const FoldedFrame& frame, const Fit& fit) {
  Fit best = fit;
  if (has_shoulders()) recheck_delay(frame, levels_.front(), Exposure(frame, train_), best);
  return best;
}

double TargetSearch::range_odds_nats(const Fit& fit) const {
  const double of_all = odds_.of(fit);
  return sample_odds_nats_ ? std::min(*sample_odds_nats_, of_all) : of_all;
}

}  // namespace splid
