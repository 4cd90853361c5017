#include <algorithm>
#include <array>

#include "estimator/search/target_search.hpp"

// The search for one more target, in what is left of a frame without those that were found.

namespace splid {

// The peak has been climbed already, in the frame, and is much the same in what is left. Where the
// combs of two targets meet there are peaks as high as theirs, which lose half of their gain with
// one of the two. So where a peak that is no shoulder of the last target is none, the next one is
// looked at.
std::optional<Fit> TargetSearch::find_kept(const FoldedFrame& rest, const Peaks& peaks,
                                           std::span<const DelayLine> known, const Search& last) {
  constexpr double least_left = 0.5;  // a shoulder loses most of its gain with its target
  constexpr double no_shoulder = 0.7;
  constexpr std::size_t most_looked_at = 3;
  std::array<DelayLine, most_targets + most_looked_at> seen;
  std::copy(known.begin(), known.end(), seen.begin());
  for (std::size_t n = 0; n < most_looked_at; ++n) {
    const auto but = std::span(seen).first(known.size() + n);
    const std::optional<RangeOdds::Place> kept = peaks.odds.best_beside(but);
    if (!kept || kept->gain_nats < settled_nats()) return std::nullopt;
    if (n > 0 && kept->gain_nats < no_shoulder * last.fit.gain_nats) return std::nullopt;
    seen.at(known.size() + n) = kept->line;
    const Fit fit = refinement_.fit_rates(rest, kept->line, moving_);
    const double least_nats = std::max(settled_nats(), least_left * kept->gain_nats);
    if (fit.has_covariance && fit.gain_nats >= least_nats && refinement_.is_all_along(fit, known)) {
      return with_rivals(rest, fit, peaks, known, last);
    }
  }
  return std::nullopt;
}

// The shoulders of a target have been seen too, and are gone with it, as the zoom shows.
std::optional<Fit> TargetSearch::find_seen(const FoldedFrame& rest, const Peaks& peaks,
                                           std::span<const DelayLine> known) {
  constexpr double least_left = 0.5;
  constexpr std::size_t most_looked_at = 4;
  std::array<DelayLine, most_targets + most_looked_at> lines;
  std::copy(known.begin(), known.end(), lines.begin());
  for (std::size_t n = 0; n < most_looked_at; ++n) {
    const auto seen = peaks.seen.best_beside(std::span(lines).first(known.size() + n));
    if (!seen) return std::nullopt;
    lines.at(known.size() + n) = seen->line;
    const double least_nats = std::max(settled_nats(), least_left * seen->gain_nats);
    const auto place = zoom_to(rest, seen->line, least_nats);
    if (!place) continue;
    if (auto found = climb_in_rest(rest, *place, &peaks, known)) return found;
  }
  return std::nullopt;
}

// Design note: a wall and what stands before it move alike, and parts of one thing nearly. A look
// at all delays of one travel, and one at the travels about it, are each far less work than one at
// all travels. A bright target that moves otherwise shows a part of its path there, and of that of
// each of its shoulders, which a zoom or a climb follows to other travels. Where the known targets
// have travels of their own, so has the next one.
std::optional<Fit> TargetSearch::find_alike(const FoldedFrame& rest, const Peaks& peaks,
                                            std::span<const DelayLine> known) {
  constexpr double same_widths = 4;  // two steps of the zoom
  const double travel_ns = known.front().travel_ns;
  const double most_apart_ns = (alike_.slices - 1) * alike_.bin_ns;
  const auto are_within = [&](double apart_ns, std::span<const DelayLine> lines) {
    return std::all_of(lines.begin(), lines.end(), [&](DelayLine line) {
      return std::abs(line.travel_ns - travel_ns) <= apart_ns;
    });
  };
  const auto find_at = [&](DelayLine of_photons, double apart_ns,
                           const Peaks* climbed) -> std::optional<Fit> {
    of_photons.delay_ns -= shape_.peak_offset_ns();
    const auto place = zoom_to(rest, of_photons, settled_nats());
    if (!place || !are_within(apart_ns, {&*place, 1})) return std::nullopt;
    auto found = climb_in_rest(rest, *place, climbed, known);
    if (found && !are_within(apart_ns, {&found->parameters.line, 1})) found.reset();
    return found;
  };
  if (!moving_ || !are_within(most_apart_ns, known)) return std::nullopt;
  if (const double same_ns = same_widths * shape_.width_ns(); are_within(same_ns, known)) {
    const auto delays = search_.best_delays(rest, travel_ns, recheck_);
    if (!delays.empty() && delay_gain_nats(rest, delays.front()) > settled_nats()) {
      if (auto found = find_at({delays.front().delay_ns, travel_ns}, same_ns, &peaks)) return found;
    }
  }
  // What was climbed to with the known travel may be a part of a path with another one.
  const auto cells = search_.run(rest, alike_, most_apart_ns, travel_ns);
  return cells.empty() ? std::nullopt : find_at(cells.front().line, most_apart_ns, nullptr);
}

// Where a zoom about a line ends, if it has the least gain there.
std::optional<DelayLine> TargetSearch::zoom_to(const FoldedFrame& rest, DelayLine line,
                                               double least_nats) {
  line.delay_ns += shape_.peak_offset_ns();
  const ZoomResult zoomed = zoom_into(rest, levels_.front(), line);
  if (box_gain_nats(rest, zoomed.count, zoomed.box_ns) < least_nats) return std::nullopt;
  return zoomed.line;
}

// The target at a place, and those that may be taken for it. peaks: see Climbed.
std::optional<Fit> TargetSearch::climb_in_rest(const FoldedFrame& rest, DelayLine place,
                                               const Peaks* peaks,
                                               std::span<const DelayLine> known) {
  begin(Refinement::Until::near_top);
  Fit fit = climb(rest, place);
  if (!fit.has_covariance || fit.gain_nats < settled_nats()) return std::nullopt;
  if (!refinement_.is_all_along(fit, known)) return std::nullopt;
  if (has_shoulders()) {
    recheck_delay(rest, levels_.front(), fit, {peaks, known, true});
  }
  return fit;
}

// The best of a target that was kept and those places that may be taken for its own.
Fit TargetSearch::with_rivals(const FoldedFrame& rest, const Fit& kept, const Peaks& peaks,
                              std::span<const DelayLine> known, const Search& last) {
  begin(Refinement::Until::near_top);
  odds_.add(kept);
  Fit fit = kept;
  if (!has_shoulders()) return fit;
  if (const auto rival = weaker_rival(fit, known, last)) {
    odds_.add(rival->line, rival->gain_nats);
  } else {
    recheck_delay(rest, levels_.front(), fit, {&peaks, known, true});
  }
  return fit;
}

// What stood against this target already when the last one was looked for, with the same travel,
// and had the most: what is left of the frame has no more there. Nothing where that may be as good
// as this target, or was not looked at.
std::optional<RangeOdds::Place> TargetSearch::weaker_rival(const Fit& fit,
                                                           std::span<const DelayLine> known,
                                                           const Search& last) const {
  const DelayLine& line = fit.parameters.line;
  if (!has_looked_beside(last.fit, line)) return std::nullopt;
  std::optional<RangeOdds::Place> rival = last.peaks.odds.best_beside(known, line);
  if (!rival || most_gain_nats(rival->gain_nats) > fit.gain_nats - rival_nats_) return std::nullopt;
  return rival;
}

std::optional<Fit> TargetSearch::find_beside(const FoldedFrame& rest,
                                             std::span<const DelayLine> known, double least_nats) {
  begin(Refinement::Until::near_top);
  const Level& level = levels_.back();
  Spot best = {{}, 0};
  for (DelayLine line : known) {
    line.delay_ns += shape_.peak_offset_ns();
    const ZoomResult zoomed = zoom_into(rest, level, line);
    const Spot spot = {zoomed.line, box_gain_nats(rest, zoomed.count, zoomed.box_ns)};
    if (spot.box_gain_nats > best.box_gain_nats) best = spot;
  }
  if (best.box_gain_nats < least_nats) return std::nullopt;
  const Fit beside = climb(rest, best.line);
  if (beside.gain_nats < least_nats || !refinement_.is_all_along(beside, known)) {
    return std::nullopt;
  }
  Fit fit = beside;
  if (has_shoulders()) recheck_delay(rest, level, fit, {nullptr, known, true});
  // Where another delay is better, these were a few photons of a target that is elsewhere.
  if (fit.gain_nats > beside.gain_nats) return std::nullopt;
  return fit;
}

std::optional<double> TargetSearch::range_odds_in(const FoldedFrame& rest, const Fit& fit) {
  begin(Refinement::Until::near_top);
  odds_.add(fit);
  Fit best = fit;
  if (has_shoulders()) {
    recheck_delay(rest, levels_.back(), best, {nullptr, {}, true});
  }
  if (best.gain_nats > fit.gain_nats) return std::nullopt;
  return odds_.of(fit);
}

// Design note: the coarsest cells take two thirds of the time of those half as wide. Behind one
// target there is more often none than a plain one, and behind two more often a plain one.
std::optional<Fit> TargetSearch::find_more(const FoldedFrame& rest, Effort most, double least_nats,
                                           std::size_t known) {
  begin(Refinement::Until::near_top);
  if (rest.size() >= sampled_from) {
    if (std::optional<Fit> found = find_by_sample(rest)) return found;
  }
  const std::size_t finest = levels(most) - 1;
  if (known > 1 && finest > 0) {
    std::optional<Fit> found = find_at_level(rest, levels_.front(), least_nats);
    if (found && found->gain_nats > settled_nats()) return found;
  }
  return find_at_level(rest, levels_[finest], least_nats);
}

}  // namespace splid
