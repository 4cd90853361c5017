#include "estimator/frame_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "estimator/fit/pattern_check.hpp"
#include "estimator/fit/range_odds.hpp"
#include "estimator/fit/significance.hpp"
#include "estimator/fold/folded_frame.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"
#include "estimator/model/units.hpp"
#include "estimator/paper/paper_method.hpp"
#include "estimator/search/target_search.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

std::unique_ptr<PulseShape> make_shape(const Pattern& pattern, const PulseOptions& options) {
  if (options.shape == Shape::gaussian) return make_gaussian(options.sigma_ps * ns_per_ps);
  if (!pattern.pulse) {
    throw Error(Fault::usage,
                "pulse.shape is tabulated, but the pattern file has no pulse block; calibrate the "
                "pattern or use pulse.shape gaussian");
  }
  return make_tabulated(*pattern.pulse);
}

// g t_a: how far the delay travels over a frame of this length, for a target at this speed.
double travel_of(double velocity_mps, double length_ns) {
  const double beta = velocity_mps / speed_of_light_mps;
  return 2 * beta / (1 + beta) * length_ns;
}

// A target that is followed gains about as much in each frame. Half of that gain is asked for: it
// leaves room for a target that fades or speeds up, and is more than a wrong delay gains at which
// half of an interleaved comb falls on itself.
constexpr double least_followed_gain = 0.5;
constexpr int most_followed = 20;

// Design note: a look at all delays costs as much as everything else in a followed frame. The odds
// of the frame's range grow as its gain does, at the odds for each nat of gain that the last
// searched frame had. Where the odds expected so are above 40 nats, far above those of a risk of
// 1e-8, the look is left out.
constexpr double sure_odds_nats = 40;
constexpr double longest_gap_ps = 1e12;

}  // namespace

struct FrameEstimator::Workspace {
  ClockReference reference;
  PulseTrain train;
  Mode mode;
  double unambiguous_ns;
  std::unique_ptr<PulseShape> shape;
  SceneOptions scene;
  double max_travel_ns;  // over a frame of nominal length
  double threshold_nats;
  double least_odds_nats;  // that a range needs to be taken as known
  FoldedFrame frame;
  TargetSearch search;
  PatternCheck pattern_check;
  std::unique_ptr<paper::PaperMethod> by_paper;  // null: method search

  Workspace(const Pattern& pattern, const PulseOptions& pulse, const SceneOptions& scene_options,
            const EstimatorOptions& options, double frame_length_ms, std::size_t max_photons,
            ClockReference clock_reference)
      : reference(clock_reference),
        train(pattern),
        mode(pattern.mode),
        unambiguous_ns(pattern.unambiguous_delay_ps * ns_per_ps),
        shape(make_shape(pattern, pulse)),
        scene(scene_options),
        max_travel_ns(moving() ? travel_of(scene.max_speed_mps, frame_length_ms * 1e6) : 0),
        threshold_nats(significance_threshold_nats(
            {train.circle_ns, travel_looked_at_ns(), shape->width_ns()}, options.false_alarm_rate)),
        least_odds_nats(odds_at_risk_nats(options.range_risk)),
        frame(
            train, max_photons,
            max_travel_ns / 2 + std::max(std::abs(shape->first_ns()), std::abs(shape->last_ns()))),
        search(train, *shape,
               {frame_length_ms * 1e6,
                max_travel_ns,
                threshold_nats,
                {told_apart_ns(), max_travel_ns, shape->width_ns()},
                least_odds_nats,
                options.effort,
                mode != Mode::ambiguous},
               max_photons),
        pattern_check(train, *shape, frame.reach_ns()) {
    if (options.method == Method::paper) {
      by_paper = std::make_unique<paper::PaperMethod>(pattern, *shape, scene);
    }
  }

  [[nodiscard]] bool moving() const {
    return scene.motion != Motion::static_target && scene.max_speed_mps > 0;
  }

  // The circle that delays are told apart on: equal delays modulo this are the same.
  [[nodiscard]] double told_apart_ns() const {
    return mode == Mode::ambiguous ? unambiguous_ns : train.circle_ns;
  }

  // From a delay in the pattern's clock to that delay in the clock that is taken to be right.
  [[nodiscard]] double to_reference() const {
    return reference == ClockReference::tagger ? frame.scale : 1;
  }

  // How far a delay that is looked at may travel. Fits are not held to the speeds that the search
  // starts from: in a frame so short that the fastest target travels a few pulse widths, much of
  // the plane that is looked at lies beyond the largest speed.
  [[nodiscard]] double travel_looked_at_ns() const {
    return moving() ? max_travel_ns + 2 * TargetSearch::least_reach_widths * shape->width_ns() : 0;
  }

