#include "estimator/search/frame_search.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "estimator/model/chance.hpp"
#include "estimator/model/units.hpp"
#include "estimator/search/significance.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

using likelihood::Maximum;

// A target that is followed gains about as much in each frame. Half of that gain is asked for: it
// leaves room for a target that fades or accelerates, and is more than a wrong delay gains at a
// side lobe of half of an interleaved comb.
constexpr double least_followed_gain = 0.5;

constexpr double longest_gap_ps = 1e12;

constexpr double most_looks = 400;  // more take seconds a frame

// Not even a million photons show a quadratic term that is less.
constexpr double least_quadratic_widths = 0.0017;

}  // namespace

double FrameSearch::max_walk_ns(const SceneOptions& scene, double length_ns) {
  const bool moves = scene.motion != Motion::static_target && scene.max_speed_mps > 0;
  return moves ? walk_ns_at(scene.max_speed_mps, length_ns) : 0;
}

double FrameSearch::reach_ns(const SceneOptions& scene, const PulseShape& shape, double length_ns) {
  return max_walk_ns(scene, length_ns) / 2 +
         std::max(std::abs(shape.first_ns()), std::abs(shape.last_ns()));
}

FrameSearch::FrameSearch(const Pattern& pattern, const PulseTrain& train, const PulseShape& shape,
                         const SceneOptions& scene, const EstimatorOptions& options,
                         double length_ns, std::size_t max_photons,
                         std::optional<DeadIntervals> dead)
    : train_(train),
      shape_(shape),
      must_accelerate_(scene.motion == Motion::accelerating),
      is_periodic_(pattern.mode == Mode::ambiguous),
      told_apart_ns_(is_periodic_ ? pattern.unambiguous_delay_ps * ns_per_ps : train.circle_ns),
      max_walk_ns_(max_walk_ns(scene, length_ns)),
      threshold_nats_(threshold_of(0, options.false_alarm_rate)),
      curved_threshold_nats_(threshold_nats_),
      least_odds_nats_(odds_at_risk_nats(options.range_risk)),
      search_(train, shape,
              {.frame_length_ns = length_ns,
               .max_walk_ns = max_walk_ns_,
               .threshold_nats = threshold_nats_,
               .volume = {told_apart_ns_, max_walk_ns_, shape.width_ns()},
               .least_odds_nats = least_odds_nats_,
               .effort = options.effort,
               .side_lobes = !is_periodic_,
               .may_be_dead = dead.has_value()},
              max_photons) {
  const bool accelerates =
      moves() && scene.max_acceleration_mps2 > 0 && options.method == Method::search &&
      (scene.motion == Motion::automatic || scene.motion == Motion::accelerating);
  if (accelerates) {
    look_for_acceleration(scene, options.false_alarm_rate, length_ns, max_photons, std::move(dead));
  }
}

// How far a delay that is looked at may range walk: fits are not held to the speeds that the search
// starts from. In a frame so short that the fastest target walks a few pulse widths, much of the
// plane that is looked at lies beyond the largest speed.
double FrameSearch::threshold_of(double quadratic_ns, double false_alarm_rate) const {
  const double width_ns = shape_.width_ns();
  const double walk_ns =
      moves() ? max_walk_ns_ + 2 * TargetSearch::least_reach_widths * width_ns : 0;
  return significance_threshold_nats({train_.circle_ns, walk_ns, width_ns, quadratic_ns},
                                     false_alarm_rate);
}

void FrameSearch::look_for_acceleration(const SceneOptions& scene, double false_alarm_rate,
                                        double length_ns, std::size_t max_photons,
                                        std::optional<DeadIntervals> dead) {
  acceleration_ = std::make_unique<AccelerationSearch>(search_, train_, shape_.width_ns(),
                                                       scene.max_acceleration_mps2, max_photons,
                                                       std::move(dead));
  const double quadratic_ns = acceleration_->max_quadratic_ns(length_ns);
  const double looks = acceleration_->looks(length_ns);
  const bool too_many = looks > most_looks;
  if (too_many && must_accelerate_) {
    std::ostringstream text;
    text << "/scene/max_acceleration_mps2: with " << scene.max_acceleration_mps2 << " a frame of "
         << length_ns * 1e-6 << " ms has " << looks << " accelerations to search; more than "
         << most_looks << " take too long: lower it, or /frame/length_ms";
    throw Error(Fault::usage, text.str());
  }
  if (too_many ||
      (!must_accelerate_ && quadratic_ns < least_quadratic_widths * shape_.width_ns())) {
    acceleration_.reset();
    return;
  }
  curved_threshold_nats_ = threshold_of(acceleration_->reach_ns(length_ns), false_alarm_rate);
}

