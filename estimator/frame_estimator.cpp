#include "estimator/frame_estimator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "estimator/checks/finding_sums.hpp"
#include "estimator/checks/findings.hpp"
#include "estimator/checks/input_split.hpp"
#include "estimator/checks/light_flicker.hpp"
#include "estimator/checks/stray_light.hpp"
#include "estimator/fit/dead_time_model.hpp"
#include "estimator/fold/folded_frame.hpp"
#include "estimator/frame_values.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"
#include "estimator/model/units.hpp"
#include "estimator/paper/paper_method.hpp"
#include "estimator/search/frame_search.hpp"
#include "estimator/search_memory.hpp"
#include "estimator/selection/target_selection.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

// Scene `auto`: so much must a richer path gain. 4.5 nats are three standard deviations of the
// velocity, or of the acceleration.
constexpr double nats_for_richer_path = 4.5;
// A travel of so many pulse widths needs no test whether there is any.
constexpr double surely_moves_widths = 20;

// Widths are fitted from 1/4 of the configured width to 4 times it, and to better than a half.
constexpr double most_width = 4, most_uncertain_width = 0.5;

// A followed target whose signal has changed by so many deviations is looked for anew.
constexpr double changed_deviations = 4;

// Findings are summed up over the last 50 to 100 frames.
constexpr double frames_together = 50;

void refuse_if(const std::optional<OptionFault>& fault, const char* section) {
  if (fault) throw Error(Fault::usage, section + fault->pointer + ": " + fault->what);
}

// What the photons say of one target.
struct Checked {
  FoundList findings;
  Widening wider;
  bool is_doubtful = false;
  bool is_no_target = false;
};

// What a look at a frame has found.
struct Found {
  Start start;
  likelihood::Maximum best;
  std::size_t track_terms = 2;  // free: delay, range walk, quadratic term
  double threshold_nats = 0;
  bool is_target = false;
  std::array<double, most_targets> gain_nats{}, odds_nats{};  // of each target
  std::array<Checked, most_targets> checked;

  [[nodiscard]] bool has_findings() const { return !checked[0].findings.all().empty(); }
};

}  // namespace

struct FrameEstimator::Workspace {
  ClockReference reference;
  PulseTrain train;
  Mode mode;
  SceneOptions scene;
  std::unique_ptr<PulseShape> shape;
  bool is_width_fitted;
  FoldedFrame frame;
  std::optional<DeadTimeModel> dead_time;  // where it is modelled
  likelihood::Maximizer maximizer;         // of what the search does not fit
  FrameSearch search;
  std::unique_ptr<paper::PaperMethod> by_paper;  // null: method search
  std::optional<checks::Findings> findings;      // empty: not looked for
  // Of the last frames, and of those before them.
  std::unique_ptr<checks::FindingSums> sums, earlier;
  FoundList recent;  // that the frames of both show
  std::optional<checks::StrayLight> stray;
  FoldedFrame cleaned;                                  // the frame without stray light
  std::unique_ptr<selection::TargetSelection> several;  // null: a frame has one target

  Workspace(const Pattern& pattern, const PulseOptions& pulse, const SceneOptions& scene_options,
            const EstimatorOptions& options, double frame_length_ms, std::size_t max_photons,
            ClockReference clock_reference, const DetectorOptions& detector, std::size_t inputs)
      : reference(clock_reference),
        train(pattern),
        mode(pattern.mode),
        scene(scene_options),
        shape(configured_pulse(pattern, pulse)),
        is_width_fitted(pulse.width == PulseWidth::fitted),
        frame(train, max_photons, reach_ns(frame_length_ms * 1e6)),
        dead_time(dead_time_of(detector, options, inputs, max_photons)),
        maximizer(*shape, train, is_rich() ? max_photons : 0,
                  {1, is_width_fitted ? most_width : 1, dead_time.has_value()}),
        search(pattern, train, *shape, scene, options, frame_length_ms * 1e6, max_photons,
               maximizer, blind_time_of(detector, inputs, max_photons)),
        cleaned(train, options.findings == FindingsWanted::on ? max_photons : 0, frame.reach_ns()) {
    if (options.method == Method::paper) {
      by_paper = std::make_unique<paper::PaperMethod>(pattern, *shape, scene);
    }
    if (options.findings == FindingsWanted::on) {
      stray.emplace(train, shape->width_ns(), max_photons);
      findings.emplace(train, *shape, max_photons, dead_time ? detector.dead_time_ns : 0);
      sums = std::make_unique<checks::FindingSums>(*findings);
      earlier = std::make_unique<checks::FindingSums>(*findings);
    }
    if (scene.targets > 1) {
      several = std::make_unique<selection::TargetSelection>(
          search.targets(), search.bends(), train, *shape,
          selection::SelectionScope{
              search.may_bend() ? search.bent_threshold_nats() : search.threshold_nats(),
              static_cast<std::size_t>(scene.targets), is_width_fitted, dead_time.has_value()},
          max_photons);
    }
  }

