#include "estimator/selection/target_selection.hpp"

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
  TargetSearch::Search& search = members_[all_.model.count].search;
  search.fit = search_.look_beside(rest, there);
  search_.keep_peaks(search.peaks);
  return search.fit.model.targets[0];
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
    search.fit = curved->straight;
    search_.keep_peaks(search.peaks);
    return curved->best.model.targets.front();
  }
  const std::optional<Maximum> fit = search_.find(rest, most, Effort::balanced);
  if (!fit || !fit->has_covariance) return std::nullopt;
  search.fit = *fit;
  search_.keep_peaks(search.peaks);
  return fit->model.targets[0];
}

}  // namespace splid::selection
