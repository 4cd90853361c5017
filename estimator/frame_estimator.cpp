#include "estimator/frame_estimator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "estimator/checks/frame_checks.hpp"
#include "estimator/checks/light_flicker.hpp"
#include "estimator/fold/dead_intervals.hpp"
#include "estimator/fold/folded_frame.hpp"
#include "estimator/frame_values.hpp"
#include "estimator/model/chance.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"
#include "estimator/paper/paper_method.hpp"
#include "estimator/search/frame_search.hpp"
#include "estimator/search/target_fit.hpp"
#include "estimator/search_memory.hpp"
#include "estimator/selection/target_selection.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

void refuse_if(const std::optional<OptionFault>& fault, const char* section) {
  if (fault) throw Error(Fault::usage, section + fault->pointer + ": " + fault->what);
}

// What a look at a frame has found: the first target's fit, which selection extends by others.
struct Found : FittedTarget {
  std::array<selection::SelectedTarget, most_targets> targets;
  std::array<checks::Verdict, most_targets> verdicts;

  [[nodiscard]] bool has_findings() const { return !verdicts[0].found.all().empty(); }
  [[nodiscard]] bool is_no_target() const { return verdicts[0].is_no_target(threshold_nats); }
};

}  // namespace

// The way of a frame, from top to bottom: fold, search, fit, select, check, report.
struct FrameEstimator::Workspace {
  ClockReference reference;
  PulseTrain train;
  SceneOptions scene;
  std::unique_ptr<PulseShape> shape;
  bool is_width_fitted;
  FoldedFrame frame;
  std::optional<DeadIntervals> dead_time;  // where it is modelled
  FrameSearch search;
  TargetFit target_fit;
  std::unique_ptr<paper::PaperMethod> by_paper;         // null: method search
  std::unique_ptr<selection::TargetSelection> several;  // null: a frame has one target
  std::unique_ptr<checks::FrameChecks> checks;          // null: findings are not asked for
  bool has_recent_findings = true;

  Workspace(const Pattern& pattern, const PulseOptions& pulse, const SceneOptions& scene_options,
            const EstimatorOptions& options, double frame_length_ms, std::size_t max_photons,
            ClockReference clock_reference, const DetectorOptions& detector, std::size_t inputs)
      : reference(clock_reference),
        train(pattern),
        scene(scene_options),
        shape(configured_pulse(pattern, pulse)),
        is_width_fitted(pulse.width == PulseWidth::fitted),
        frame(train, max_photons, FrameSearch::reach_ns(scene, *shape, frame_length_ms * 1e6)),
        dead_time(dead_time_of(detector, options, inputs, max_photons)),
        search(pattern, train, *shape, scene, options, frame_length_ms * 1e6, max_photons,
               dead_time_of(detector, options, inputs, max_photons)),
        target_fit(search, *shape, train, scene.motion, is_width_fitted, dead_time.has_value(),
                   max_photons) {
    if (options.method == Method::paper) {
      by_paper = std::make_unique<paper::PaperMethod>(pattern, *shape, scene);
    }
    if (options.findings == FindingsWanted::on) {
      checks = std::make_unique<checks::FrameChecks>(
          train, *shape, max_photons, dead_time ? detector.dead_time_ns : 0, frame.reach_ns());
    }
    if (scene.targets > 1) {
      several = std::make_unique<selection::TargetSelection>(
          search.targets(), search.acceleration(), train, *shape,
          selection::SelectionScope{search.curved_threshold_nats(),
                                    static_cast<std::size_t>(scene.targets), is_width_fitted,
                                    dead_time.has_value()},
          max_photons);
    }
  }

