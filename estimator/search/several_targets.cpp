#include "estimator/search/several_targets.hpp"

#include <algorithm>
#include <cmath>

namespace splid {
namespace {

// Pairs that are closer than this are climbed to from several places.
constexpr double close_widths = 7;
// What is left of the frame may hold less of a target than the frame does, where the target is
// close to another. A candidate with so much of the threshold is fitted together with the others.
constexpr double least_of_threshold = 0.4;
// Elsewhere what is left holds all of a target but so much, which its photons that fell on those
// of others may have gained.
constexpr double lost_nats = 3;
// A target that gains so much more than the threshold is there, however the others are refitted.
constexpr double plain_margin_nats = 20;
// What parts from a target may be half of the pulses of another one, which is elsewhere. It then
// has less than so much of this target's signal, or that other place is as bright as this one.
constexpr double most_of_half = 0.8;
// Other places that are so much worse are no rivals.
constexpr double no_rival_nats = 60;
// The light of two targets looks like that of others where they move alike: where the ends of their
// lines part by no more than this.
constexpr double most_apart_widths = 3;

using Lines = std::array<DelayLine, most_targets>;

// The lines of the targets from `first` on, but for the target `but` (no target's number: of all).
std::span<const DelayLine> lines_of(const JointParameters& at, Lines& lines, std::size_t first = 0,
                                    std::size_t but = most_targets) {
  std::size_t count = 0;
  for (std::size_t k = first; k < at.count; ++k) {
    if (k != but) lines.at(count++) = at.targets.at(k).line;
  }
  return std::span(lines).first(count);
}

}  // namespace

likelihood::Maximum maximum_of(std::span<const FoundTarget> targets) {
  likelihood::Maximum all;
  const auto size = static_cast<Eigen::Index>(likelihood::parameters_of(targets.size()));
  all.covariance = SmallMatrix::Zero(size, size);
  all.has_covariance = true;
  const auto b = static_cast<Eigen::Index>(likelihood::background_place(targets.size()));
  for (std::size_t k = 0; k < targets.size(); ++k) {
    const likelihood::Maximum one = maximum_of(targets[k].fit);
    all.model.add(one.model.targets[0]);
    all.model.background_per_ns = one.model.background_per_ns;
    all.stop = one.stop;
    const auto d = static_cast<Eigen::Index>(likelihood::of_target * k);
    all.covariance.block<likelihood::of_target, likelihood::of_target>(d, d) =
        one.covariance.topLeftCorner<likelihood::of_target, likelihood::of_target>();
    all.covariance(b, b) = one.covariance.bottomRightCorner<1, 1>()(0, 0);
  }
  return all;
}

SeveralTargets::SeveralTargets(TargetSearch& search, PatternCheck& pattern_check,
                               const PulseTrain& train, const PulseShape& shape,
                               double threshold_nats, double false_alarm_rate, std::size_t most,
                               std::size_t max_photons)
    : search_(search),
      pattern_check_(pattern_check),
      train_(train),
      shape_(shape),
      threshold_nats_(threshold_nats),
      most_(most),
      joint_(shape, train, max_photons),
      claims_(shape, train, joint_.likelihood(), false_alarm_rate),
      start_(search, shape, train, joint_.likelihood(), claims_, threshold_nats + plain_margin_nats,
             most),
      meetings_(search.meetings()),
      rest_(train, max_photons, pattern_check.reach_ns()) {
  stays_.reserve(max_photons);
  found_.reserve(most_targets);
  searches_.reserve(most_targets);
  compared_.reserve(most_targets + most_targets * CombMeetings::most_places);
  for (std::size_t k = 0; k < most_targets; ++k) searches_.push_back({{}, search.no_peaks()});
}

std::span<const FoundTarget> SeveralTargets::find(const FoldedFrame& frame, Fit& first, bool moving,
                                                  Effort most) {
  searches_.front().fit = first;
  search_.keep_peaks(searches_.front().peaks);
  exposure_ = Exposure(frame, train_);
  joint_.begin(frame, exposure_);
  if (!find_all(frame, moving, most, true)) find_all(frame, moving, most, false);
  if (found_.empty()) first = search_.climb_on(frame, searches_.front().fit);
  return found_;
}

// Finds the targets beside the first one; returns false where some were fitted at once, and one of
// these is none.
bool SeveralTargets::find_all(const FoldedFrame& frame, bool moving, Effort most, bool at_once) {
  found_.clear();
  start_with_first();
  if (!at_once || !start_together(frame, moving)) {
    Fit& first = searches_.front().fit;
    first = search_.climb_on(frame, first);
    start_with_first();
  }
  while (claims_.count() < most_ && all_.at.count < most_targets) {
    if (!add_next(frame, moving, most)) break;
  }
  if (claims_.count() == 1) return true;
  fit_claimed(frame, moving);
  // Where all light of one of them is another's, the likelihood does not fall off beside it.
  if (!best_.has_covariance) return started_with_ == 1;
  compare_with_other_places(frame, moving);
  return judge(frame, moving);
}

void SeveralTargets::start_with_first() {
  const Fit& first = searches_.front().fit;
  all_ = {};
  all_.at.add({first.parameters.line, first.parameters.signal_per_pulse});
  all_.at.background_per_ns = first.parameters.background_per_ns;
  all_.gain_nats = first.gain_nats;
  is_refined_ = false;
  first_unlooked_ = 0;
  claims_.begin(exposure_);
  started_with_ = 1;
  do_started_part_ = false;
  are_peaks_left_ = true;
  seen_by_ = 0;
  least_nats_ = {};
}

// Fits all that is seen at once together; returns false where that is one target, or not all of it
// can be claimed. Then the first is what it was, since the light may be that of others too. But
// what stands in one light stays together, and what else there is is looked for beside it.
bool SeveralTargets::start_together(const FoldedFrame& frame, bool moving) {
  joint_.likelihood().hold(frame, all_.at);
  const JointStart::Guess guess = start_.guess(exposure_, all_.at, searches_.front(), moving);
  if (guess.at.count == 1) return false;
  joint_.likelihood().hold(frame, guess.at);
  const double least_nats = all_.gain_nats + (guess.do_part ? 0 : threshold_nats_);
  if (!guess.do_part && !(joint_.gain(exposure_, guess.at) >= least_nats)) return false;
  const JointMaximum together = joint_.climb(frame, exposure_, guess.at, moving);
  if (!(together.gain_nats >= least_nats) || !together.has_covariance) return false;
  if (!guess.is_row) {
    for (std::size_t k = 0; k < guess.at.count; ++k) claims_.claim(k);
  } else if (guess.at.count == 2) {
    claims_.judge(together.at, 1);
  } else {
    claims_.claim_in_rows(together.at);
  }
  if (claims_.count() < together.at.count && !is_one_light(together.at)) return false;
  all_ = together;
  is_refined_ = true;
  started_with_ = guess.at.count;
  do_started_part_ = guess.do_part;
  least_nats_ = guess.least_nats;
  return true;
}

// Whether targets stand in one light: they are three or more, of like signals, move alike, and are
// so close to each other that their light hardly falls between them.
//
// Design note: that is the light of a wide pulse, or of targets that are not told from one. To look
// for them one after the other ends with the same joint fit, and takes as long again.
bool SeveralTargets::is_one_light(const JointParameters& at) const {
  constexpr std::size_t fewest = 3;
  constexpr double least_alike = 0.5;  // of the brightest one's signal
  constexpr double most_widths = 3.5;  // to the nearest other
  if (at.count < fewest) return false;
  const std::span targets(at.targets.data(), at.count);
  const auto [dimmest, brightest] = std::minmax_element(
      targets.begin(), targets.end(), [](const TargetParameters& a, const TargetParameters& b) {
        return a.signal_per_pulse < b.signal_per_pulse;
      });
  if (dimmest->signal_per_pulse < least_alike * brightest->signal_per_pulse) return false;
  return std::all_of(targets.begin(), targets.end(), [&](const TargetParameters& own) {
    return move_alike(own.line, targets.front().line) &&
           std::any_of(targets.begin(), targets.end(), [&](const TargetParameters& other) {
             return &other != &own && claims_.apart_widths(own, other) < most_widths;
           });
  });
}

// The fit of what is claimed alone.
void SeveralTargets::fit_claimed(const FoldedFrame& frame, bool moving) {
  JointParameters claimed;
  claimed.background_per_ns = all_.at.background_per_ns;
  for (std::size_t k = 0; k < all_.at.count; ++k) {
    if (!claims_.is_claimed(k)) continue;
    searched_.at(claimed.count) = k;
    was_searched_.at(claimed.count) = started_with_ == 1 || k >= started_with_;
    claimed.add(all_.at.targets.at(k));
  }
  const bool is_fitted = is_refined_ && claimed.count == all_.at.count;
  best_ = is_fitted ? all_ : joint_.climb(frame, exposure_, claimed, moving);
}

// Puts targets where other places explain the light better, and notes by how much they do or do
// not.
//
// Design note: two targets of the same signal whose delays differ by a multiple of 9 ns make two
// more whole combs with an interleaved pattern of 180 and 189 ns (CombMeetings). All four places
// gain as much, and the two pairs differ in the light of the pulses that are of both rates alone,
// one pulse in 41. Of three targets and more, several pairs may have to change places.
void SeveralTargets::compare_with_other_places(const FoldedFrame& frame, bool moving) {
  for (std::size_t round = 0; round < most_targets; ++round) {
    const JointMaximum found = best_;
    pair_odds_nats_ = {};
    for (std::size_t k = 0; k < found.at.count; ++k) {
      for (std::size_t m = k + 1; m < found.at.count; ++m) {
        try_other_places(frame, found, {k, m}, moving);
      }
    }
    if (best_.gain_nats <= found.gain_nats) return;
  }
}

bool SeveralTargets::move_alike(DelayLine one, DelayLine other) const {
  return std::abs(one.travel_ns - other.travel_ns) <= most_apart_widths * shape_.width_ns();
}

// Two that take each other's light have the same signal. One that has taken a part of another's is
// weaker, and the other is brighter than it is.
void SeveralTargets::try_other_places(const FoldedFrame& frame, const JointMaximum& found,
                                      std::array<std::size_t, 2> pair, bool moving) {
  constexpr double least_alike = 0.5, most_alike = 0.7;  // of the brighter one's signal
  const TargetParameters& a = found.at.targets.at(pair[0]);
  const TargetParameters& b = found.at.targets.at(pair[1]);
  if (!move_alike(a.line, b.line)) return;
  const CombMeetings::Places places = meetings_.find(a.line.delay_ns, b.line.delay_ns);
  const auto delays_ns = places.delays_ns();
  const auto [less, more] = std::minmax(a.signal_per_pulse, b.signal_per_pulse);
  const double travel_ns = (a.line.travel_ns + b.line.travel_ns) / 2;
  const double S = (less + more) / 2;
  const double to_beat_nats = found.gain_nats - no_rival_nats;
  const auto climb_to = [&](const JointParameters& other) {
    return joint_.climb(frame, exposure_, other, moving, to_beat_nats);
  };
  for (std::size_t n = 0; n < delays_ns.size(); ++n) {
    const TargetParameters there = {{delays_ns[n], travel_ns}, S};
    for (std::size_t m = 0; m < n && less > least_alike * more; ++m) {
      JointParameters other = found.at;
      other.targets.at(pair[0]) = there;
      other.targets.at(pair[1]) = {{delays_ns[m], travel_ns}, S};
      take_places(climb_to(other), found, pair);
    }
    for (std::size_t k = 0; k < 2 && less < most_alike * more; ++k) {
      JointParameters other = found.at;
      other.targets.at(pair.at(k)) = there;
      other.targets.at(pair.at(1 - k)).signal_per_pulse = S;
      take_places(climb_to(other), found, pair);
    }
  }
}

// Takes a joint fit with other places for two of the targets, where it is the better one.
void SeveralTargets::take_places(const JointMaximum& other, const JointMaximum& found,
                                 std::span<const std::size_t> pair) {
  const bool is_beaten = other.stop == Stop::beaten;
  if (!other.has_covariance && !is_beaten) return;
  const double odds_nats = std::abs(other.gain_nats - found.gain_nats);
  for (const std::size_t k : pair) {
    pair_odds_nats_.at(k) = std::min(odds_nats, pair_odds_nats_.at(k).value_or(odds_nats));
  }
  if (is_beaten || !(other.gain_nats > best_.gain_nats)) return;
  best_ = other;
  for (const std::size_t k : pair) was_searched_.at(k) = false;
}

// Two targets that are close to each other may first look like one in their middle, and what that
// leaves over like another beside it, or at a shoulder of the comb. So the climb may also begin at
// a pair about the middle, where that is the likelier place.
//
// Where the new target was found, the targets gain no more than all of them have gained alone. What
// a pair that gains more is compared with is not computed.
JointMaximum SeveralTargets::climb(const FoldedFrame& frame, const JointParameters& start,
                                   double sum_nats, bool moving) {
  const std::size_t last = start.count - 1;
  joint_.likelihood().hold(frame, start);
  JointParameters best = start;
  std::optional<double> most_nats;
  for (std::size_t k = 0; k < last; ++k) {
    JointParameters pair = start;
    const bool is_far =
        claims_.apart_widths(start.targets.at(last), start.targets.at(k)) > close_widths;
    if (is_far) {
      if (!may_be_shoulder(start.targets.at(last), start.targets.at(k))) continue;
      pair.targets.at(last) = {start.targets.at(k).line, 0};
    }
    pair = start_.pair_about(exposure_, pair, k, moving);
    const bool is_one = claims_.apart_widths(pair.targets.at(last), pair.targets.at(k)) <
                        JointStart::least_spread_widths;
    if (is_far && is_one) continue;
    joint_.likelihood().hold(frame, pair);
    const double nats = joint_.gain(exposure_, pair);
    if (!most_nats && nats <= sum_nats) {
      joint_.likelihood().hold(frame, start);
      most_nats = joint_.gain(exposure_, start);
    }
    // Where no pair is likelier than the target that it would stand for, that target's pulse fits.
    if (nats <= most_nats.value_or(sum_nats) || (is_far && nats < all_.gain_nats)) continue;
    most_nats = nats;
    best = pair;
  }
  return joint_.climb(frame, exposure_, best, moving);
}

// Whether a target may be what the misfit of a brighter one leaves over at a shoulder.
bool SeveralTargets::may_be_shoulder(const TargetParameters& target,
                                     const TargetParameters& bright) const {
  constexpr double weaker = 4;
  return weaker * target.signal_per_pulse < bright.signal_per_pulse &&
         std::abs(target.line.travel_ns - bright.line.travel_ns) <
             TargetClaims::tail_widths * shape_.width_ns();
}

// The best target of what is left, as far as searches have come by it already.
std::optional<Fit> SeveralTargets::find_passed() {
  Lines lines;
  const auto known = lines_of(all_.at, lines);
  const bool only_started = all_.at.count == started_with_;
  const TargetSearch::Search& last = searches_.at(only_started ? 0 : all_.at.count - 1);
  if (are_peaks_left_) {
    auto kept = search_.find_kept(rest_, searches_.front().peaks, known, last);
    if (kept) return kept;
    are_peaks_left_ = false;
  }
  return search_.find_seen(rest_, searches_.at(seen_by_).peaks, known);
}

std::optional<Fit> SeveralTargets::find_alike() {
  Lines lines;
  return search_.find_alike(rest_, searches_.at(seen_by_).peaks, lines_of(all_.at, lines));
}

std::optional<Fit> SeveralTargets::find_anywhere(Effort most) {
  seen_by_ = all_.at.count;
  return search_.find_more(rest_, most, threshold_nats_ - lost_nats, all_.at.count);
}

// The best target close to one of those found, of which what is left of the frame may hold less
// than the frame does. Where a target has been looked beside, nothing has changed since.
std::optional<Fit> SeveralTargets::find_beside() {
  Lines lines;
  const auto unlooked = lines_of(all_.at, lines, first_unlooked_);
  first_unlooked_ = all_.at.count;
  return search_.find_beside(rest_, unlooked, least_of_threshold * threshold_nats_);
}

// Looks for one more target; returns false where there is none.
bool SeveralTargets::add_next(const FoldedFrame& frame, bool moving, Effort most) {
  joint_.likelihood().hold(frame, all_.at);
  joint_.likelihood().thin(exposure_, all_.at, stays_);
  rest_.take_some(stays_, JointLikelihood::stays_without_any, frame);
  if (rest_.size() == 0) return false;
  const double least_nats = least_of_threshold * threshold_nats_;
  const auto beside = find_beside();
  if (beside && add(frame, *beside, moving, least_nats)) return true;
  const double least_elsewhere_nats = threshold_nats_ - lost_nats;
  const auto passed = find_passed();
  if (passed && add(frame, *passed, moving, least_elsewhere_nats)) return true;
  // It may be none, and hide one that moves otherwise.
  const auto alike = find_alike();
  if (alike && add(frame, *alike, moving, least_elsewhere_nats)) return true;
  const auto next = find_anywhere(most);
  return next && add(frame, *next, moving, least_elsewhere_nats);
}

// Adds a target of what is left; returns false where it is none.
bool SeveralTargets::add(const FoldedFrame& frame, const Fit& next, bool moving,
                         double least_nats) {
  if (next.gain_nats < least_nats || !next.has_covariance) return false;
  const std::size_t last = all_.at.count;
  searches_.at(last).fit = next;
  search_.keep_peaks(searches_.at(last).peaks);
  if (!is_plain(next)) return add_together(frame, next, moving);
  claims_.claim(last);
  is_refined_ = false;
  all_.at.add({next.parameters.line, next.parameters.signal_per_pulse});
  all_.at.background_per_ns = next.parameters.background_per_ns;
  all_.gain_nats += next.gain_nats;
  return true;
}

// Whether a target of what is left is one for sure, and has nothing to do with the others.
bool SeveralTargets::is_plain(const Fit& next) const {
  if (next.gain_nats < threshold_nats_ + plain_margin_nats) return false;
  const TargetParameters own = {next.parameters.line, next.parameters.signal_per_pulse};
  const auto* const end = all_.at.targets.begin() + all_.at.count;
  return std::none_of(all_.at.targets.begin(), end, [&](const TargetParameters& other) {
    return claims_.apart_widths(own, other) <= TargetClaims::tail_widths ||
           may_be_shoulder(own, other);
  });
}

// Fits a new target together with the others; returns false where it is none.
bool SeveralTargets::add_together(const FoldedFrame& frame, const Fit& next, bool moving) {
  if (!is_refined_ && all_.at.count > 1) all_ = joint_.climb(frame, exposure_, all_.at, moving);
  JointParameters start = all_.at;
  start.add({next.parameters.line, next.parameters.signal_per_pulse});
  // Up to now the new target's photons were background.
  const double added = next.parameters.signal_per_pulse * exposure_.amplitude;
  start.background_per_ns -= std::min(added / exposure_.seen_ns, start.background_per_ns / 2);
  const double sum_nats = all_.gain_nats + next.gain_nats;
  const JointMaximum together = climb(frame, start, sum_nats, moving);
  if (!(together.gain_nats >= all_.gain_nats + threshold_nats_) || !together.has_covariance) {
    return false;
  }
  const std::size_t last = all_.at.count;
  joint_.likelihood().hold(frame, together.at);
  claims_.judge(together.at, last);
  is_refined_ = true;
  first_unlooked_ = 0;
  all_ = together;
  claims_.claim_in_rows(all_.at);
  return true;
}

// Whether a target is one of two that part, in place of the frame's best target.
bool SeveralTargets::started_as_parting(std::size_t target) const {
  return do_started_part_ && searched_.at(target) < 2;
}

// Whether a target is one of two that part and are both where the best target is.
bool SeveralTargets::is_half_of_best(std::size_t target) const {
  if (!started_as_parting(target)) return false;
  double most = 0;
  for (std::size_t k = 0; k < best_.at.count; ++k) {
    if (started_as_parting(k)) most = std::max(most, best_.at.targets.at(k).signal_per_pulse);
  }
  return best_.at.targets.at(target).signal_per_pulse >= most_of_half * most;
}

// The part of the joint result that is one target's.
FoundTarget SeveralTargets::target_of(std::size_t target) const {
  FoundTarget found;
  const TargetParameters& p = best_.at.targets.at(target);
  found.fit.parameters = {p.line, p.signal_per_pulse, best_.at.background_per_ns};
  const auto d = static_cast<Eigen::Index>(3 * target);
  const auto b = static_cast<Eigen::Index>(best_.at.size() - 1);
  const std::array<Eigen::Index, 4> from = {d, d + 1, d + 2, b};
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      found.fit.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          best_.covariance(from.at(i), from.at(j));
    }
  }
  found.fit.has_covariance = true;
  found.fit.stop = best_.stop;
  return found;
}

