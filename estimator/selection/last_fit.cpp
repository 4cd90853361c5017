#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/selection/target_selection.hpp"

namespace splid::selection {
namespace {

// The first targets of a maximum, whose covariance stays that of all.
Maximum first_of(const Maximum& all, std::size_t count) {
  const auto own = static_cast<Eigen::Index>(likelihood::width_place(count));
  constexpr Eigen::Index others = 2;  // width and background
  Maximum first = all;
  first.model.count = count;
  first.covariance = SmallMatrix(own + others, own + others);
  first.covariance << all.covariance.topLeftCorner(own, own),
      all.covariance.topRightCorner(own, others), all.covariance.bottomLeftCorner(others, own),
      all.covariance.bottomRightCorner(others, others);
  return first;
}

}  // namespace

// The last fit, and the gain of each target in it. Targets that do not gain enough are left out.
void TargetSelection::finish() {
  while (true) {
    all_ = maximize(all_.model, likelihood::Maximizer::exact_nats);
    try_other_places();
    sort_by_signal();
    std::size_t weakest = 0;
    for (std::size_t k = 0; k < all_.model.count; ++k) {
      selection_.targets[k].gain_nats = gain_of(k);
      if (selection_.targets[k].gain_nats < selection_.targets[weakest].gain_nats) weakest = k;
    }
    if (all_.has_covariance && selection_.targets[weakest].gain_nats >= scope_.threshold_nats) {
      break;
    }
    drop(weakest);
    if (all_.model.count == 1) return;
  }
  selection_.count = std::min(all_.model.count, scope_.targets);
  for (std::size_t k = 0; k < selection_.count; ++k) {
    selection_.targets[k].range_odds_nats = range_odds_nats(k);
  }
  selection_.best = first_of(all_, selection_.count);
}

void TargetSelection::sort_by_signal() {
  constexpr auto own = static_cast<Eigen::Index>(likelihood::of_target);
  const std::span targets = std::span(all_.model.targets).first(all_.model.count);
  auto& C = all_.covariance;
  for (std::size_t k = 0; k < targets.size(); ++k) {
    const auto brightest = std::max_element(
        targets.begin() + static_cast<std::ptrdiff_t>(k), targets.end(),
        [](const Target& a, const Target& b) { return a.signal_per_pulse < b.signal_per_pulse; });
    const auto m = static_cast<std::size_t>(brightest - targets.begin());
    if (m == k) continue;
    std::swap(targets[k], targets[m]);
    std::swap(members_[k], members_[m]);
    std::swap(pair_odds_nats_[k], pair_odds_nats_[m]);
    const auto x = own * static_cast<Eigen::Index>(k), y = own * static_cast<Eigen::Index>(m);
    C.middleRows(x, own).swap(C.middleRows(y, own));
    C.middleCols(x, own).swap(C.middleCols(y, own));
  }
}

// Puts targets where their light is as well, and notes by how much that is the worse. Two alike
// whose delays differ by a multiple of 9 ns make two more whole combs of 180 and 189 ns
// (CombMeetings), and the two pairs differ in one pulse of 41. A weaker one that has its pulses of
// one rate where a brighter one has such pulses was seen by its other rate alone, and is then found
// at any multiple of that rate's period. Of three targets and more, several may have to change
// places.
void TargetSelection::try_other_places() {
  for (std::size_t round = 0; round < most_targets; ++round) {
    const Maximum found = all_;
    pair_odds_nats_ = {};
    for (std::size_t k = 0; k < found.model.count; ++k) {
      for (std::size_t m = k + 1; m < found.model.count; ++m) try_places(found, k, m);
    }
    if (all_.gain_nats <= found.gain_nats) return;
  }
}

void TargetSelection::try_places(const Maximum& found, std::size_t k, std::size_t m) {
  const Target &a = found.model.targets[k], &b = found.model.targets[m];
  if (parting_widths(a.track, b.track) > closest_widths) return;
  const double less = std::min(a.signal_per_pulse, b.signal_per_pulse);
  const double more = std::max(a.signal_per_pulse, b.signal_per_pulse);
  const CombMeetings::Places places = search_.meetings().find(a.track.delay_ns, b.track.delay_ns);
  const auto delays_ns = places.delays_ns();
  const auto at = [&](double delay_ns, double signal_per_pulse) {
    return Target{{delay_ns, (a.track.walk_ns + b.track.walk_ns) / 2,
                   (a.track.quadratic_ns + b.track.quadratic_ns) / 2},
                  signal_per_pulse};
  };
  for (std::size_t n = 0; n < delays_ns.size(); ++n) {
    Model moved = found.model;
    moved.targets[a.signal_per_pulse < b.signal_per_pulse ? k : m] = at(delays_ns[n], less);
    try_model(moved, found, k, m);
    for (std::size_t i = 0; i < n && less >= strong_side_lobe * more; ++i) {
      Model other = found.model;
      other.targets[k] = at(delays_ns[n], (less + more) / 2);
      other.targets[m] = at(delays_ns[i], (less + more) / 2);
      try_model(other, found, k, m);
    }
  }
}

void TargetSelection::try_model(const Model& other, const Maximum& found, std::size_t k,
                                std::size_t m) {
  const Maximum there =
      maximizer_.maximize(other, {likelihood::free_set(other.count, terms_, scope_.is_width_free),
                                  found.gain_nats - TargetSearch::no_doubt_nats});
  if (!there.has_covariance && there.stop != Stop::beaten) return;
  const double odds_nats = std::abs(there.gain_nats - found.gain_nats);
  for (auto* odds : {&pair_odds_nats_[k], &pair_odds_nats_[m]}) {
    *odds = std::min(odds_nats, odds->value_or(odds_nats));
  }
  if (there.has_covariance && there.gain_nats > all_.gain_nats) all_ = there;
}

// What a target adds: the others keep their tracks.
double TargetSelection::gain_of(std::size_t target) {
  Model without = all_.model;
  likelihood::FreeSet rates;
  rates.set(likelihood::background_place(without.count));
  for (std::size_t k = 0; k < without.count; ++k) {
    if (k != target) rates.set(likelihood::place_of(k, likelihood::signal));
  }
  without.targets[target].signal_per_pulse = 1e-30;  // 0 would be fitted
  const Maximum rest = maximizer_.maximize(
      without, {.free = rates, .enough_nats = likelihood::Maximizer::compared_nats});
  return all_.gain_nats - rest.gain_nats;
}

// How sure a target's range is, against all places but those of the others. The odds of the search
// that has seen it grow as the gain does. A target that no search has seen is looked at in the
// frame without the others.
double TargetSelection::range_odds_nats(std::size_t target) {
  const Target& own = all_.model.targets[target];
  lines_.clear();
  for (std::size_t k = 0; k < all_.model.count; ++k) {
    if (k == target) continue;
    const DelayTrack& other = all_.model.targets[k].track;
    lines_.push_back(other);
    if (!pair_odds_nats_[target] || parting_widths(own.track, other) > closest_widths) continue;
    const auto places = search_.meetings().find(own.track.delay_ns, other.delay_ns);
    for (const double delay_ns : places.delays_ns()) {
      lines_.push_back({delay_ns, own.track.walk_ns});
    }
  }
  const double gain_nats = selection_.targets[target].gain_nats;
  double odds_nats = 0;
  if (const auto* search = searched_about(target)) {
    const double odds_of_search = search->peaks.range_odds_nats(search->fit, lines_);
    odds_nats = odds_of_search * std::min(1.0, gain_nats / search->fit.gain_nats);
  } else {
    const FoldedFrame* rest = &thinning_.rest(*frame_, all_.model, target);
    if (own.track.quadratic_ns != 0 && acceleration_ != nullptr) {
      rest = &acceleration_->straightened(*rest, own.track.quadratic_ns);
    }
    const Maximum fit = search_.judge(
        *rest, likelihood::model_of({own.track.delay_ns, own.track.walk_ns}, own.signal_per_pulse,
                                    all_.model.background_per_ns));
    odds_nats = search_.range_odds_in(*rest, fit).value_or(0);
  }
  return std::min(odds_nats, pair_odds_nats_[target].value_or(odds_nats));
}

// The search that has seen a target best, alone or as one with another; null where what it saw was
// little of it.
const TargetSearch::Search* TargetSelection::searched_about(std::size_t target) const {
  constexpr double least_seen = 0.5;
  const DelayTrack& own = all_.model.targets[target].track;
  const TargetSearch::Search* best = nullptr;
  double most_nats = least_seen * selection_.targets[target].gain_nats;
  for (std::size_t k = 0; k < all_.model.count; ++k) {
    const Maximum& seen = members_[k].search.fit;
    if (!(seen.gain_nats > most_nats)) continue;
    if (apart_widths(seen.track(), own) > pulse_reach_widths) continue;
    most_nats = seen.gain_nats;
    best = &members_[k].search;
  }
  return best;
}

double TargetSelection::gain_by_moving_nats() {
  const Maximum moving = maximizer_.maximize(
      all_.model, {.free = likelihood::free_set(all_.model.count, 2, scope_.is_width_free),
                   .enough_nats = likelihood::Maximizer::compared_nats});
  return moving.gain_nats - all_.gain_nats;
}

}  // namespace splid::selection