  [[nodiscard]] std::optional<DeadIntervals> dead_time_of(const DetectorOptions& detector,
                                                          const EstimatorOptions& options,
                                                          std::size_t inputs,
                                                          std::size_t max_photons) const {
    const bool is_modelled = detector.dead_time == DeadTime::modelled &&
                             detector.dead_time_ns > 0 && options.method == Method::search;
    if (!is_modelled) return std::nullopt;
    return DeadIntervals(train, detector.dead_time_ns, inputs, max_photons, frame.reach_ns());
  }
  // From a delay in the pattern's clock to that delay in the clock that is taken to be right.
  [[nodiscard]] double to_reference() const {
    return reference == ClockReference::tagger ? frame.scale : 1;
  }

  Estimate estimate(const FrameView& view, TargetTrack* track, Effort most) {
    Estimate estimate;
    if (!fold(view, estimate)) return estimate;
    const std::optional<Found> found = find(view, track, most);
    report_light(estimate);
    if (!found) return estimate;
    estimate.threshold_nats = found->threshold_nats;
    estimate.significance_nats = found->targets[0].gain_nats;
    estimate.findings = found->verdicts[0].found;
    const bool is_none = found->best.model.count == 1 && found->is_no_target();
    if (is_none || !found->is_target) return estimate;
    report(view, *found, estimate);
    if (checks && has_recent_findings) estimate.recent_findings = checks->sum_up(frame);
    if (track != nullptr) search.remember(frame, view.mid_ps(), estimate, *track);
    return estimate;
  }

  // Fold: returns whether there is anything to look at.
  bool fold(const FrameView& view, Estimate& estimate) {
    estimate.photons = view.photons_ps.size();
    estimate.threshold_nats = search.threshold_nats();
    const double seen_ns = view.seen_ns();
    if (seen_ns > 0) estimate.background_per_ns = static_cast<double>(estimate.photons) / seen_ns;
    estimate.status = view.sync.locked ? FrameStatus::no_target : FrameStatus::no_sync;
    if (!view.sync.locked || estimate.photons == 0 || seen_ns <= 0) return false;
    frame.fold(view, train);
    frame.dead = dead_time && dead_time->find(view, train) ? &*dead_time : nullptr;
    return true;
  }

  // Where the light is that of no target, there may be one beside it.
  std::optional<Found> find(const FrameView& view, TargetTrack* track, Effort most) {
    std::optional<Found> found = look_for(view, track, most);
    if (!found || !found->verdicts[0].is_foreign) return found;
    if (frame.dead != nullptr || found->best.model.count > 1) return found;
    const auto stray = checks->take_stray_light(frame, found->best.track());
    if (!stray) return found;
    std::optional<Found> beside = look_for(view, nullptr, most);
    if (!beside || !beside->is_target || beside->is_no_target()) {
      checks->put_back(frame);
      return found;
    }
    beside->verdicts[0].found.add(*stray);
    return beside;
  }

  std::optional<Found> look_for(const FrameView& view, TargetTrack* track, Effort most) {
    Look look = track != nullptr && !by_paper             ? Look::follow
                : search.must_accelerate(frame.length_ns) ? Look::curved
                                                          : Look::straight;
    std::optional<Found> best;
    while (true) {
      std::optional<Found> found = find_by(look, view, track, most);
      const bool is_better =
          found &&
          (!best || !best->is_target || look != Look::curved ||
           (found->is_target && found->best.gain_nats >= best->best.gain_nats + likely_nats));
      if (is_better) best = found;
      const Look next = look_after(look, best, track);
      if (track != nullptr)
        track->followed = look == Look::follow && next == look ? track->followed + 1 : 0;
      if (next == look) return best;
      look = next;
    }
  }

  // The look that follows where one has not settled the frame; the same one where none does. What
  // the model does not explain is looked for along more paths.
  [[nodiscard]] Look look_after(Look look, const std::optional<Found>& found,
                                const TargetTrack* track) const {
    const bool is_target = found && found->is_target;
    if (look == Look::follow) {
      const Look next = search.must_accelerate(frame.length_ns) ? Look::curved : Look::straight;
      if (!is_target || found->has_findings()) return next;
      return FrameSearch::has_changed(*track, found->best) ? next : look;
    }
    if (look == Look::curved || !search.may_accelerate()) return look;
    if (search.accelerates_little(frame.length_ns)) {
      return is_target && found->start.at.gain_nats > search.settled_nats() ? look : Look::curved;
    }
    return is_target && checks && !found->has_findings() ? look : Look::curved;
  }

