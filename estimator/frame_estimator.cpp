#include "estimator/frame_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "estimator/folded_frame.hpp"
#include "estimator/likelihood.hpp"
#include "estimator/line_search.hpp"
#include "estimator/pulse_shape.hpp"
#include "estimator/pulse_train.hpp"
#include "estimator/refinement.hpp"
#include "estimator/search_dispatch.hpp"
#include "estimator/significance.hpp"
#include "estimator/units.hpp"
#include "estimator/zoom.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

// Design note: measured in the trial of the search: bins of 10, 5 and 2.5 pulse widths find a
// target of 1/7, 1/9 and less of [P]'s signal in [P]'s background without a wrong peak. A level is
// only looked at when the one before it found nothing significant.
constexpr double level_widths[] = {10, 5, 2.5};
constexpr std::size_t level_cells[] = {std::size_t{1} << 18, std::size_t{1} << 20,
                                       std::size_t{1} << 22};

// A gain this far above the threshold ends the search: e^-6 of the false-alarm rate.
constexpr double settled_margin_nats = 6;

std::size_t levels_of(Effort effort) { return static_cast<std::size_t>(effort) + 1; }

std::unique_ptr<PulseShape> make_shape(const Pattern& pattern, const PulseOptions& options) {
  if (options.shape == Shape::gaussian) return make_gaussian(options.sigma_ps * ns_per_ps);
  if (!pattern.pulse) {
    throw Error(Fault::usage,
                "pulse.shape is tabulated, but the pattern file has no pulse block; calibrate the "
                "pattern or use pulse.shape gaussian");
  }
  return make_tabulated(*pattern.pulse);
}

// g t_a, the drift of the delay over a frame of a target at this speed.
double drift_of(double velocity_mps, double length_ns) {
  const double beta = velocity_mps / speed_of_light_mps;
  return 2 * beta / (1 + beta) * length_ns;
}

SearchGrid level_grid(const PulseTrain& train, double width_ns, std::size_t level,
                      double max_drift_ns, std::uint32_t fitting_bins) {
  // Wider than half the pulses' spacing, a cell would take a pulse's neighbour for the pulse; but
  // pulses that overlap are one to the search.
  const double widest_ns = std::max(train.closest_ns / 2, level_widths[2] * width_ns);
  double bin_ns = std::min(widest_ns, level_widths[level] * width_ns);
  while (true) {
    const SearchGrid grid = SearchGrid::cover(train.circle_ns, bin_ns, max_drift_ns, fitting_bins);
    if (grid.cells() <= level_cells[level] || bin_ns >= widest_ns) return grid;
    bin_ns = std::min(widest_ns, bin_ns * 1.25);
  }
}

}  // namespace

// One way of looking: its grid, and the window that a zoom into one of its cells needs.
struct SearchLevel {
  SearchGrid grid;
  double reach_ns;
  std::vector<CombWindow> windows;  // one a stretch

  SearchLevel(const PulseTrain& train, const SearchGrid& grid_in, double width_ns, double peak_ns)
      : grid(grid_in),
        reach_ns(1.5 * grid_in.bin_ns),
        windows(comb_windows(train, peak_ns - 2 * reach_ns - 4 * width_ns,
                             peak_ns + 2 * reach_ns + 4 * width_ns)) {}
};

struct FrameEstimator::Workspace {
  PulseTrain train;
  Mode mode;
  double unambiguous_ns;
  std::unique_ptr<PulseShape> shape;
  SceneOptions scene;
  double max_drift_ns;  // over a frame of nominal length
  double threshold_nats;
  std::vector<SearchLevel> levels;
  SearchGrid recheck;             // three widths: a pulse fills one or two bins
  std::vector<double> copies_ns;  // see near_copies_ns
  FoldedFrame frame;
  LineSearch search;
  NearSet near;
  Zoom zoom;
  Refinement refinement;