  [[nodiscard]] double reach_ns(double length_ns) const {
    return FrameSearch::max_travel_ns(scene, length_ns) / 2 +
           std::max(std::abs(shape->first_ns()), std::abs(shape->last_ns()));
  }
  [[nodiscard]] bool is_rich() const {
    return is_width_fitted || scene.motion == Motion::accelerating ||
           scene.motion == Motion::automatic;
  }
  [[nodiscard]] std::optional<DeadTimeModel> dead_time_of(const DetectorOptions& detector,
                                                          const EstimatorOptions& options,
                                                          std::size_t inputs,
                                                          std::size_t max_photons) const {
    if (!(detector.dead_time_ns > 0) || detector.dead_time != DeadTime::modelled ||
        options.method != Method::search) {
      return std::nullopt;
    }
    return DeadTimeModel(train, detector.dead_time_ns, inputs, max_photons, frame.reach_ns());
  }
  [[nodiscard]] std::optional<BlindTime> blind_time_of(const DetectorOptions& detector,
                                                       std::size_t inputs,
                                                       std::size_t max_photons) const {
    if (!dead_time) return std::nullopt;
    return BlindTime(train, detector.dead_time_ns, inputs, max_photons, frame.reach_ns());
  }
  // From a delay in the pattern's clock to that delay in the clock that is taken to be right.
  [[nodiscard]] double to_reference() const {
    return reference == ClockReference::tagger ? frame.scale : 1;
  }

  Estimate estimate(const FrameView& view, TargetTrack* track, Effort most);
  std::optional<Found> find(const FrameView& view, TargetTrack* track, Effort most);
  std::optional<Found> look_for(const FrameView& view, TargetTrack* track, Effort most);
  std::optional<Found> find_by(Look look, const FrameView& view, const TargetTrack* track,
                               Effort most);
  std::optional<Start> start_by(Look look, const FrameView& view, const TargetTrack* track,
                                Effort most);
  std::optional<Start> start_as_paper(const FrameView& view);
  [[nodiscard]] Look look_after(Look look, const std::optional<Found>& found,
                                const TargetTrack* track) const;
  void fit(Look look, Found& found);
  void fit_richer(Look look, Found& found);
  void fit_width(Found& found);
  [[nodiscard]] likelihood::Maximum maximum_with(const likelihood::Model& model,
                                                 std::size_t track_terms, bool width_too = false);
  likelihood::Maximum maximum_at_rest(const likelihood::Maximum& moving);
  [[nodiscard]] bool moves_after_all(const Found& found);
  void select(Found& found, Effort most);
  void check(const FrameView& view, Found& found);
  [[nodiscard]] Checked checked_by(const checks::Verdict& verdict, const Found& found) const;
  void report(const FrameView& view, const Found& found, Estimate& estimate);
  void report_target(const FrameView& view, const Found& found, std::size_t k, Estimate& estimate);
  void say_blind_time(Estimate& estimate) const;
  void sum_up();
};

// With the light as it is if none of the photons is from a target.
void FrameEstimator::Workspace::say_blind_time(Estimate& estimate) const {
  if (dead_time) dead_time->say(frame, estimate);
  estimate.background_per_ns =
      static_cast<double>(estimate.photons) / frame.seen_ns / (1 - estimate.blind_fraction);
}