  std::optional<Found> find_by(Look look, const FrameView& view, const TargetTrack* track,
                               Effort most) {
    const std::optional<Start> start = start_by(look, view, track, most);
    if (!start) return std::nullopt;
    Found found{target_fit.fit(look, *start, frame), {}, {}};
    found.targets[0] = {found.best.gain_nats, found.odds_nats};
    if (!found.is_target) return found;
    select(found, most);
    if (checks) found.verdicts = checks->judge(view, frame, found.best, found.track_terms);
    return found;
  }

  // Search.
  std::optional<Start> start_by(Look look, const FrameView& view, const TargetTrack* track,
                                Effort most) {
    if (by_paper) return by_paper->start(view, frame, search);
    if (look == Look::follow) return search.follow(frame, *track, view.mid_ps(), to_reference());
    return look == Look::curved ? search.curved(frame, most) : search.straight(frame, most);
  }

  // Select: the targets beside the first one.
  void select(Found& found, Effort most) {
    if (!several) return;
    // Beside a target at rest another one may move.
    const std::size_t terms = std::max<std::size_t>(found.track_terms, search.moves() ? 2 : 1);
    const selection::Selection& selected = several->select(frame, found.best, terms, most);
    if (selected.count < 2) return;
    found.track_terms = terms;
    if (!search.moves() && several->gain_by_moving_nats() > certain_nats) {
      found.is_target = false;
      return;
    }
    found.best = selected.best;
    found.targets = selected.targets;
  }

  // Report: the light as it is if none of the photons is from a target.
  void report_light(Estimate& estimate) const {
    estimate.dead_time_modelled = frame.dead != nullptr;
    estimate.blind_fraction = frame.dead_ns() / frame.seen_ns;
    estimate.background_per_ns =
        static_cast<double>(estimate.photons) / frame.seen_ns / (1 - estimate.blind_fraction);
  }

  void report(const FrameView& view, const Found& found, Estimate& estimate) {
    const std::size_t count = found.best.model.count;
    estimate.target_count = count > 1 ? count : 0;
    for (std::size_t k = count; k-- > 0;) {
      report_target(view, found, k, estimate);
      if (count > 1) estimate.targets.at(k) = estimate.first_target();
    }
    if (is_width_fitted) fill_width(estimate, found.best, shape->width_ns());
    if (frame.dead != nullptr) {
      estimate.low_by_split = low_by_split(view, estimate, train);
      widen_by_flicker(view, train, frame.dead->share, estimate);
    }
  }

  void report_target(const FrameView& view, const Found& found, std::size_t k, Estimate& estimate) {
    const checks::Verdict& verdict = found.verdicts.at(k);
    fill_values(estimate, found.best, k, verdict.wider,
                {frame.length_ns, search.told_apart_ns(), to_reference()}, view.sync);
    estimate.significance_nats = found.targets.at(k).gain_nats;
    estimate.range_odds_nats = found.targets.at(k).range_odds_nats;
    estimate.findings = verdict.found;
    const bool is_sure = estimate.range_odds_nats >= search.least_odds_nats() &&
                         !verdict.is_doubtful && !verdict.is_no_target(found.threshold_nats);
    estimate.status = search.is_periodic() || !is_sure ? FrameStatus::ambiguous : FrameStatus::ok;
  }
};

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

void FrameEstimator::leave_out_recent_findings() { workspace_->has_recent_findings = false; }
FrameEstimator::~FrameEstimator() = default;
FrameEstimator::FrameEstimator(FrameEstimator&&) noexcept = default;

Estimate FrameEstimator::estimate(const FrameView& view, TargetTrack* track, Effort most) {
  return workspace_->estimate(view, track, most);
}

}  // namespace splid