  Workspace(const Pattern& pattern, const PulseOptions& pulse, const SceneOptions& scene_options,
            const EstimatorOptions& options, double frame_length_ms, std::size_t max_photons)
      : train(pattern),
        mode(pattern.mode),
        unambiguous_ns(pattern.unambiguous_delay_ps * ns_per_ps),
        shape(make_shape(pattern, pulse)),
        scene(scene_options),
        max_drift_ns(moving() ? drift_of(scene.max_speed_mps, frame_length_ms * 1e6) : 0),
        threshold_nats(significance_threshold_nats(
            {train.circle_ns, max_drift_ns, shape->width_ns()}, options.false_alarm_rate)),
        levels(make_levels(options.effort)),
        recheck(SearchGrid::cover(train.circle_ns,
                                  std::max(3 * shape->width_ns(), train.circle_ns / 262144), 0,
                                  fitting_bins())),
        copies_ns(mode == Mode::ambiguous || !train.single()
                      ? std::vector<double>()
                      : near_copies_ns(train.stretches.front().comb, 3 * shape->width_ns())),
        frame(train, max_photons, max_drift_ns / 2 + shape_reach_ns()),
        search(train, max_photons, grids()),
        near(max_photons, max_photons * widest_level_overlap()),
        zoom(shape->width_ns(), shape->peak_offset_ns()),
        refinement(*shape, train, max_photons) {}

  [[nodiscard]] bool moving() const {
    return scene.motion != Motion::static_target && scene.max_speed_mps > 0;
  }

  [[nodiscard]] std::vector<SearchLevel> make_levels(Effort effort) const {
    std::vector<SearchLevel> made;
    // At rest the finest level is a single row of bins: nothing is gained by a coarser one.
    const std::size_t first = moving() ? 0 : std::size(level_widths) - 1;
    const std::size_t end = moving() ? levels_of(effort) : std::size(level_widths);
    for (std::size_t level = first; level < end; ++level) {
      const SearchGrid grid =
          level_grid(train, shape->width_ns(), level, max_drift_ns, fitting_bins());
      if (!made.empty() && grid.cells() == made.back().grid.cells()) continue;
      made.emplace_back(train, grid, shape->width_ns(), shape->peak_offset_ns());
    }
    return made;
  }

  // A comb of several pulses, or of several periods, fits itself in part at other delays.
  [[nodiscard]] bool has_shoulders() const {
    return !train.single() || train.stretches.front().comb.times_ns.size() > 1;
  }
  [[nodiscard]] double pulses_per_ns() const {
    double pulses = 0;
    for (const PulseTrain::Stretch& stretch : train.stretches) {
      pulses += static_cast<double>(stretch.comb.times_ns.size()) / stretch.comb.period_ns *
                (stretch.end_ns - stretch.begin_ns);
    }
    return pulses / train.period_ns;
  }
  [[nodiscard]] std::uint32_t fitting_bins() const {
    return CombRows(train, 0, best_search_kernels()).fitting_bins();
  }
  [[nodiscard]] double shape_reach_ns() const {
    return std::max(std::abs(shape->first_ns()), std::abs(shape->last_ns()));
  }
  [[nodiscard]] std::vector<SearchGrid> grids() const {
    std::vector<SearchGrid> all = {recheck};
    for (const SearchLevel& level : levels) all.push_back(level.grid);
    return all;
  }
  [[nodiscard]] std::size_t widest_level_overlap() const {
    std::size_t overlap = 1;
    for (const SearchLevel& level : levels) {
      overlap = std::max(overlap, widest_overlap(level.windows));
    }
    return overlap;
  }

  std::optional<Fit> find_target();
  std::optional<Fit> find_at_level(const SearchLevel& level);
  Fit fit_cell(const SearchLevel& level, const Exposure& exposure, DelayLine line);
  void recheck_delay(const SearchLevel& level, const Exposure& exposure, Fit& best);
  void try_delay(const SearchLevel& level, const Exposure& exposure, double shift_ns,
                 DelayLine from, Fit& best);
  [[nodiscard]] double best_possible_gain(const SearchCell& cell, const SearchGrid& grid,
                                          const Exposure& exposure) const;
  [[nodiscard]] bool is_shoulder(const SearchCell& cell, const SearchGrid& grid,
                                 const Fit& best) const;
  Fit drop_motion_unless_seen(const Fit& moving_fit);
  void fill(Estimate& estimate, const Fit& fit, const SyncFit& sync) const;
};

std::optional<Fit> FrameEstimator::Workspace::find_target() {
  std::optional<Fit> best;
  for (const SearchLevel& level : levels) {
    const std::optional<Fit> found = find_at_level(level);
    if (found && (!best || found->gain_nats > best->gain_nats)) best = found;
    if (best && best->gain_nats > threshold_nats + settled_margin_nats) break;
  }
  return best;
}