// The result of [P]'s method is judged as a result of the search is: by the same likelihood, with
// the same deviations and the same threshold. The search runs too, for the odds of the range.
std::optional<Start> FrameEstimator::Workspace::start_as_paper(const FrameView& view) {
  search.straight(frame, Effort::exhaustive);
  const paper::PaperResult found = by_paper->estimate(view);
  if (!found.found) return std::nullopt;
  const double beta = found.velocity_mps / speed_of_light_mps;
  const DelayLine line = {found.delay_ns / frame.scale / (1 + beta),
                          travel_ns_at(found.velocity_mps, frame.length_ns)};
  return search.judged(frame, {line, found.signal_per_pulse, found.background_per_ns});
}

std::optional<Start> FrameEstimator::Workspace::start_by(Look look, const FrameView& view,
                                                         const TargetTrack* track, Effort most) {
  if (by_paper) return start_as_paper(view);
  if (look == Look::follow) return search.follow(frame, *track, view.mid_ps(), to_reference());
  return look == Look::bent ? search.bent(frame, most) : search.straight(frame, most);
}

likelihood::Maximum FrameEstimator::Workspace::maximum_with(const likelihood::Model& model,
                                                            std::size_t track_terms,
                                                            bool width_too) {
  maximizer.begin(frame);
  likelihood::Maximum best =
      maximizer.maximize(model, {likelihood::free_set(model.count, track_terms, width_too)});
  if (!search.is_possible(best.model.targets[0].track, frame.length_ns)) {
    best.has_covariance = false;
  }
  return best;
}

likelihood::Maximum FrameEstimator::Workspace::maximum_at_rest(const likelihood::Maximum& moving) {
  return maximum_of(search.targets().fit_at_rest(frame, moving.model.targets[0].track.delay_ns));
}

// Scene `auto`: the path bends, or the target moves, where the photons say so at three deviations.
void FrameEstimator::Workspace::fit_richer(Look look, Found& found) {
  const double straight_nats = look == Look::bent ? 0 : found.best.gain_nats;
  if (search.may_bend()) {
    likelihood::Maximum bent = maximum_with(found.start.model, 3);
    const double least_nats =
        std::max(search.bent_threshold_nats(), straight_nats + nats_for_richer_path);
    if (look == Look::bent || (bent.has_covariance && bent.gain_nats >= least_nats)) {
      found.best = bent;
      found.track_terms = 3;
      return;
    }
  }
  if (std::abs(found.best.model.targets[0].track.walk_ns) >
      surely_moves_widths * shape->width_ns()) {
    return;
  }
  const likelihood::Maximum rest = maximum_at_rest(found.best);
  if (found.best.gain_nats - rest.gain_nats >= nats_for_richer_path) return;
  found.best = rest;
  found.track_terms = 1;
}

// Where photons are too few to tell the width, it stays as configured.
void FrameEstimator::Workspace::fit_width(Found& found) {
  const likelihood::Maximum fitted = maximum_with(found.best.model, found.track_terms, true);
  constexpr auto w = static_cast<Eigen::Index>(likelihood::width_place(1));
  if (!fitted.has_covariance || std::abs(fitted.model.log_width) > std::log(most_width) - 1e-3 ||
      !(std::sqrt(fitted.covariance(w, w)) < most_uncertain_width)) {
    return;
  }
  const double gain_nats = found.best.gain_nats;
  found.best = fitted;
  found.best.gain_nats = gain_nats;  // the threshold is that of a pulse as configured
}