  std::optional<Fit> find(const FrameView& view, TargetTrack* track, Effort most);
  std::optional<Fit> follow(const TargetTrack& track, std::int64_t mid_ps);
  [[nodiscard]] double range_odds_nats(const Fit& fit, const TargetTrack* track) const;
  std::optional<Fit> find_as_paper(const FrameView& view);
  Fit drop_motion_unless_seen(const Fit& moving_fit);
  bool moves_after_all(const Fit& still_fit);
  void fill(Estimate& estimate, const Fit& fit, const SyncFit& sync) const;
  void remember(const FrameView& view, const Estimate& estimate, TargetTrack& track) const;
};

std::optional<Fit> FrameEstimator::Workspace::find(const FrameView& view, TargetTrack* track,
                                                   Effort most) {
  if (by_paper) return find_as_paper(view);
  const std::int64_t mid_ps = view.start_ps + (view.end_ps - view.start_ps) / 2;
  std::optional<Fit> fit;
  if (track != nullptr) {
    fit = follow(*track, mid_ps);
    track->followed = fit ? track->followed + 1 : 0;
  }
  return fit ? fit : search.find(frame, most);
}

std::optional<Fit> FrameEstimator::Workspace::follow(const TargetTrack& track,
                                                     std::int64_t mid_ps) {
  const auto gap_ps = static_cast<double>(mid_ps - track.mid_ps);
  if (!track.valid || track.followed >= most_followed || std::abs(gap_ps) > longest_gap_ps) {
    return std::nullopt;
  }
  const double beta = track.velocity_mps / speed_of_light_mps;
  const double delay_ns = track.delay_ns + 2 * beta * gap_ps * ns_per_ps;
  Fit fit = search.find_near(frame, {delay_ns / to_reference() / (1 + beta),
                                     travel_of(track.velocity_mps, frame.length_ns)});
  const double least =
      std::max(least_followed_gain * track.nats_per_ns * frame.seen_ns, threshold_nats + 6);
  if (fit.gain_nats < least || !fit.has_covariance) return std::nullopt;
  if (track.odds_per_nat * fit.gain_nats < sure_odds_nats) fit = search.look_beside(frame, fit);
  return fit;
}

double FrameEstimator::Workspace::range_odds_nats(const Fit& fit, const TargetTrack* track) const {
  const double odds = search.range_odds_nats(fit);
  if (track == nullptr || track->followed == 0) return odds;
  const double expected = track->odds_per_nat * fit.gain_nats;
  return expected < sure_odds_nats ? odds : std::min(odds, expected);
}

// The result of [P]'s method is judged as a result of the search is: by the same likelihood, with
// the same deviations and the same threshold. The search runs too, for the odds of the range.
std::optional<Fit> FrameEstimator::Workspace::find_as_paper(const FrameView& view) {
  search.find(frame);  // the other peaks of this frame, for the odds
  const paper::PaperResult found = by_paper->estimate(view);
  if (!found.found) return std::nullopt;
  const double beta = found.velocity_mps / speed_of_light_mps;
  const DelayLine line = {found.delay_ns / frame.scale / (1 + beta),
                          travel_of(found.velocity_mps, frame.length_ns)};
  return search.judge(frame, {line, found.signal_per_pulse, found.background_per_ns});
}

// Scene `auto`: the target is at rest unless the photons say at 3 standard deviations that it
// moves. That is a gain of 4.5 nats.
Fit FrameEstimator::Workspace::drop_motion_unless_seen(const Fit& moving_fit) {
  constexpr double nats_for_motion = 4.5;
  const double off_ns = std::abs(moving_fit.parameters.line.travel_ns);
  if (off_ns > 20 * shape->width_ns()) return moving_fit;
  const Fit fit = search.fit_at_rest(frame, moving_fit.parameters.line.delay_ns);
  return moving_fit.gain_nats - fit.gain_nats < nats_for_motion ? fit : moving_fit;
}

// Scene `static`, but the photons say that the target moves: the deviations of a fit at rest would
// then be far too small. 10 nats are 4.5 standard deviations of velocity, which a target at rest
// shows in 7 frames of a million.
bool FrameEstimator::Workspace::moves_after_all(const Fit& still_fit) {
  constexpr double nats_for_motion = 10;
  return search.fit_moving(frame, still_fit.parameters.line).gain_nats >
         still_fit.gain_nats + nats_for_motion;
}

