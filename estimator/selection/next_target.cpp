#include <algorithm>
#include <cmath>

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

// The strongest place of the searches so far that is not at one of the targets, nor at what may be
// a side lobe of one, which moves alike.
std::optional<RangeOdds::Place> TargetSelection::seen_beside() {
  std::optional<RangeOdds::Place> best;
  for (std::size_t m = 0; m < all_.model.count; ++m) {
    lines_.clear();
    for (std::size_t k = 0; k < all_.model.count; ++k) {
      lines_.push_back(all_.model.targets[k].track);
    }
    while (lines_.size() < lines_.capacity()) {
      const auto place = members_[m].search.peaks.best_beside(lines_);
      if (!place || (best && place->gain_nats < best->gain_nats)) break;
      lines_.push_back(place->line);
      if (!may_be_side_lobe(*place, m)) best = place;
    }
  }
  return best;
}

// Whether a place may be a side lobe of a target that a member's search had not been freed from.
bool TargetSelection::may_be_side_lobe(const RangeOdds::Place& place, std::size_t member) const {
  const DelayTrack& there = place.line;
  for (std::size_t k = member; k < all_.model.count; ++k) {
    if (parting_widths(all_.model.targets[k].track, there) < tail_widths &&
        place.gain_nats < strong_side_lobe * members_[k].search.fit.gain_nats) {
      return true;
    }
  }
  return false;
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
  Target found = fit->model.targets[0];
  if (fit->gain_nats < least_gain_nats(found)) return std::nullopt;
  found.track = likeliest_lobe(rest, *fit);
  return found;
}

// Where a target has half of its pulses in common with one that has been taken out, what is left of
// it is as high at all side lobes of the other half of its comb. The right place was a high one of
// the frame too.
DelayTrack TargetSelection::likeliest_lobe(const FoldedFrame& rest, const Maximum& found) {
  constexpr std::size_t most_tried = 3;
  constexpr double near_widths = 7;
  const DelayTrack line = found.track();
  const RangeOdds& seen = members_[0].search.peaks.odds;
  if (seen.gain_near(line, near_widths * shape_.width_ns()) > found.gain_nats) return line;
  lines_.clear();
  for (std::size_t k = 0; k < all_.model.count; ++k) {
    lines_.push_back(all_.model.targets[k].track);
  }
  for (std::size_t tried = 0; tried < most_tried; ++tried) {
    const auto place = seen.best_beside(lines_);
    if (!place || place->gain_nats < found.gain_nats) break;
    likelihood::Model there = found.model;
    there.targets[0].track = place->line;
    if (search_.judge(rest, there).gain_nats > strong_side_lobe * found.gain_nats)
      return place->line;
    lines_.push_back(place->line);
  }
  return line;
}

}  // namespace splid::selection