// How sure a target's range is, against all places but those of the frame's other targets.
//
// Targets that were fitted at once have not been searched for. Each is compared with what the light
// of all of them has elsewhere, which is more than its own has. Where that leaves a doubt, its own
// is looked at in rest_, which is the frame without the others: nothing where it is better
// somewhere else, since a part of the light of a target that was not found looked like this one.
// Where combs meet it may be better elsewhere by chance. The joint fit with the other places has
// said then that it is here, and its range is in doubt. Where combs meet, the joint fits with these
// places say how sure the targets' are.
std::optional<double> SeveralTargets::range_odds_nats(std::size_t target, const Fit& fit) {
  Lines lines;
  const auto others = lines_of(best_.at, lines, 0, target);
  if (was_searched_.at(target)) {
    const TargetSearch::Search& search = searches_.at(searched_.at(target));
    return search.peaks.range_odds_nats(search.fit, others);
  }
  const TargetSearch::Peaks& of_all = searches_.front().peaks;
  if (is_half_of_best(target)) {
    return of_all.range_odds_nats(searches_.front().fit, others);
  }
  compared_.assign(others.begin(), others.end());
  if (pair_odds_nats_.at(target)) add_meetings(target, compared_);
  // What one of two that part adds to the other is little of what it has.
  const Fit own = started_as_parting(target) ? search_.judge(rest_, fit.parameters) : fit;
  const double odds_nats = of_all.range_odds_nats(own, compared_);
  const bool is_sure =
      of_all.odds.best_beside(compared_, fit.parameters.line) && odds_nats > plain_margin_nats;
  if (is_sure) return odds_nats;
  const std::optional<double> in_rest = search_.range_odds_in(rest_, own);
  return !in_rest && pair_odds_nats_.at(target) ? 0 : in_rest;
}