std::optional<Fit> FrameEstimator::Workspace::find_at_level(const SearchLevel& level) {
  const Exposure exposure(frame, train);
  const double limit_ns = moving() ? drift_of(scene.max_speed_mps, frame.length_ns) : 0;
  std::optional<Fit> best;
  for (const SearchCell& cell : search.run(frame, level.grid, limit_ns)) {
    if (best && (best->gain_nats > best_possible_gain(cell, level.grid, exposure) ||
                 is_shoulder(cell, level.grid, *best))) {
      continue;
    }
    const Fit fit = fit_cell(level, exposure, cell.line);
    if (!best || fit.gain_nats > best->gain_nats) best = fit;
  }
  if (best && has_shoulders()) recheck_delay(level, exposure, *best);
  return best;
}

Fit FrameEstimator::Workspace::fit_cell(const SearchLevel& level, const Exposure& exposure,
                                        DelayLine line) {
  // The search sees where the photons are; a pulse may have its peak beside its time.
  line.delay_ns -= shape->peak_offset_ns();
  near.collect(frame, level.windows, train, line);
  return refinement.climb(frame, exposure, zoom.find(near, level.reach_ns, moving()), moving());
}

// A comb fits itself in part at other delays: an interleaved one by half of its pulses, a nearly
// even one by all of them and not quite. Where the best cell was such a shoulder, the peak has the
// same drift.
void FrameEstimator::Workspace::recheck_delay(const SearchLevel& level, const Exposure& exposure,
                                              Fit& best) {
  const DelayLine found = best.parameters.line;
  const DelayLine most = search.best_delay(frame, found.drift_ns, recheck).line;
  const double apart =
      std::remainder(most.delay_ns - shape->peak_offset_ns() - found.delay_ns, train.circle_ns);
  if (std::abs(apart) > 3 * recheck.bin_ns) try_delay(level, exposure, apart, found, best);
  for (const double copy : copies_ns) try_delay(level, exposure, copy, found, best);
}

void FrameEstimator::Workspace::try_delay(const SearchLevel& level, const Exposure& exposure,
                                          double shift_ns, DelayLine from, Fit& best) {
  const double photons_at = from.delay_ns + shift_ns + shape->peak_offset_ns();
  const Fit fit = fit_cell(level, exposure, {photons_at, from.drift_ns});
  if (fit.gain_nats > best.gain_nats) best = fit;
}

// A target that is surely there shows at the delays where its comb fits itself in part, with its
// own drift. recheck_delay() looks at all of those at once.
bool FrameEstimator::Workspace::is_shoulder(const SearchCell& cell, const SearchGrid& grid,
                                            const Fit& best) const {
  return best.gain_nats > threshold_nats + settled_margin_nats &&
         std::abs(cell.line.drift_ns - best.parameters.line.drift_ns) < 2.2 * grid.bin_ns;
}

// No fit in a cell of so many photons gains more, even if all those beyond the background's mean
// (and three deviations) are signal, in this cell and in three neighbours that share it.
double FrameEstimator::Workspace::best_possible_gain(const SearchCell& cell, const SearchGrid& grid,
                                                     const Exposure& exposure) const {
  const double photons = static_cast<double>(frame.size());
  const double mean = photons * pulses_per_ns() * grid.bin_ns;
  const double signal = 4 * (std::max(0.0, cell.count - mean) + 3 * std::sqrt(mean));
  const double peak_density = std::exp(shape->log_h(shape->peak_offset_ns()));
  const double background = photons / exposure.seen_ns;
  return signal * std::log1p(signal / exposure.amplitude * peak_density / background);
}

// The target is at rest unless the photons say otherwise at 3 standard deviations: 4.5 nats.
Fit FrameEstimator::Workspace::drop_motion_unless_seen(const Fit& moving_fit) {
  constexpr double nats_for_motion = 4.5;
  const DelayLine still = {moving_fit.parameters.line.delay_ns, 0};
  const double off_ns = std::abs(moving_fit.parameters.line.drift_ns);
  if (off_ns > 20 * shape->width_ns()) return moving_fit;
  const Fit fit = refinement.climb(frame, Exposure(frame, train), still, false);
  return moving_fit.gain_nats - fit.gain_nats < nats_for_motion ? fit : moving_fit;
}

