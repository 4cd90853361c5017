#include "estimator/frame_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "estimator/checks/detector_check.hpp"
#include "estimator/checks/input_split.hpp"
#include "estimator/checks/light_flicker.hpp"
#include "estimator/checks/pattern_check.hpp"
#include "estimator/fit/dead_time_model.hpp"
#include "estimator/fit/range_odds.hpp"
#include "estimator/fit/significance.hpp"
#include "estimator/fit/width_fit.hpp"
#include "estimator/fold/blind_time.hpp"
#include "estimator/fold/folded_frame.hpp"
#include "estimator/frame_values.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"
#include "estimator/model/units.hpp"
#include "estimator/paper/paper_method.hpp"
#include "estimator/search/bend_search.hpp"
#include "estimator/search/several_targets.hpp"
#include "estimator/search/target_search.hpp"
#include "estimator/search_memory.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

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

// Scene `auto`: how much more a path that bends must gain than the best straight one. 4.5 nats are
// three standard deviations of the acceleration.
constexpr double nats_for_acceleration = 4.5;

void refuse_if(const std::optional<OptionFault>& fault, const char* section) {
  if (fault) throw Error(Fault::usage, section + fault->pointer + ": " + fault->what);
}

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
  DetectorCheck detector_check;
  std::optional<DeadTimeModel> dead_time;        // where it is modelled
  PulseVerdict pulse_verdict;                    // of this frame
  std::unique_ptr<paper::PaperMethod> by_paper;  // null: method search
  std::unique_ptr<BendSearch> bends;             // null: paths are taken as straight
  double bent_threshold_nats;                    // for a path that bends
  std::unique_ptr<SeveralTargets> several;       // null: a frame has one target
  std::unique_ptr<WidthFit> width;               // null: the pulse is as wide as configured

  Workspace(const Pattern& pattern, const PulseOptions& pulse, const SceneOptions& scene_options,
            const EstimatorOptions& options, double frame_length_ms, std::size_t max_photons,
            ClockReference clock_reference, const DetectorOptions& detector, std::size_t inputs)
      : reference(clock_reference),
        train(pattern),
        mode(pattern.mode),
        unambiguous_ns(pattern.unambiguous_delay_ps * ns_per_ps),
        shape(configured_pulse(pattern, pulse)),
        scene(scene_options),
        max_travel_ns(moving() ? travel_ns_at(scene.max_speed_mps, frame_length_ms * 1e6) : 0),
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
                mode != Mode::ambiguous,
                models_dead_time(detector, options, pulse),
                scene.targets > 1},
               max_photons),
        pattern_check(train, *shape, frame.reach_ns(),
                      models_dead_time(detector, options, pulse) ? max_photons : 0,
                      pulse.width == PulseWidth::fitted),
        detector_check(train, *shape, detector.dead_time_ns, inputs, max_photons),
        bent_threshold_nats(threshold_nats) {
    if (options.method == Method::paper) {
      by_paper = std::make_unique<paper::PaperMethod>(pattern, *shape, scene);
    }
    std::optional<BlindTime> straight_blind;
    if (scene.targets > 1) look_for_several(options.false_alarm_rate, max_photons);
    width = make_width_fit(pulse, train, max_photons);
    if (models_dead_time(detector, options, pulse)) {
      dead_time.emplace(train, detector.dead_time_ns, inputs, max_photons, frame.reach_ns());
      straight_blind.emplace(train, detector.dead_time_ns, inputs, max_photons, frame.reach_ns());
    }
    if (may_accelerate()) {
      look_for_bends(options, frame_length_ms * 1e6, max_photons, std::move(straight_blind));
    }
  }

  // The likelihood of several targets knows no dead time, and neither does that of a width.
  [[nodiscard]] bool models_dead_time(const DetectorOptions& detector,
                                      const EstimatorOptions& options,
                                      const PulseOptions& pulse) const {
    return detector.dead_time_ns > 0 && detector.dead_time == DeadTime::modelled &&
           options.method == Method::search && scene.targets == 1 &&
           pulse.width == PulseWidth::fixed;
  }
  void look_for_several(double false_alarm_rate, std::size_t max_photons);

  [[nodiscard]] bool may_accelerate() const {
    return moving() && scene.max_acceleration_mps2 > 0 &&
           (scene.motion == Motion::automatic || scene.motion == Motion::accelerating);
  }
  // straight_blind: see BendSearch.
  void look_for_bends(const EstimatorOptions& options, double length_ns, std::size_t max_photons,
                      std::optional<BlindTime> straight_blind);

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

  Estimate estimate(const FrameView& view, TargetTrack* track, Effort most);
  Fit with_blind_time(const FrameView& view, const Fit& fit);
  BentFit with_blind_time(const FrameView& view, const BentFit& bent);
  void say_blind_time(Estimate& estimate) const;
  std::optional<Fit> find(const FrameView& view, TargetTrack* track, Effort most);
  std::optional<Fit> follow(const TargetTrack& track, std::int64_t mid_ps,
                            const FoldedFrame& photons, double bend_ns = 0);
  [[nodiscard]] double range_odds_nats(const Fit& fit, const TargetTrack* track) const;
  std::optional<Fit> find_as_paper(const FrameView& view);
  Fit drop_motion_unless_seen(const Fit& moving_fit);
  bool moves_after_all(const Fit& still_fit);
  bool estimate_several(const FrameView& view, Fit& best, Estimate& estimate, TargetTrack* track,
                        Effort most);
  std::optional<BentFit> find_bent(const FrameView& view, TargetTrack* track, Effort most);
  std::optional<BentFit> bent_if_seen(const std::optional<Fit>& straight, Effort most);
  void estimate_bent(const FrameView& view, Estimate& estimate, TargetTrack* track, Effort most);
  [[nodiscard]] double bent_odds_nats(const BentFit& bent, const TargetTrack* track) const;
  bool has_pattern(const FoldedFrame& photons, const Fit& fit, Estimate& estimate);
  void finish(const FrameView& view, Estimate& estimate, TargetTrack* track) const;
  void take(const BentFit& found, const FrameView& view, Estimate& estimate, TargetTrack* track);
  void fill(Estimate& estimate, const Fit& fit, const SyncFit& sync, double bend_ns = 0) const;
  void fill_acceleration(Estimate& estimate, const BentFit& bent) const;
  void fill_one(Estimate& estimate, const Fit& fit, const SyncFit& sync);
  void say_light(Estimate& estimate, const PathVerdict& path, const PulseVerdict& pulse) const;
  void say_pulse(Estimate& estimate, const PulseVerdict& pulse) const;
  void remember(const FrameView& view, const Estimate& estimate, TargetTrack& track) const;
};