void FrameEstimator::Workspace::fit(Look look, Found& found) {
  const bool is_bent = scene.motion == Motion::accelerating && search.may_bend();
  found.track_terms = is_bent ? 3 : search.moves() ? 2 : 1;
  if (is_bent) {
    found.best = maximum_with(found.start.model, found.track_terms);
  } else if (look != Look::bent) {
    found.best =
        found.start.exact ? maximum_of(*found.start.exact) : maximum_with(found.start.model, 2);
  }
  if (scene.motion == Motion::automatic && search.moves()) fit_richer(look, found);
  found.threshold_nats =
      found.track_terms == 3 ? search.bent_threshold_nats() : search.threshold_nats();
  found.gain_nats[0] = found.best.gain_nats;
  found.odds_nats[0] = found.start.odds_nats;
  found.is_target = found.best.gain_nats >= found.threshold_nats && found.best.has_covariance;
  if (!found.is_target) return;
  if (found.track_terms == 3) {
    // The prior of a path that may bend is spread over all bends.
    const double variance = found.best.covariance(likelihood::quadratic, likelihood::quadratic);
    const double share =
        std::sqrt(2 * std::numbers::pi * variance) / search.most_quadratic_ns(frame.length_ns) / 2;
    found.odds_nats[0] += std::min(0.0, std::log(share));
  }
  if (!search.moves() && moves_after_all(found)) found.is_target = false;
  if (is_width_fitted && found.is_target) fit_width(found);
}

// Scene `static`, but the photons say that the target moves: the deviations of a fit at rest would
// then be far too small.
bool FrameEstimator::Workspace::moves_after_all(const Found& found) {
  const DelayTrack& track = found.best.model.targets[0].track;
  return search.targets().fit_moving(frame, {track.delay_ns, track.walk_ns}).gain_nats >
         found.best.gain_nats + TargetSearch::nats_for_motion_at_rest;
}

// The look that follows where one has not settled the frame; the same one where none does. What the
// model does not explain is looked for along more paths.
Look FrameEstimator::Workspace::look_after(Look look, const std::optional<Found>& found,
                                           const TargetTrack* track) const {
  const bool is_target = found && found->is_target;
  if (look == Look::follow) {
    const bool must_bend = scene.motion == Motion::accelerating && search.may_bend() &&
                           !search.bends_little(frame.length_ns);
    const Look next = must_bend ? Look::bent : Look::straight;
    if (!is_target || found->has_findings()) return next;
    const double changed = found->best.model.targets[0].signal_per_pulse - track->signal_per_pulse;
    constexpr auto S = static_cast<Eigen::Index>(likelihood::signal);
    const double deviation =
        std::hypot(std::sqrt(found->best.covariance(S, S)), track->std_signal_per_pulse);
    return std::abs(changed) > changed_deviations * deviation ? next : look;
  }
  if (look == Look::bent || !search.may_bend()) return look;
  if (search.bends_little(frame.length_ns)) {
    return is_target && found->start.gain_nats > search.settled_nats() ? look : Look::bent;
  }
  return is_target && findings && !found->has_findings() ? look : Look::bent;
}

std::optional<Found> FrameEstimator::Workspace::find_by(Look look, const FrameView& view,
                                                        const TargetTrack* track, Effort most) {
  const std::optional<Start> start = start_by(look, view, track, most);
  if (!start) return std::nullopt;
  Found found;
  found.start = *start;
  fit(look, found);
  if (dead_time &&
      dead_time->look_at_pulses(view, frame, found.best.model.targets[0].signal_per_pulse)) {
    found.start.model = found.best.model;
    const DelayTrack& at = found.best.model.targets[0].track;
    const DelayLine line = {at.delay_ns, at.walk_ns};
    found.start.exact = search.moves() ? search.targets().fit_moving(frame, line)
                                       : search.targets().fit_at_rest(frame, line.delay_ns);
    fit(look, found);
  }
  if (!found.is_target) return found;
  select(found, most);
  if (findings) check(view, found);
  return found;
}

// Where the light is that of no target, there may be one beside it.
std::optional<Found> FrameEstimator::Workspace::find(const FrameView& view, TargetTrack* track,
                                                     Effort most) {
  std::optional<Found> found = look_for(view, track, most);
  const bool is_wrong = found && found->checked[0].findings.has(FindingName::wrong_pattern);
  if (!is_wrong || frame.blind != nullptr || found->best.model.count > 1) return found;
  const auto finding = stray->look(findings->map(), frame, found->best.model.targets[0].track);
  if (!finding) return found;
  cleaned.take_some(stray->stays(), 0, frame);
  std::swap(cleaned, frame);
  std::optional<Found> beside = look_for(view, nullptr, most);
  if (!beside || !beside->is_target || beside->checked[0].is_no_target) {
    std::swap(cleaned, frame);
    return found;
  }
  beside->checked[0].findings.add(*finding);
  return beside;
}