void FrameEstimator::Workspace::fill(Estimate& estimate, const Fit& fit,
                                     const SyncFit& sync) const {
  const FrameParameters& p = fit.parameters;
  const double g = p.line.travel_ns / frame.length_ns;
  const double beta = g / (2 - g);
  // tau = D (1 + beta) in the pattern's clock; times `scale` it is in the tagger's clock.
  const double scale = to_reference();
  const double circle_ns = told_apart_ns();
  const auto wrap = [](double delay, double circle) {
    const double turned = delay - circle * std::floor(delay / circle);
    return turned < circle ? turned : 0.0;
  };
  // Where delays repeat, the search may end at any copy of the delay, so the delay is folded before
  // it is turned into tau: a copy k circles on would otherwise come out k beta circles further.
  const double delay_ns = wrap(p.line.delay_ns, circle_ns);
  estimate.has_values = true;
  estimate.velocity_mps = beta * speed_of_light_mps;
  estimate.delay_ns = wrap(delay_ns * (1 + beta), circle_ns) * scale;
  estimate.delay_start_ns = wrap(delay_ns * (1 + beta) - beta * frame.length_ns, circle_ns) * scale;
  estimate.signal_per_pulse = p.signal_per_pulse;
  estimate.background_per_ns = p.background_per_ns;
  estimate.significance_nats = fit.gain_nats;
  estimate.stop = fit.stop;
  if (!fit.has_covariance) return;
  // d beta / d travel = 2 / ((2 - g)^2 t_a).
  const double per_travel = 2 / ((2 - g) * (2 - g) * frame.length_ns);
  const auto& C = fit.covariance;
  const double a = 1 + beta;
  const double c = delay_ns * per_travel;
  const double variance = a * a * C(0, 0) + 2 * a * c * C(0, 1) + c * c * C(1, 1);
  // What the syncs leave uncertain of the pattern's clock adds to both deviations: an error of the
  // clock's phase is an error of the delay, and an error of its period is an error of the velocity
  // (with 10 ps of sync jitter in 50 ms 4.2 cm/s by endpoints, 0.09 cm/s by regression).
  estimate.std_delay_ns =
      std::hypot(std::sqrt(std::max(0.0, variance)) * scale, sync.std_phase_ps * ns_per_ps);
  if (C(1, 1) > 0) {
    estimate.std_velocity_mps =
        speed_of_light_mps *
        std::hypot(std::sqrt(C(1, 1)) * per_travel, sync.std_period_ps / sync.period_ps / 2);
  }
  estimate.std_signal_per_pulse = std::sqrt(C(2, 2));
  estimate.std_background_per_ns = std::sqrt(C(3, 3));
}

void FrameEstimator::Workspace::remember(const FrameView& view, const Estimate& estimate,
                                         TargetTrack& track) const {
  // A range that may be wrong is not followed: the next frame is then searched over all delays.
  track.valid = estimate.range_odds_nats >= least_odds_nats;
  track.mid_ps = view.start_ps + (view.end_ps - view.start_ps) / 2;
  track.delay_ns = estimate.delay_ns;
  track.velocity_mps = estimate.velocity_mps;
  if (track.followed > 0) return;
  track.nats_per_ns = estimate.significance_nats / frame.seen_ns;
  track.odds_per_nat = estimate.range_odds_nats / estimate.significance_nats;
}

FrameEstimator::FrameEstimator(const Pattern& pattern, const PulseOptions& pulse,
                               const SceneOptions& scene, const EstimatorOptions& options,
                               double frame_length_ms, std::size_t max_photons,
                               ClockReference reference)
    : workspace_(std::make_unique<Workspace>(pattern, pulse, scene, options, frame_length_ms,
                                             max_photons, reference)) {}

FrameEstimator::~FrameEstimator() = default;
FrameEstimator::FrameEstimator(FrameEstimator&&) noexcept = default;

Estimate FrameEstimator::estimate(const FrameView& view, TargetTrack* track, Effort most) {
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
  std::optional<Fit> fit = w.find(view, track, most);
  if (!fit) return estimate;
  estimate.significance_nats = fit->gain_nats;
  if (fit->gain_nats < w.threshold_nats || !fit->has_covariance) return estimate;
  estimate.range_odds_nats = w.range_odds_nats(*fit, track);
  if (w.moving() && w.scene.motion == Motion::automatic) {
    fit = w.drop_motion_unless_seen(*fit);
    if (!fit->has_covariance) return estimate;
  }
  if (!w.moving() && w.moves_after_all(*fit)) return estimate;
  const PatternVerdict pattern = w.pattern_check.judge(w.frame, fit->parameters);
  estimate.pattern_fault = pattern.fault;
  if (pattern.fault != PatternFault::none) return estimate;
  w.fill(estimate, *fit, view.sync);
  estimate.amplitude_misfit = pattern.amplitude_misfit;
  const bool is_sure = estimate.range_odds_nats >= w.least_odds_nats;
  estimate.status =
      w.mode == Mode::ambiguous || !is_sure ? FrameStatus::ambiguous : FrameStatus::ok;
  if (track != nullptr) w.remember(view, estimate, *track);
  return estimate;
}

}  // namespace splid