Fit FrameEstimator::Workspace::with_blind_time(const FrameView& view, const Fit& fit) {
  if (!dead_time || !dead_time->look_at_pulses(view, frame, fit)) return fit;
  const DelayLine line = fit.parameters.line;
  return moving() ? search.fit_moving(frame, line) : search.fit_at_rest(frame, line.delay_ns);
}

BentFit FrameEstimator::Workspace::with_blind_time(const FrameView& view, const BentFit& bent) {
  if (!dead_time || !dead_time->look_at_pulses(view, frame, bent.fit)) return bent;
  return bends->refine(frame, bent.fit.parameters.line, bent.bend_ns);
}

// With the light as it is if none of the photons is from a target.
void FrameEstimator::Workspace::say_blind_time(Estimate& estimate) const {
  if (dead_time) dead_time->say(frame, estimate);
  estimate.background_per_ns =
      static_cast<double>(estimate.photons) / frame.seen_ns / (1 - estimate.blind_fraction);
}

std::optional<Fit> FrameEstimator::Workspace::find(const FrameView& view, TargetTrack* track,
                                                   Effort most) {
  if (by_paper) return find_as_paper(view);
  std::optional<Fit> fit;
  if (track != nullptr) {
    fit = follow(*track, view.mid_ps(), frame);
    track->followed = fit ? track->followed + 1 : 0;
  }
  return fit ? fit : search.find(frame, most);
}