std::optional<Found> FrameEstimator::Workspace::look_for(const FrameView& view, TargetTrack* track,
                                                         Effort most) {
  const bool must_bend = scene.motion == Motion::accelerating && search.may_bend() &&
                         !search.bends_little(frame.length_ns);
  Look look = track != nullptr && !by_paper ? Look::follow
              : must_bend                   ? Look::bent
                                            : Look::straight;
  std::optional<Found> best;
  while (true) {
    std::optional<Found> found = find_by(look, view, track, most);
    const bool is_better =
        found &&
        (!best || !best->is_target || look != Look::bent ||
         (found->is_target && found->gain_nats[0] >= best->gain_nats[0] + nats_for_richer_path));
    if (is_better) best = found;
    const Look next = look_after(look, best, track);
    if (track != nullptr)
      track->followed = look == Look::follow && next == look ? track->followed + 1 : 0;
    if (next == look) return best;
    look = next;
  }
}

// Looks for the targets beside the first one.
void FrameEstimator::Workspace::select(Found& found, Effort most) {
  if (!several) return;
  // Beside a target at rest another one may move.
  const std::size_t terms = std::max<std::size_t>(found.track_terms, search.moves() ? 2 : 1);
  const selection::Selection& selected =
      several->select(frame, found.best.model, fit_of(found.best), terms, most);
  if (selected.count < 2) return;
  found.track_terms = terms;
  if (!search.moves() && several->gain_by_moving_nats() > TargetSearch::nats_for_motion_at_rest) {
    found.is_target = false;
    return;
  }
  found.best = selected.best;
  for (std::size_t k = 0; k < selected.count; ++k) {
    found.gain_nats.at(k) = selected.targets.at(k).gain_nats;
    found.odds_nats.at(k) = selected.targets.at(k).range_odds_nats;
  }
}

// The first target comes last, so that its residual map is there to be summed up.
void FrameEstimator::Workspace::check(const FrameView& view, Found& found) {
  const checks::SeenParts parts = checks::seen_parts(view);
  const auto& C = found.best.covariance;
  for (std::size_t k = found.best.model.count; k-- > 0;) {
    const auto std_of = [&](likelihood::OfTarget parameter) {
      const auto i = static_cast<Eigen::Index>(likelihood::place_of(k, parameter));
      return std::sqrt(C(i, i));
    };
    const checks::FitFacts facts = {found.track_terms, found.best.model.log_width != 0,
                                    std_of(likelihood::delay), std_of(likelihood::walk),
                                    std_of(likelihood::quadratic)};
    found.checked.at(k) =
        checked_by(findings->judge(frame, found.best.model, k, facts, parts), found);
  }
}

// What follows from a target's findings.
Checked FrameEstimator::Workspace::checked_by(const checks::Verdict& verdict,
                                              const Found& found) const {
  Checked checked;
  checked.findings = verdict.found;
  checked.wider = {verdict.off_delay_ns,     verdict.off_walk_ns, verdict.sandwich_delay_ns,
                   verdict.sandwich_walk_ns, verdict.off_signal,  verdict.off_background};
  checked.is_doubtful = verdict.is_doubtful;
  const bool is_hidden =
      verdict.gain_beside_nats && *verdict.gain_beside_nats < found.threshold_nats;
  checked.is_no_target = verdict.is_wrong_pattern || is_hidden;
  return checked;
}

void FrameEstimator::Workspace::report_target(const FrameView& view, const Found& found,
                                              std::size_t k, Estimate& estimate) {
  const Checked& checked = found.checked.at(k);
  fill_values(estimate, found.best, k, checked.wider,
              {frame.length_ns, search.told_apart_ns(), to_reference()}, view.sync);
  estimate.significance_nats = found.gain_nats.at(k);
  estimate.range_odds_nats = found.odds_nats.at(k);
  estimate.findings = checked.findings;
  const bool is_sure = estimate.range_odds_nats >= search.least_odds_nats() &&
                       !checked.is_doubtful && !checked.is_no_target;
  estimate.status = mode == Mode::ambiguous || !is_sure ? FrameStatus::ambiguous : FrameStatus::ok;
}

