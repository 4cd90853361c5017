#include <algorithm>
#include <cmath>

#include "estimator/selection/target_selection.hpp"
#include "estimator/sync/deviations.hpp"

namespace splid::selection {

// A target far from all others that the first search has come by, and that is no side lobe of them:
// it is as high in what is left.
std::optional<Target> TargetSelection::find_seen(const FoldedFrame& rest) {
  if (terms_ == 3) return std::nullopt;
  const auto place = seen_beside();
  if (!place || place->gain_nats < scope_.threshold_nats + plain_margin_nats) return std::nullopt;
  const Maximum there = search_.find_near(rest, place->line);
  if (!there.has_covariance || there.gain_nats < strong_side_lobe * place->gain_nats ||
      !is_plain(there.model.targets[0], there.gain_nats)) {
    return std::nullopt;
  }
  const Maximum fit = search_.look_beside(rest, there);
  search_.keep(fit, members_[all_.model.count].search);
  return fit.model.targets[0];
}

// The strongest place of the searches so far that is not at one of the targets.
std::optional<RangeOdds::Place> TargetSelection::seen_beside() {
  lines_.clear();
  for (std::size_t k = 0; k < all_.model.count; ++k) lines_.push_back(all_.model.targets[k].track);
  std::optional<RangeOdds::Place> best;
  for (std::size_t k = 0; k < all_.model.count; ++k) {
    const auto place = members_[k].search.peaks.odds.best_beside(lines_);
    if (place && (!best || place->gain_nats > best->gain_nats)) best = place;
  }
  return best;
}

// The best place of what is left, with its search among the members.
std::optional<Target> TargetSelection::find_next(const FoldedFrame& rest, Effort most) {
  TargetSearch::Search& search = members_[all_.model.count].search;
  if (acceleration_ != nullptr && terms_ == 3) {
    const auto curved = acceleration_->find(rest, most);
    if (!curved || !curved->best.has_covariance) return std::nullopt;
    search_.keep(curved->straight, search);
    return curved->best.model.targets[0];
  }
  const std::optional<Maximum> fit = search_.find(rest, most, Effort::balanced);
  if (!fit || !fit->has_covariance) return std::nullopt;
  search_.keep(*fit, search);
  return fit->model.targets[0];
}

// The best maximum of two in place of one whose photons are spread as those of two; it has no
// covariance where there is none.
Maximum TargetSelection::best_split(bool is_early) {
  refine();
  Maximum best;
  for (std::size_t k = 0; k < all_.model.count; ++k) {
    const auto pair = pair_about(k);
    if (!pair) continue;
    Model with = all_.model;
    with.targets[k] = pair->front();
    with.add(pair->back());
    if (is_early && maximizer_.judge(with, {}).gain_nats < all_.gain_nats + scope_.threshold_nats) {
      continue;
    }
    const Maximum split = maximize(with, likelihood::Maximizer::compared_nats);
    const bool is_best = !best.has_covariance || split.gain_nats >= best.gain_nats;
    if (split.has_covariance && is_best) best = split;
  }
  if (best.has_covariance) search_.keep({}, members_[all_.model.count].search);
  return best;
}

// Whether a pair is two targets for sure: as bright as each other, so that neither is a side lobe
// of a third or what a pulse leaves over.
bool TargetSelection::is_plain_pair(const Maximum& pair) const {
  if (!pair.has_covariance) return false;
  const Target &a = pair.model.targets[0], &b = pair.model.targets[1];
  return std::min(a.signal_per_pulse, b.signal_per_pulse) >=
             strong_side_lobe * std::max(a.signal_per_pulse, b.signal_per_pulse) &&
         (apart_widths(a.track, b.track) >= closest_widths ||
          parting_widths(a.track, b.track) >= crossing_widths);
}

// Two of equal signals in place of a target. Two at +-(d + t s) about their middle
// spread the offsets o of photons, beyond the pulse's width and the background, to the moments
//   <o o> = d d + t t / 12,   <o o s> = d t / 6,   <o o s s> - <o o> / 12 = t t / 180.
std::optional<std::array<Target, 2>> TargetSelection::pair_about(std::size_t target) {
  constexpr double reach_widths = 7;
  constexpr double least_widths = 0.6;
  const Model& known = all_.model;
  const double width_ns = shape_.width_ns() * std::exp(known.log_width);
  const double reach_ns = reach_widths * width_ns;
  likelihood::LogLikelihood& likelihood = maximizer_.likelihood();
  if (!likelihood.serves(known)) likelihood.collect(known, NearSet::gathered_from);
  const NearSet& near = likelihood.near().near(target);
  const Target& one = known.targets[target];
  const double S = one.signal_per_pulse;
  const double dark =
      known.background_per_ns * likelihood.exposure().seen_ns * train_.pulses_per_ns * 2 * reach_ns;
  double photons = -dark, o1 = 0, os = 0, oo = 0, oos = 0, ooss = 0;
  for (std::size_t n = 0; n < near.photons(); ++n) {
    for (std::size_t j = near.first[n]; j < near.first[n + 1]; ++j) {
      const double s = near.position[j], w = near.weight[n];
      const double o =
          near.residual_ns[j] - (one.track.at(s) - near.track.at(s)) - shape_.peak_offset_ns();
      if (std::abs(o) > reach_ns) continue;
      photons += w, o1 += w * o, os += w * o * s;
      oo += w * o * o, oos += w * o * o * s, ooss += w * o * o * s * s;
    }
  }
  photons = std::max(photons, 1.0);
  const double off_ns = o1 / photons, turn_ns = terms_ > 1 ? 12 * os / photons : 0;
  const double square = (oo - dark * reach_ns * reach_ns / 3) / photons - width_ns * width_ns -
                        off_ns * off_ns - turn_ns * turn_ns / 12;
  const double cross = oos / photons - off_ns * turn_ns / 6;
  const double bow = (ooss - oo / 12) / photons - turn_ns * turn_ns / 180;
  DelayTrack middle = one.track;
  middle.delay_ns += off_ns, middle.walk_ns += turn_ns;
  const double t = terms_ > 1 ? std::sqrt(std::max(0.0, 180 * bow)) : 0;
  const double d = std::sqrt(std::max(0.0, square - t * t / 12));
  if (in_quadrature(d, t / std::sqrt(12.0)) < least_widths * width_ns) return std::nullopt;
  const double turn = cross < 0 ? -t : t;
  std::array<Target, 2> pair = {Target{middle, S / 2}, Target{middle, S / 2}};
  pair[0].track.delay_ns -= d, pair[0].track.walk_ns -= turn;
  pair[1].track.delay_ns += d, pair[1].track.walk_ns += turn;
  return pair;
}

}  // namespace splid::selection