// photons: the frame, without the bend that the track foretells.
std::optional<Fit> FrameEstimator::Workspace::follow(const TargetTrack& track, std::int64_t mid_ps,
                                                     const FoldedFrame& photons, double bend_ns) {
  const auto gap_ps = static_cast<double>(mid_ps - track.mid_ps);
  if (!track.valid || track.followed >= most_followed || std::abs(gap_ps) > longest_gap_ps) {
    return std::nullopt;
  }
  const double gained_mps = track.acceleration_mps2 * gap_ps * 1e-12;
  const double beta = (track.velocity_mps + gained_mps / 2) / speed_of_light_mps;  // over the gap
  const double delay_ns = track.delay_ns + 2 * beta * gap_ps * ns_per_ps;
  Fit fit =
      search.find_near(photons, {delay_ns / to_reference() / (1 + beta) + bend_ns / 12,
                                 travel_ns_at(track.velocity_mps + gained_mps, frame.length_ns)});
  const double least =
      std::max(least_followed_gain * track.nats_per_ns * frame.seen_ns, threshold_nats + 6);
  if (fit.gain_nats < least || !fit.has_covariance) return std::nullopt;
  if (track.odds_per_nat * fit.gain_nats < sure_odds_nats) fit = search.look_beside(photons, fit);
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
                          travel_ns_at(found.velocity_mps, frame.length_ns)};
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

void FrameEstimator::Workspace::look_for_several(double false_alarm_rate, std::size_t max_photons) {
  several = std::make_unique<SeveralTargets>(search, pattern_check, train, *shape, threshold_nats,
                                             false_alarm_rate,
                                             static_cast<std::size_t>(scene.targets), max_photons);
}

void FrameEstimator::Workspace::look_for_bends(const EstimatorOptions& options, double length_ns,
                                               std::size_t max_photons,
                                               std::optional<BlindTime> straight_blind) {
  if (by_paper) return;
  bends =
      std::make_unique<BendSearch>(search, train, shape->width_ns(), scene.max_acceleration_mps2,
                                   max_photons, std::move(straight_blind));
  // In so short a frame not even a million photons show that the path bends.
  constexpr double least_widths = 0.01;
  const double bend_ns = bends->max_bend_ns(length_ns);
  const bool too_many = bends->looks(length_ns) > BendSearch::most_looks;
  if (too_many && scene.motion == Motion::accelerating) {
    throw Error(Fault::usage, bends->too_many_looks_text(length_ns));
  }
  if (too_many ||
      (scene.motion == Motion::automatic && bend_ns < least_widths * shape->width_ns())) {
    bends.reset();
    return;
  }
  bent_threshold_nats =
      significance_threshold_nats({train.circle_ns, travel_looked_at_ns(), shape->width_ns(),
                                   bend_ns + BendSearch::least_reach_widths * shape->width_ns()},
                                  options.false_alarm_rate);
}

std::optional<BentFit> FrameEstimator::Workspace::find_bent(const FrameView& view,
                                                            TargetTrack* track, Effort most) {
  if (track != nullptr) {
    const double bend_ns = track->acceleration_mps2 / acceleration_of_bend(1, frame.length_ns);
    const std::optional<Fit> fit =
        follow(*track, view.mid_ps(), bends->straightened(frame, bend_ns), bend_ns);
    track->followed = fit ? track->followed + 1 : 0;
    if (fit) return bends->refine(frame, fit->parameters.line, bend_ns);
  }
  return bends->find(frame, most);
}

