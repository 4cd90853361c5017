#include "estimator/array/rigid_scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/model/chance.hpp"
#include "estimator/model/units.hpp"

namespace splid::array {
namespace {

// A body that turns has three terms; more pixels than that must tell them.
constexpr std::size_t least_turning = 6;

SceneOptions resting(SceneOptions scene) {
  scene.motion = Motion::static_target;
  return scene;
}

SceneOptions straight(SceneOptions scene) {
  scene.motion = Motion::moving;
  scene.targets = 1;
  return scene;
}

// 1, and the place in the field from its middle.
std::vector<Terms> rows_of(std::span<const PixelDirection> directions) {
  PixelDirection middle;
  const auto count = static_cast<double>(directions.size());
  for (const PixelDirection& direction : directions) {
    middle.azimuth_deg += direction.azimuth_deg / count;
    middle.elevation_deg += direction.elevation_deg / count;
  }
  std::vector<Terms> rows;
  for (const PixelDirection& direction : directions) {
    rows.emplace_back(1, direction.azimuth_deg - middle.azimuth_deg,
                      direction.elevation_deg - middle.elevation_deg);
  }
  return rows;
}

bool has_value(const Estimate& estimate) {
  return estimate.has_values && estimate.std_velocity_mps > 0 && estimate.std_delay_ns > 0;
}

}  // namespace

RigidScene::RigidScene(const Pattern& pattern, const PulseOptions& pulse, const SceneOptions& scene,
                       const EstimatorOptions& options, double frame_length_ms,
                       std::size_t max_photons, std::span<const PixelDirection> directions,
                       ClockReference reference, const DetectorOptions& detector)
    : reference_(reference),
      max_speed_mps_(scene.max_speed_mps),
      train_(pattern),
      shape_(configured_pulse(pattern, pulse)),
      least_odds_nats_(odds_at_risk_nats(options.range_risk)),
      rows_(rows_of(directions)),
      at_rest_(pattern, pulse, resting(scene), options, frame_length_ms, max_photons, reference,
               detector),
      folded_(train_, max_photons, FrameSearch::reach_ns(scene, *shape_, frame_length_ms * 1e6)),
      search_(pattern, train_, *shape_, straight(scene), options, frame_length_ms * 1e6,
              max_photons, std::nullopt),
      shared_fit_(train_, *shape_, max_photons,
                  FrameSearch::reach_ns(scene, *shape_, frame_length_ms * 1e6)) {
  votes_.reserve(rows_.size() * DelayVelocitySearch::max_cells);
  members_.reserve(rows_.size());
  cells_.reserve(DelayVelocitySearch::max_cells);
}

std::size_t RigidScene::estimate(const RigidFrame& frame) {
  std::fill(frame.bodies.begin(), frame.bodies.end(), -1);
  std::size_t bodies = 0;
  while (bodies < most_bodies) {
    const std::optional<SharedVelocity> shared = choose(frame);
    if (!shared || !fit(frame, shared->velocity)) break;
    if (report(frame, static_cast<int>(bodies)) < 2) break;
    ++bodies;
  }
  return bodies;
}

std::optional<SharedVelocity> RigidScene::choose(const RigidFrame& frame) {
  vote_alone(frame);
  auto shared = most_voted(votes_, max_speed_mps_);
  if (shared && shared->odds_nats >= least_odds_nats_) return shared;
  vote_by_cells(frame);
  shared = most_voted(votes_, max_speed_mps_);
  if (shared && shared->odds_nats >= least_odds_nats_) return shared;
  return std::nullopt;
}

void RigidScene::vote_alone(const RigidFrame& frame) {
  votes_.clear();
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const Estimate& own = frame.estimates[k];
    if (!is_open(frame, k) || !has_value(own)) continue;
    votes_.push_back({k,
                      {own.velocity_mps, own.std_velocity_mps},
                      evidence_nats(own.significance_nats, own.std_delay_ns, train_.circle_ns)});
  }
}

void RigidScene::vote_by_cells(const RigidFrame& frame) {
  votes_.clear();
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    if (is_open(frame, k)) add_cells(frame.frames[k], k);
  }
}

// A vote for the maximum near each of the best cells of a pixel.
void RigidScene::add_cells(const FrameView& view, std::size_t pixel) {
  constexpr auto D = static_cast<Eigen::Index>(likelihood::delay);
  constexpr auto W = static_cast<Eigen::Index>(likelihood::walk);
  TargetSearch& search = search_.targets();
  folded_.fold(view, train_);
  const auto best = search.cells(folded_, search.level(search.levels(Effort::balanced) - 1));
  cells_.assign(best.begin(), best.end());
  for (const SearchCell& cell : cells_) {
    const likelihood::Maximum fit = search.find_near(
        folded_, {cell.line.delay_ns - shape_->peak_offset_ns(), cell.line.walk_ns});
    if (!fit.has_covariance || !(fit.gain_nats > 0)) continue;
    const double g = fit.track().walk_ns / folded_.length_ns;
    const double per_walk = 2 * speed_of_light_mps / ((2 - g) * (2 - g) * folded_.length_ns);
    const Velocity velocity = {speed_of_light_mps * g / (2 - g),
                               std::sqrt(fit.covariance(W, W)) * per_walk};
    const double std_ns = std::sqrt(fit.covariance(D, D)) * folded_.scale;
    const auto same = [&](const Vote& other) {
      return other.pixel == pixel &&
             std::abs(other.velocity.mps - velocity.mps) < velocity.std_mps / 100;
    };
    if (std::any_of(votes_.begin(), votes_.end(), same)) continue;
    votes_.push_back({pixel, velocity, evidence_nats(fit.gain_nats, std_ns, train_.circle_ns)});
  }
}

