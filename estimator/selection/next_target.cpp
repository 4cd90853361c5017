#include <algorithm>
#include <cmath>

#include "estimator/selection/target_selection.hpp"

namespace splid::selection {
namespace {

using likelihood::Target;

Target target_of(const Fit& fit) {
  const DelayTrack line = fit.parameters.line;
  return {{line.delay_ns, line.walk_ns}, fit.parameters.signal_per_pulse};
}

}  // namespace

// A target far from all others that the first search has come by, and that is no side lobe of them:
// it is as high in what is left.
std::optional<Target> TargetSelection::find_seen(const FoldedFrame& rest) {
  if (terms_ == 3) return std::nullopt;
  const auto place = seen_beside();
  if (!place || place->gain_nats < scope_.threshold_nats + plain_margin_nats) return std::nullopt;
  const Fit there = search_.find_near(rest, place->line);
  if (!there.has_covariance || there.gain_nats < no_side_lobe * place->gain_nats ||
      !is_plain(target_of(there), there.gain_nats)) {
    return std::nullopt;
  }
  TargetSearch::Search& search = members_[all_.model.count].search;
  search.fit = search_.look_beside(rest, there);
  search_.keep_peaks(search.peaks);
  return target_of(search.fit);
}

// The strongest place of the searches so far that is not at one of the targets, nor at what may be
// a side lobe of one, which moves alike.
std::optional<RangeOdds::Place> TargetSelection::seen_beside() {
  std::optional<RangeOdds::Place> best;
  for (std::size_t m = 0; m < all_.model.count; ++m) {
    lines_.clear();
    for (std::size_t k = 0; k < all_.model.count; ++k) {
      lines_.push_back(line_of(all_.model.targets[k].track));
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
  const DelayTrack there = {place.line.delay_ns, place.line.walk_ns};
  for (std::size_t k = member; k < all_.model.count; ++k) {
    if (parting_widths(all_.model.targets[k].track, there) < tail_widths &&
        place.gain_nats < no_side_lobe * members_[k].search.fit.gain_nats) {
      return true;
    }
  }
  return false;
}

// The best place of what is left, with its search among the members.
std::optional<Target> TargetSelection::find_next(const FoldedFrame& rest, Effort most) {
  TargetSearch::Search& search = members_[all_.model.count].search;
  if (bends_ != nullptr && terms_ == 3) {
    const auto bent = bends_->find(rest, most);
    if (!bent || !bent->best.has_covariance) return std::nullopt;
    search.fit = bent->straight;
    search_.keep_peaks(search.peaks);
    return bent->best.model.targets.front();
  }
  const std::optional<Fit> fit = search_.find(rest, most, Effort::balanced);
  if (!fit || !fit->has_covariance) return std::nullopt;
  search.fit = *fit;
  search_.keep_peaks(search.peaks);
  Target found = target_of(*fit);
  if (fit->gain_nats < least_gain_nats(found)) return std::nullopt;
  const DelayTrack line = likeliest_alike(rest, *fit);
  found.track = {line.delay_ns, line.walk_ns};
  return found;
}

// Where a target has half of its pulses in common with one that has been taken out, what is left of
// it is as high at all places at which the other half of its comb falls on itself. The right one of
// these was a high place of the frame too.
DelayTrack TargetSelection::likeliest_alike(const FoldedFrame& rest, const Fit& found) {
  constexpr std::size_t most_tried = 3;
  const DelayTrack line = found.parameters.line;
  const RangeOdds& seen = members_[0].search.peaks.odds;
  if (seen.gain_near(line, pair_widths * shape_.width_ns(), {}) > found.gain_nats) return line;
  lines_.clear();
  for (std::size_t k = 0; k < all_.model.count; ++k) {
    lines_.push_back(line_of(all_.model.targets[k].track));
  }
  for (std::size_t tried = 0; tried < most_tried; ++tried) {
    const auto place = seen.best_beside(lines_);
    if (!place || place->gain_nats < found.gain_nats) break;
    FrameParameters there = found.parameters;
    there.line = place->line;
    if (search_.judge(rest, there).gain_nats > no_side_lobe * found.gain_nats) return there.line;
    lines_.push_back(place->line);
  }
  return line;
}

}  // namespace splid::selection