// Scene `auto`: the path is straight unless the photons say otherwise. Where paths may bend by more
// than a bin, the best straight line may be one that touches the path in a part of the frame, at a
// wrong delay even, so that all bends are looked at.
std::optional<BentFit> FrameEstimator::Workspace::bent_if_seen(const std::optional<Fit>& straight,
                                                               Effort most) {
  double least = bent_threshold_nats;
  std::optional<BentFit> best;
  if (straight && straight->gain_nats >= threshold_nats && straight->has_covariance) {
    pattern_check.judge(frame, straight->parameters);
    if (pattern_check.judge_path(frame).is_straight()) return std::nullopt;
    least = std::max(least, straight->gain_nats + nats_for_acceleration);
    best = bends->refine(frame, straight->parameters.line, 0);
    if (best->fit.gain_nats < least && bends->looks(frame.length_ns) == 1) return std::nullopt;
  }
  const std::optional<BentFit> found = bends->find(frame, most);
  if (found && (!best || found->fit.gain_nats > best->fit.gain_nats)) best = found;
  if (!best || best->fit.gain_nats < least || !best->at_mid_frame().has_covariance) {
    return std::nullopt;
  }
  return best;
}

void FrameEstimator::Workspace::estimate_bent(const FrameView& view, Estimate& estimate,
                                              TargetTrack* track, Effort most) {
  estimate.threshold_nats = bent_threshold_nats;
  say_blind_time(estimate);
  if (const auto bent = find_bent(view, track, most)) take(*bent, view, estimate, track);
}

// The prior of a path that may bend is spread over all bends, as it is over all delays and travels.
double FrameEstimator::Workspace::bent_odds_nats(const BentFit& bent,
                                                 const TargetTrack* track) const {
  const double bends_ns = 2 * bends->max_bend_ns(frame.length_ns);
  const double share = std::sqrt(2 * std::numbers::pi * bent.variance_ns2) / bends_ns;
  return range_odds_nats(bent.fit, track) + std::min(0.0, std::log(share));
}

void FrameEstimator::Workspace::take(const BentFit& found, const FrameView& view,
                                     Estimate& estimate, TargetTrack* track) {
  const BentFit bent = with_blind_time(view, found);
  say_blind_time(estimate);
  const Fit at_mid = bent.at_mid_frame();
  estimate.threshold_nats = bent_threshold_nats;
  estimate.significance_nats = bent.fit.gain_nats;
  if (bent.fit.gain_nats < bent_threshold_nats || !at_mid.has_covariance) return;
  estimate.range_odds_nats = bent_odds_nats(bent, track);
  if (!has_pattern(bends->straightened(frame, bent.bend_ns), bent.fit, estimate)) return;
  fill(estimate, at_mid, view.sync, bent.bend_ns);
  fill_acceleration(estimate, bent);
  say_light(estimate, pattern_check.judge_path(frame, true), pulse_verdict);
  finish(view, estimate, track);
}

void FrameEstimator::Workspace::fill_acceleration(Estimate& estimate, const BentFit& bent) const {
  const double per_bend = acceleration_of_bend(1, frame.length_ns);
  estimate.acceleration_mps2 = bent.bend_ns * per_bend;
  estimate.std_acceleration_mps2 = std::sqrt(bent.variance_ns2) * per_bend;
  // Light that comes back at mid-frame met the target half a delay before.
  estimate.velocity_mps += estimate.acceleration_mps2 * estimate.delay_ns * 1e-9 / 2;
}

// Scene `static`, but the photons say that the target moves: the deviations of a fit at rest would
// then be far too small.
bool FrameEstimator::Workspace::moves_after_all(const Fit& still_fit) {
  return search.fit_moving(frame, still_fit.parameters.line).gain_nats >
         still_fit.gain_nats + TargetSearch::nats_for_motion_at_rest;
}