void FrameEstimator::Workspace::fill(Estimate& estimate, const Fit& fit,
                                     const SyncFit& sync) const {
  const FrameParameters& p = fit.parameters;
  const double g = p.line.drift_ns / frame.length_ns;
  const double beta = g / (2 - g);
  // tau = D (1 + beta); the clock of the pattern becomes the tagger's by `scale`.
  const double circle_ns = (mode == Mode::ambiguous ? unambiguous_ns : train.circle_ns);
  const auto wrap = [](double delay, double circle) {
    const double turned = delay - circle * std::floor(delay / circle);
    return turned < circle ? turned : 0.0;
  };
  estimate.has_values = true;
  estimate.velocity_mps = beta * speed_of_light_mps;
  estimate.delay_ns = wrap(p.line.delay_ns * (1 + beta), circle_ns) * frame.scale;
  estimate.delay_start_ns =
      wrap(p.line.delay_ns * (1 + beta) - beta * frame.length_ns, circle_ns) * frame.scale;
  estimate.signal_per_pulse = p.signal_per_pulse;
  estimate.background_per_ns = p.background_per_ns;
  estimate.significance_nats = fit.gain_nats;
  estimate.stop = fit.stop;
  if (!fit.has_covariance) return;
  // d beta / d drift = 2 / ((2 - g)^2 t_a).
  const double per_drift = 2 / ((2 - g) * (2 - g) * frame.length_ns);
  const auto& C = fit.covariance;
  const double a = 1 + beta;
  const double c = p.line.delay_ns * per_drift;
  const double variance = a * a * C(0, 0) + 2 * a * c * C(0, 1) + c * c * C(1, 1);
  // The pattern's clock is known no better than the syncs tell: its phase is the delay's, its
  // period a velocity (by endpoints 4.2 cm/s with 10 ps of jitter in 50 ms, by regression 0.09).
  estimate.std_delay_ns =
      std::hypot(std::sqrt(std::max(0.0, variance)) * frame.scale, sync.std_phase_ps * ns_per_ps);
  if (C(1, 1) > 0) {
    estimate.std_velocity_mps =
        speed_of_light_mps *
        std::hypot(std::sqrt(C(1, 1)) * per_drift, sync.std_period_ps / sync.period_ps / 2);
  }
  estimate.std_signal_per_pulse = std::sqrt(C(2, 2));
  estimate.std_background_per_ns = std::sqrt(C(3, 3));
}

FrameEstimator::FrameEstimator(const Pattern& pattern, const PulseOptions& pulse,
                               const SceneOptions& scene, const EstimatorOptions& options,
                               double frame_length_ms, std::size_t max_photons)
    : workspace_(std::make_unique<Workspace>(pattern, pulse, scene, options, frame_length_ms,
                                             max_photons)) {}

FrameEstimator::~FrameEstimator() = default;
FrameEstimator::FrameEstimator(FrameEstimator&&) noexcept = default;

Estimate FrameEstimator::estimate(const FrameView& view) {
  Workspace& w = *workspace_;
  Estimate estimate;
  estimate.photons = view.photons_ps.size();
  estimate.threshold_nats = w.threshold_nats;
  double seen_ns = static_cast<double>(view.end_ps - view.start_ps) * ns_per_ps;
  for (const Loss& loss : view.losses) {
    seen_ns -= static_cast<double>(loss.end_ps - loss.begin_ps) * ns_per_ps;
  }
  if (seen_ns > 0) {
    estimate.background_per_ns = static_cast<double>(estimate.photons) / seen_ns;
  }
  if (!view.sync.locked) {
    estimate.status = FrameStatus::no_sync;
    return estimate;
  }
  estimate.status = FrameStatus::no_target;
  if (estimate.photons == 0 || seen_ns <= 0) return estimate;

  w.frame.fold(view, w.train);
  std::optional<Fit> fit = w.find_target();
  if (!fit) return estimate;
  estimate.significance_nats = fit->gain_nats;
  if (fit->gain_nats < w.threshold_nats || !fit->has_covariance) return estimate;
  if (w.moving() && w.scene.motion == Motion::automatic) {
    fit = w.drop_motion_unless_seen(*fit);
    if (!fit->has_covariance) return estimate;
  }
  w.fill(estimate, *fit, view.sync);
  estimate.status = w.mode == Mode::ambiguous ? FrameStatus::ambiguous : FrameStatus::ok;
  return estimate;
}

}  // namespace splid
