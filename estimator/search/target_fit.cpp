#include "estimator/search/target_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimator/model/chance.hpp"

namespace splid {

TargetFit::TargetFit(FrameSearch& search, const PulseShape& shape, const PulseTrain& train,
                     Motion motion, bool is_width_fitted, bool may_be_dead, std::size_t max_photons)
    : search_(search), motion_(motion), width_ns_(shape.width_ns()) {
  if (!is_width_fitted) return;
  wide_.emplace(shape, train, max_photons, likelihood::Scope{1, most_width, may_be_dead});
}

likelihood::Maximum TargetFit::maximum_with(const likelihood::Model& model, std::size_t track_terms,
                                            bool width_too) {
  likelihood::Maximizer& maximizer = width_too ? *wide_ : search_.targets().maximizer();
  maximizer.begin(*frame_);
  likelihood::Maximum best =
      maximizer.maximize(model, {likelihood::free_set(model.count, track_terms, width_too)});
  if (!search_.is_possible(best.track(), frame_->length_ns)) best.has_covariance = false;
  return best;
}

FittedTarget TargetFit::fit(Look look, const Start& start, const FoldedFrame& frame) {
  frame_ = &frame;
  FittedTarget target;
  target.start = start;
  fit_path(look, target);
  target.threshold_nats =
      target.track_terms == 3 ? search_.curved_threshold_nats() : search_.threshold_nats();
  target.odds_nats = start.odds_nats;
  target.is_target = target.best.gain_nats >= target.threshold_nats && target.best.has_covariance;
  if (!target.is_target) return target;
  if (target.track_terms == 3) {
    // The prior of a path is spread over all quadratic terms.
    const double variance = target.best.covariance(likelihood::quadratic, likelihood::quadratic);
    const double most_ns = search_.acceleration()->max_quadratic_ns(frame.length_ns);
    const double share = std::sqrt(2 * std::numbers::pi * variance) / most_ns / 2;
    target.odds_nats += std::min(0.0, std::log(share));
  }
  // The deviations of a fit at rest would be far too small where the photons say that it moves.
  const DelayTrack& track = target.best.track();
  if (!search_.moves() &&
      search_.targets().fit(frame, {track.delay_ns, track.walk_ns}, 2).gain_nats >
          target.best.gain_nats + certain_nats) {
    target.is_target = false;
  }
  if (wide_ && target.is_target) fit_width(target);
  return target;
}

void TargetFit::fit_path(Look look, FittedTarget& target) {
  const bool is_curved = motion_ == Motion::accelerating && search_.may_accelerate();
  target.track_terms = is_curved ? 3 : search_.moves() ? 2 : 1;
  const Start& start = target.start;
  if (is_curved) {
    target.best = maximum_with(start.at.model, target.track_terms);
  } else if (look != Look::curved) {
    target.best = start.is_exact ? start.at : maximum_with(start.at.model, 2);
  }
  if (motion_ == Motion::automatic && search_.moves()) fit_richer_path(look, target);
}

// Motion `auto`: the target accelerates, or moves, where the photons say so at three deviations.
void TargetFit::fit_richer_path(Look look, FittedTarget& target) {
  const double straight_nats = look == Look::curved ? 0 : target.best.gain_nats;
  if (search_.may_accelerate()) {
    const likelihood::Maximum curved = maximum_with(target.start.at.model, 3);
    const double least_nats =
        std::max(search_.curved_threshold_nats(), straight_nats + likely_nats);
    if (look == Look::curved || (curved.has_covariance && curved.gain_nats >= least_nats)) {
      target.best = curved;
      target.track_terms = 3;
      return;
    }
  }
  const DelayTrack& track = target.best.track();
  const double walk_ns = target.best.has_covariance ? track.walk_ns : 0;
  if (std::abs(walk_ns) >
      sure_deviations * std::sqrt(target.best.covariance(likelihood::walk, likelihood::walk)))
    return;
  const likelihood::Maximum rest = search_.targets().fit(*frame_, {track.delay_ns}, 1);
  if (target.best.gain_nats - rest.gain_nats >= likely_nats) return;
  target.best = rest;
  target.track_terms = 1;
}

// Where photons do not tell the width, it stays as configured.
void TargetFit::fit_width(FittedTarget& target) {
  const likelihood::Maximum fitted = maximum_with(target.best.model, target.track_terms, true);
  if (!fitted.has_covariance || std::abs(fitted.model.log_width) > std::log(most_width) - 1e-3) {
    return;
  }
  const double gain_nats = target.best.gain_nats;
  target.best = fitted;
  target.best.gain_nats = gain_nats;  // the threshold is that of a pulse as configured
}

}  // namespace splid