// Returns false where the frame shows no other target than the one that has been found.
bool FrameEstimator::Workspace::estimate_several(const FrameView& view, Fit& best,
                                                 Estimate& estimate, TargetTrack* track,
                                                 Effort most) {
  const auto found = several->find(frame, best, moving(), most);
  if (found.empty()) return false;
  if (std::any_of(found.begin(), found.end(), [](const auto& t) { return t.moves; })) return true;
  estimate.target_count = found.size();
  // The values of the frame are those of the first target, which comes last here.
  for (std::size_t k = found.size(); k-- > 0;) {
    fill(estimate, found[k].fit, view.sync);
    estimate.range_odds_nats = found[k].range_odds_nats;
    estimate.amplitude_misfit = found[k].amplitude_misfit;
    say_light(estimate, found[k].path, found[k].pulse);
    finish(view, estimate, k == 0 ? track : nullptr);
    estimate.targets.at(k) = estimate.first_target();
    estimate.targets.at(k).shape_odds_nats = found[k].shape_odds_nats;
  }
  return true;
}

void FrameEstimator::Workspace::fill(Estimate& estimate, const Fit& fit, const SyncFit& sync,
                                     double bend_ns) const {
  fill_values(estimate, fit, {frame.length_ns, told_apart_ns(), to_reference()}, sync, bend_ns);
}

void FrameEstimator::Workspace::remember(const FrameView& view, const Estimate& estimate,
                                         TargetTrack& track) const {
  // A range that may be wrong is not followed: the next frame is then searched over all delays.
  track.valid = estimate.range_odds_nats >= least_odds_nats;
  track.mid_ps = view.mid_ps();
  track.delay_ns = estimate.delay_ns;
  track.velocity_mps = estimate.velocity_mps;
  track.acceleration_mps2 = estimate.acceleration_mps2;
  if (track.followed > 0) return;
  track.nats_per_ns = estimate.significance_nats / frame.seen_ns;
  track.odds_per_nat = estimate.range_odds_nats / estimate.significance_nats;
}

bool FrameEstimator::Workspace::has_pattern(const FoldedFrame& photons, const Fit& fit,
                                            Estimate& estimate) {
  const PatternVerdict pattern = pattern_check.judge(photons, fit.parameters);
  estimate.pattern_fault = pattern.fault;
  if (pattern.fault != PatternFault::none) return false;
  estimate.amplitude_misfit = pattern.amplitude_misfit;
  pulse_verdict = pattern_check.judge_pulse(photons, fit.parameters);
  return true;
}

// The values of a frame's only target, with the pulse's width where it is fitted.
void FrameEstimator::Workspace::fill_one(Estimate& estimate, const Fit& fit, const SyncFit& sync) {
  std::optional<FittedWidth> fitted;
  if (width) fitted = width->climb(frame, fit, fit.covariance(1, 1) > 0);
  fill(estimate, fitted ? fitted->fit : fit, sync);
  const PathVerdict path = pattern_check.judge_path(frame);
  if (!fitted) return say_light(estimate, path, pulse_verdict);
  path.widen(estimate, to_reference(), frame.length_ns, false);
  fitted->say_width(estimate);
  pattern_check.judge_shape(frame, fitted->fit.parameters, fitted->sigma_ns)
      .widen(estimate, shape->width_ns() * to_reference(), fitted->sigma_ns * to_reference(),
             train.amplitude_per_ns);
}

// What speaks against the fitted path and the configured pulse.
void FrameEstimator::Workspace::say_light(Estimate& estimate, const PathVerdict& path,
                                          const PulseVerdict& pulse) const {
  estimate.acceleration_misfit_mps2.reset();
  estimate.jerk_misfit_mps3.reset();
  estimate.signal_gap.reset();
  path.widen(estimate, to_reference(), frame.length_ns, pulse.misfit.has_value());
  if (bends) {
    path.widen_if_accelerating(estimate, to_reference(), frame.length_ns, pulse.misfit.has_value());
  } else if (!several) {
    path.say_excess(estimate);
  }
  say_pulse(estimate, pulse);
}

void FrameEstimator::Workspace::say_pulse(Estimate& estimate, const PulseVerdict& pulse) const {
  estimate.pulse_excess = pulse.excess;
  estimate.std_pulse_excess = pulse.std_excess;
  estimate.pulse_misfit.reset();
  if (!pulse.misfit) return;
  pulse.misfit->widen(estimate, shape->width_ns() * to_reference(), train.amplitude_per_ns);
}