// Fits the velocity of the body that moves like `start`.
bool RigidScene::fit(const RigidFrame& frame, const Velocity& start) {
  take_members(frame, start);
  if (members_.size() < 2) return false;
  Terms at(start.mps, 0, 0);
  if (!keep_fitting(1, at)) return false;
  if (members_.size() < least_turning || shared_.more_nats < certain_nats) return true;
  return keep_fitting(most_terms, at);
}

bool RigidScene::keep_fitting(Eigen::Index terms, Terms& at) {
  shared_ = shared_fit_.fit(members_, terms, at);
  at = shared_.terms;
  return shared_.has_covariance;
}

// The pixels that show the velocity alone, and those that show a target when it is known.
void RigidScene::take_members(const RigidFrame& frame, const Velocity& about) {
  members_.clear();
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const FrameView& view = frame.frames[k];
    if (!is_open(frame, k)) continue;
    const Estimate& own = frame.estimates[k];
    const bool agrees =
        has_value(own) && std::abs(own.velocity_mps - about.mps) <
                              sure_deviations * in_quadrature(own.std_velocity_mps, about.std_mps);
    if (agrees) {
      add_member(frame, k, own, view);
      continue;
    }
    const FrameView still = at_rest(view, about.mps);
    const Estimate known = at_rest_.estimate(still);
    const bool leaves =
        has_value(own) && own.significance_nats > known.significance_nats + certain_nats;
    if (!leaves && known.has_values) add_member(frame, k, known, still);
  }
}

void RigidScene::add_member(const RigidFrame& frame, std::size_t pixel, const Estimate& estimate,
                            const FrameView& view) {
  SharedPixel member;
  member.pixel = pixel;
  member.frame = &frame.frames[pixel];
  member.row = rows_[pixel];
  member.delay_ns = pattern_delay_ns(estimate, view, train_.period_ns, reference_);
  member.signal_per_pulse = estimate.signal_per_pulse;
  member.background_per_ns = estimate.background_per_ns;
  members_.push_back(member);
}

Velocity RigidScene::velocity_of(std::size_t pixel, const SyncFit& sync) const {
  const Terms& row = rows_[pixel];
  const double variance = row.dot(shared_.covariance * row);
  return {shared_.terms.dot(row),
          in_quadrature(std::sqrt(variance),
                        speed_of_light_mps * sync.std_period_ps / sync.period_ps / 2)};
}

// At the body's velocity a pixel is looked at where the fit has its delay, and searched where the
// likelihood asks for it. The odds of the range are those that the pixel has alone, if it has.
TargetTrack RigidScene::where_fitted(const SharedPixel& member, const FrameView& still,
                                     const Estimate& own) const {
  const double scale = still.sync.period_ps * ns_per_ps / train_.period_ns;
  TargetTrack track;
  track.valid = true;
  track.mid_ps = still.mid_ps();
  track.delay_ns = member.delay_ns * (reference_ == ClockReference::tagger ? scale : 1);
  track.std_signal_per_pulse = std::numeric_limits<double>::infinity();
  if (own.status == FrameStatus::ok) {
    track.odds_per_nat = own.range_odds_nats / own.significance_nats;
  }
  return track;
}

// Estimates all pixels at the body's velocity. Those that show a target so, and none that is better
// alone, see the body. Returns how many.
std::size_t RigidScene::report(const RigidFrame& frame, int body) {
  std::size_t members = 0;
  auto fitted = members_.begin();  // of this pixel, or of the next one that is fitted
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const FrameView& view = frame.frames[k];
    while (fitted != members_.end() && fitted->pixel < k) ++fitted;
    if (!is_open(frame, k)) continue;
    Estimate& own = frame.estimates[k];
    const Velocity velocity = velocity_of(k, view.sync);
    const FrameView still = at_rest(view, velocity.mps);
    const bool is_fitted = fitted != members_.end() && fitted->pixel == k;
    TargetTrack track = is_fitted ? where_fitted(*fitted, still, own) : TargetTrack{};
    Estimate known = at_rest_.estimate(still, is_fitted ? &track : nullptr);
    if (!known.has_values) continue;
    if (has_value(own) && own.significance_nats > known.significance_nats + certain_nats) continue;
    set_moving(known, view, velocity, reference_);
    own = known;
    frame.bodies[k] = body;
    ++members;
  }
  return members;
}

}  // namespace splid::array