std::optional<Start> FrameSearch::straight(const FoldedFrame& frame, Effort most) {
  const std::optional<Maximum> fit = search_.find(frame, most);
  if (!fit) return std::nullopt;
  return Start{*fit, odds_of(*fit), true};
}

Start FrameSearch::judged(const FoldedFrame& frame, const likelihood::Model& at) {
  const Maximum fit = search_.judge(frame, at);
  return {fit, odds_of(fit), true};
}

double FrameSearch::odds_of(const Maximum& fit) const {
  return fit.has_covariance ? search_.range_odds_nats(fit) : 0;
}

std::optional<Start> FrameSearch::curved(const FoldedFrame& frame, Effort most) {
  const std::optional<AcceleratedFit> found = acceleration_->find(frame, most);
  if (!found) return std::nullopt;
  return Start{found->best, odds_of(found->straight), false};
}

std::optional<Start> FrameSearch::follow(const FoldedFrame& frame, const TargetTrack& track,
                                         std::int64_t mid_ps, double scale) {
  const auto gap_ps = static_cast<double>(mid_ps - track.mid_ps);
  if (!track.valid || track.followed >= most_followed || std::abs(gap_ps) > longest_gap_ps) {
    return std::nullopt;
  }
  const double gained_mps = track.acceleration_mps2 * gap_ps * 1e-12;
  const double beta = (track.velocity_mps + gained_mps / 2) / speed_of_light_mps;  // over the gap
  const double delay_ns = track.delay_ns + 2 * beta * gap_ps * ns_per_ps;
  const double quadratic_ns = track.acceleration_mps2 / acceleration_of(1, frame.length_ns);
  const FoldedFrame& photons =
      acceleration_ ? acceleration_->straightened(frame, quadratic_ns) : frame;
  Maximum fit =
      search_.find_near(photons, {delay_ns / scale / (1 + beta) + quadratic_ns / 2,
                                  walk_ns_at(track.velocity_mps + gained_mps, frame.length_ns)});
  const double least_nats =
      std::max(least_followed_gain * track.nats_per_ns * frame.seen_ns, settled_nats());
  if (fit.gain_nats < least_nats || !fit.has_covariance) return std::nullopt;
  // A look at all delays costs as much as all else in a followed frame. It is left out where the
  // gain promises odds that leave no doubt, by those of the last searched frame.
  const double expected_nats = track.odds_per_nat * fit.gain_nats;
  const bool is_sure = expected_nats >= TargetSearch::no_doubt_nats;
  if (!is_sure) fit = search_.look_beside(photons, fit);
  const double odds_nats = search_.range_odds_nats(fit);
  Start start = {fit, is_sure ? std::min(odds_nats, expected_nats) : odds_nats, !acceleration_};
  start.at.model.targets[0].track.quadratic_ns = acceleration_ ? quadratic_ns : 0;
  return start;
}

bool FrameSearch::has_changed(const TargetTrack& track, const Maximum& now) {
  constexpr auto S = static_cast<Eigen::Index>(likelihood::signal);
  const double changed = now.signal_per_pulse() - track.signal_per_pulse;
  const double deviation =
      in_quadrature(std::sqrt(now.covariance(S, S)), track.std_signal_per_pulse);
  return std::abs(changed) > unlikely_deviations * deviation;
}

void FrameSearch::remember(const FoldedFrame& frame, std::int64_t mid_ps, const Estimate& estimate,
                           TargetTrack& track) const {
  // A range that may be wrong is not followed: the next frame is then searched over all delays.
  track.valid = estimate.range_odds_nats >= least_odds_nats_;
  track.mid_ps = mid_ps;
  track.delay_ns = estimate.delay_ns;
  track.velocity_mps = estimate.velocity_mps;
  track.acceleration_mps2 = estimate.acceleration_mps2;
  track.signal_per_pulse = estimate.signal_per_pulse;
  track.std_signal_per_pulse = estimate.std_signal_per_pulse;
  if (track.followed > 0) return;
  track.nats_per_ns = estimate.significance_nats / frame.seen_ns;
  track.odds_per_nat = estimate.range_odds_nats / estimate.significance_nats;
}

bool FrameSearch::is_possible(const DelayTrack& track, double length_ns) const {
  if (!acceleration_) return track.quadratic_ns == 0;
  return std::abs(track.quadratic_ns) <= acceleration_->reach_ns(length_ns);
}

}  // namespace splid