// The places where a target's comb meets those of others that move as it does.
void SeveralTargets::add_meetings(std::size_t target, std::vector<DelayLine>& lines) const {
  const DelayLine& own = best_.at.targets.at(target).line;
  for (std::size_t k = 0; k < best_.at.count; ++k) {
    const DelayLine& other = best_.at.targets.at(k).line;
    if (k == target || !move_alike(own, other)) continue;
    const CombMeetings::Places places = meetings_.find(own.delay_ns, other.delay_ns);
    const double travel_ns = (own.travel_ns + other.travel_ns) / 2;
    for (const double delay_ns : places.delays_ns()) lines.push_back({delay_ns, travel_ns});
  }
}

// Looks at each target in a frame from which the others are taken out; returns false where one of
// those that were fitted at once is none.
bool SeveralTargets::judge(const FoldedFrame& frame, bool moving) {
  joint_.likelihood().hold(frame, best_.at);
  joint_.likelihood().thin(exposure_, best_.at, stays_);
  for (std::size_t k = 0; k < best_.at.count; ++k) {
    if (const auto found = judge_one(frame, k, moving)) {
      found_.push_back(*found);
    } else if (started_with_ > 1 && !was_searched_.at(k)) {
      return false;
    }
  }
  if (found_.size() < 2) found_.clear();
  std::sort(found_.begin(), found_.end(), [](const FoundTarget& a, const FoundTarget& b) {
    return a.fit.parameters.signal_per_pulse > b.fit.parameters.signal_per_pulse;
  });
  while (found_.size() > most_) found_.pop_back();
  return true;
}