void FrameEstimator::Workspace::report(const FrameView& view, const Found& found,
                                       Estimate& estimate) {
  const std::size_t count = found.best.model.count;
  estimate.target_count = count > 1 ? count : 0;
  for (std::size_t k = count; k-- > 0;) {
    report_target(view, found, k, estimate);
    if (count > 1) estimate.targets.at(k) = estimate.first_target();
  }
  if (is_width_fitted && found.best.model.log_width != 0) {
    const auto w = static_cast<Eigen::Index>(likelihood::width_place(count));
    estimate.pulse_sigma_ns = shape->width_ns() * std::exp(found.best.model.log_width);
    estimate.std_pulse_sigma_ns = std::sqrt(found.best.covariance(w, w)) * estimate.pulse_sigma_ns;
  }
  if (frame.blind != nullptr) {
    estimate.low_by_split = low_by_split(view, estimate, train);
    widen_by_flicker(view, train, frame.blind->share, estimate);
  }
}

// What the last frames show together, from three of them on.
void FrameEstimator::Workspace::sum_up() {
  constexpr double fewest = 3;
  sums->add(findings->verdict(), frame);
  earlier->add(findings->verdict(), frame);
  if (earlier->frames() >= fewest) recent = earlier->found();
  if (sums->frames() < frames_together) return;
  std::swap(sums, earlier);
  sums->clear();
}

Estimate FrameEstimator::Workspace::estimate(const FrameView& view, TargetTrack* track,
                                             Effort most) {
  Estimate estimate;
  estimate.photons = view.photons_ps.size();
  estimate.threshold_nats = search.threshold_nats();
  const double seen_ns = view.seen_ns();
  if (seen_ns > 0) estimate.background_per_ns = static_cast<double>(estimate.photons) / seen_ns;
  if (!view.sync.locked) {
    estimate.status = FrameStatus::no_sync;
    return estimate;
  }
  estimate.status = FrameStatus::no_target;
  if (estimate.photons == 0 || seen_ns <= 0) return estimate;
  frame.fold(view, train);
  frame.blind = nullptr;
  if (dead_time) dead_time->look(view, frame);
  const std::optional<Found> found = find(view, track, most);
  say_blind_time(estimate);
  if (!found) return estimate;
  estimate.threshold_nats = found->threshold_nats;
  estimate.significance_nats = found->gain_nats[0];
  estimate.findings = found->checked[0].findings;
  if (found->best.model.count == 1 && found->checked[0].is_no_target) return estimate;
  if (!found->is_target) return estimate;
  if (findings) sum_up();
  report(view, *found, estimate);
  estimate.recent_findings = recent;
  if (track != nullptr) search.remember(frame, view.mid_ps(), estimate, *track);
  return estimate;
}

FrameEstimator::FrameEstimator(const Pattern& pattern, const PulseOptions& pulse,
                               const SceneOptions& scene, const EstimatorOptions& options,
                               double frame_length_ms, std::size_t max_photons,
                               ClockReference reference, const DetectorOptions& detector,
                               std::size_t inputs) {
  refuse_if(options.validate(scene), "/estimator");
  refuse_if(pulse.validate(options), "/pulse");
  refuse_if(too_large_a_search(pattern, pulse, scene, options, frame_length_ms), "/pattern");
  workspace_ = std::make_unique<Workspace>(pattern, pulse, scene, options, frame_length_ms,
                                           max_photons, reference, detector, inputs);
}

FrameEstimator::~FrameEstimator() = default;
FrameEstimator::FrameEstimator(FrameEstimator&&) noexcept = default;

Estimate FrameEstimator::estimate(const FrameView& view, TargetTrack* track, Effort most) {
  return workspace_->estimate(view, track, most);
}

}  // namespace splid