void FrameEstimator::Workspace::finish(const FrameView& view, Estimate& estimate,
                                       TargetTrack* track) const {
  const bool is_sure = estimate.range_odds_nats >= least_odds_nats;
  if (frame.blind != nullptr) {
    estimate.low_by_split = low_by_split(view, estimate, train);
    estimate.flicker_misfit = flicker_misfit(view, estimate, train, frame.blind->share);
  }
  estimate.status = mode == Mode::ambiguous || !is_sure ? FrameStatus::ambiguous : FrameStatus::ok;
  if (track != nullptr) remember(view, estimate, *track);
}

Estimate FrameEstimator::Workspace::estimate(const FrameView& view, TargetTrack* track,
                                             Effort most) {
  Estimate estimate;
  estimate.photons = view.photons_ps.size();
  estimate.threshold_nats = threshold_nats;
  const double seen_ns = view.seen_ns();
  if (seen_ns > 0) {
    estimate.background_per_ns = static_cast<double>(estimate.photons) / seen_ns;
  }
  if (!view.sync.locked) {
    estimate.status = FrameStatus::no_sync;
    return estimate;
  }
  estimate.status = FrameStatus::no_target;
  if (estimate.photons == 0 || seen_ns <= 0) return estimate;

  frame.fold(view, train);
  frame.blind = nullptr;
  if (dead_time) dead_time->look(view, frame);
  if (bends && scene.motion == Motion::accelerating) {
    estimate_bent(view, estimate, track, most);
    return estimate;
  }
  std::optional<Fit> fit = find(view, track, most);
  if (fit) fit = with_blind_time(view, *fit);
  say_blind_time(estimate);
  const double odds_nats = fit && fit->gain_nats >= threshold_nats && fit->has_covariance
                               ? range_odds_nats(*fit, track)
                               : 0;
  if (bends) {
    if (const auto bent = bent_if_seen(fit, most)) {
      take(*bent, view, estimate, track);
      return estimate;
    }
  }
  if (!fit) return estimate;
  estimate.significance_nats = fit->gain_nats;
  if (fit->gain_nats < threshold_nats || !fit->has_covariance) return estimate;
  estimate.range_odds_nats = odds_nats;
  if (moving() && scene.motion == Motion::automatic) {
    fit = drop_motion_unless_seen(*fit);
    if (!fit->has_covariance) return estimate;
  }
  if (several && estimate_several(view, *fit, estimate, track, most)) return estimate;
  if (!moving() && moves_after_all(*fit)) return estimate;
  if (!has_pattern(frame, *fit, estimate)) return estimate;
  fill_one(estimate, *fit, view.sync);
  finish(view, estimate, track);
  return estimate;
}

FrameEstimator::FrameEstimator(const Pattern& pattern, const PulseOptions& pulse,
                               const SceneOptions& scene, const EstimatorOptions& options,
                               double frame_length_ms, std::size_t max_photons,
                               ClockReference reference, const DetectorOptions& detector,
                               std::size_t inputs) {
  refuse_if(scene.validate(), "/scene");
  refuse_if(options.validate(scene), "/estimator");
  refuse_if(pulse.validate(scene, options), "/pulse");
  refuse_if(too_large_a_search(pattern, pulse, scene, options, frame_length_ms), "/pattern");
  workspace_ = std::make_unique<Workspace>(pattern, pulse, scene, options, frame_length_ms,
                                           max_photons, reference, detector, inputs);
}

FrameEstimator::~FrameEstimator() = default;
FrameEstimator::FrameEstimator(FrameEstimator&&) noexcept = default;

Estimate FrameEstimator::estimate(const FrameView& view, TargetTrack* track, Effort most) {
  Estimate estimate = workspace_->estimate(view, track, most);
  workspace_->detector_check.look(view, workspace_->frame, workspace_->to_reference(), estimate);
  return estimate;
}

}  // namespace splid