std::optional<FoundTarget> SeveralTargets::judge_one(const FoldedFrame& frame, std::size_t target,
                                                     bool moving) {
  FoundTarget found = target_of(target);
  found.fit.gain_nats = best_.gain_nats - joint_.gain_without(target, exposure_, best_);
  const double least_nats = least_nats_.at(searched_.at(target));
  if (found.fit.gain_nats < std::max(threshold_nats_, least_nats)) return std::nullopt;
  rest_.take_some(stays_, static_cast<unsigned>(target), frame);
  const PatternVerdict pattern = pattern_check_.judge(rest_, found.fit.parameters);
  if (pattern.fault != PatternFault::none) return std::nullopt;
  const std::optional<double> odds_nats = range_odds_nats(target, found.fit);
  if (!odds_nats) return std::nullopt;
  found.range_odds_nats = std::min(*odds_nats, pair_odds_nats_.at(target).value_or(*odds_nats));
  found.shape_odds_nats = claims_.shape_odds_nats(searched_.at(target));
  found.amplitude_misfit = pattern.amplitude_misfit;
  found.pulse = pattern_check_.judge_pulse(rest_, found.fit.parameters);
  found.path = pattern_check_.judge_path(rest_);
  const DelayLine line = found.fit.parameters.line;
  found.moves = !moving && search_.fit_moving(rest_, line).gain_nats >
                               search_.fit_at_rest(rest_, line.delay_ns).gain_nats +
                                   TargetSearch::nats_for_motion_at_rest;
  return found;
}

}  // namespace splid
