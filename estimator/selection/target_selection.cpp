#include "estimator/selection/target_selection.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace splid::selection {
namespace {

using likelihood::Maximum;
using likelihood::Model;
using likelihood::Target;

// What is left of a frame may hold less of a target than the frame does, where another is near.
// With so much of the threshold a place is fitted together with the others.
constexpr double least_of_threshold = 0.4;
// Elsewhere what is left holds all of a target but so much.
constexpr double lost_nats = 3;
// A target far from all others that gains so much more than the threshold waits for the last fit.
constexpr double plain_margin_nats = 20;
// Weaker than that beside another that moves alike, it may be a side lobe's remainder.
constexpr double least_plain = 0.25;
constexpr double greedy_nats = 3e-2, roughly_nats = 0.1;
// Two tracks move alike where their ends part by no more than this.
constexpr double alike_widths = 30;
// From so much on, over the frame, the photons show which of two that cross is which.
constexpr double crossing_widths = 4;
// Another shape of the brighter pulse has as many amounts as a target, chosen by the frame.
constexpr double shape_margin_nats = 12;
// So much more on the photons about a track alone leaves no doubt.
constexpr double sure_nats = 15;
constexpr double most_width = 4, most_wide = 3;
// Two as close as this may be one wide pulse in their middle.
constexpr double one_pulse_widths = 6;
// Closer than this, a new target and another may be two beside their middle.
constexpr double pair_widths = 7;
// Where combs meet.
constexpr double same_walk_widths = 3, least_alike = 0.5, no_rival_nats = 60;
constexpr double no_signal = 1e-30;

DelayLine line_of(const DelayTrack& track) { return {track.delay_ns, track.walk_ns}; }

void remove(Model& model, std::size_t target) {
  for (std::size_t k = target; k + 1 < model.count; ++k) model.targets[k] = model.targets[k + 1];
  --model.count;
}

// The first targets of a maximum, whose covariance stays that of all.
Maximum first_of(const Maximum& all, std::size_t count) {
  Maximum first = all;
  first.model.count = count;
  const auto size = static_cast<Eigen::Index>(likelihood::parameters_of(count));
  const auto rates = static_cast<Eigen::Index>(likelihood::width_place(count));
  const auto from = [&](Eigen::Index i) {
    const auto width = static_cast<Eigen::Index>(likelihood::width_place(all.model.count));
    return i < rates ? i : width + (i - rates);
  };
  first.covariance = SmallMatrix(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j < size; ++j) {
      first.covariance(i, j) = all.covariance(from(i), from(j));
    }
  }
  return first;
}

}  // namespace

TargetSelection::TargetSelection(TargetSearch& search, BendSearch* bends, const PulseTrain& train,
                                 const PulseShape& shape, const SelectionScope& scope,
                                 std::size_t max_photons)
    : search_(search),
      bends_(bends),
      train_(train),
      shape_(shape),
      scope_(scope),
      maximizer_(shape, train, max_photons,
                 {most_targets, scope.is_width_free ? most_width : 1, scope.may_be_dead}),
      wide_(shape, train, max_photons, {most_targets, most_wide, scope.may_be_dead}),
      thinning_(shape, train, max_photons, scope.is_width_free ? most_width : 1),
      tail_(shape, train, max_photons) {
  for (std::size_t k = 0; k < most_targets; ++k) {
    members_.push_back({{{}, search.no_peaks()}, false});
  }
  lines_.reserve(most_targets + most_targets * CombMeetings::most_places);
}

const Selection& TargetSelection::select(const FoldedFrame& frame, const Model& first,
                                         const Fit& fit, std::size_t track_terms, Effort most) {
  frame_ = &frame;
  terms_ = track_terms;
  maximizer_.begin(frame);
  wide_.begin(frame);
  all_ = {};
  all_.model = first;
  all_.gain_nats = fit.gain_nats;
  is_refined_ = !scope_.is_width_free;
  pair_odds_nats_ = {};
  members_[0].search.fit = fit;
  members_[0].is_claimed = true;
  search_.keep_peaks(members_[0].search.peaks);
  // What is not claimed stays, and leaves room for as many more.
  std::size_t wanted = scope_.targets;
  for (bool is_more = true; is_more && all_.model.count < std::min(wanted, most_targets);) {
    while (is_more && all_.model.count < std::min(wanted, most_targets)) is_more = add_next(most);
    judge_claims();
    wanted = scope_.targets + all_.model.count - claimed();
  }
  keep_claimed();
  selection_.count = 1;
  if (all_.model.count > 1) finish();
  return selection_;
}

Maximum TargetSelection::maximize(const Model& start, double enough_nats) {
  return maximizer_.maximize(start,
                             {likelihood::free_set(start.count, terms_, scope_.is_width_free),
                              -std::numeric_limits<double>::infinity(), enough_nats});
}

std::size_t TargetSelection::claimed() const {
  return static_cast<std::size_t>(std::count_if(
      members_.begin(), members_.begin() + static_cast<std::ptrdiff_t>(all_.model.count),
      [](const Member& member) { return member.is_claimed; }));
}

double TargetSelection::apart_ns(const DelayTrack& a, const DelayTrack& b) const {
  return std::remainder(a.delay_ns - b.delay_ns, train_.circle_ns);
}

// How far apart two are over the frame, root mean square.
double TargetSelection::apart_widths(const DelayTrack& a, const DelayTrack& b) const {
  return std::hypot(apart_ns(a, b), (a.walk_ns - b.walk_ns) / std::sqrt(12.0)) / shape_.width_ns();
}

double TargetSelection::parting_widths(const DelayTrack& a, const DelayTrack& b) const {
  return std::abs(a.walk_ns - b.walk_ns) / shape_.width_ns();
}

bool TargetSelection::is_near(const Target& next) const {
  const std::span known(all_.model.targets.data(), all_.model.count);
  return std::any_of(known.begin(), known.end(), [&](const Target& other) {
    return apart_widths(next.track, other.track) <= tail_widths;
  });
}

// Whether a target of what is left is one for sure, and has nothing to do with the others.
bool TargetSelection::is_plain(const Target& next, double gain_nats) const {
  if (gain_nats < scope_.threshold_nats + plain_margin_nats || is_near(next)) return false;
  const std::span known(all_.model.targets.data(), all_.model.count);
  return std::none_of(known.begin(), known.end(),
                      [&](const Target& other) { return may_be_side_lobe(next, other); });
}

// Whether a target may be what the misfit of a brighter one leaves over at a side lobe.
bool TargetSelection::may_be_side_lobe(const Target& target, const Target& bright) const {
  return target.signal_per_pulse < least_plain * bright.signal_per_pulse &&
         parting_widths(target.track, bright.track) < tail_widths;
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
  const std::optional<Fit> fit = search_.find(rest, most);
  if (!fit || !fit->has_covariance) return std::nullopt;
  search.fit = *fit;
  search_.keep_peaks(search.peaks);
  const DelayLine line = likeliest_alike(rest, *fit);
  return Target{{line.delay_ns, line.travel_ns}, fit->parameters.signal_per_pulse};
}

// Where a target has half of its pulses in common with one that has been taken out, what is left of
// it is as high at all places at which the other half of its comb falls on itself. The right one of
// these was a high place of the frame too.
DelayLine TargetSelection::likeliest_alike(const FoldedFrame& rest, const Fit& found) {
  constexpr double least_alike_gain = 0.7;
  constexpr std::size_t most_tried = 3;
  const DelayLine line = found.parameters.line;
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
    if (search_.judge(rest, there).gain_nats > least_alike_gain * found.gain_nats)
      return there.line;
    lines_.push_back(place->line);
  }
  return line;
}

// Looks for one more target; returns false where there is none.
bool TargetSelection::add_next(Effort most) {
  if (!is_refined_ && all_.model.count == 1) {
    all_ = maximize(all_.model, greedy_nats);
    is_refined_ = true;
  }
  const FoldedFrame& rest = thinning_.rest(*frame_, all_.model);
  if (rest.size() == 0) return false;
  const auto next = find_next(rest, most);
  return (next && add(*next)) || add_split();
}

// Adds a target of what is left; returns false where it is none.
bool TargetSelection::add(const Target& next) {
  Member& member = members_[all_.model.count];
  const double gain_nats = member.search.fit.gain_nats;
  const double least_nats = is_near(next) ? least_of_threshold * scope_.threshold_nats
                                          : scope_.threshold_nats - lost_nats;
  if (gain_nats < least_nats) return false;
  if (!is_plain(next, gain_nats)) return add_together(next);
  is_refined_ = false;
  all_.model.add(next);
  all_.model.background_per_ns = member.search.fit.parameters.background_per_ns;
  all_.gain_nats += gain_nats;
  return true;
}

// Fits a new target together with the others; returns false where it is none.
bool TargetSelection::add_together(const Target& next) {
  if (!is_refined_) all_ = maximize(all_.model, greedy_nats);
  is_refined_ = true;
  Model with = all_.model;
  const Exposure& exposure = maximizer_.likelihood().exposure();
  const double added = next.signal_per_pulse * exposure.amplitude / exposure.seen_ns;
  with.add(next);
  with.background_per_ns -= std::min(added, with.background_per_ns / 2);
  return accept(maximize(likelier_start(with), greedy_nats));
}

bool TargetSelection::accept(const Maximum& together) {
  if (!(together.gain_nats >= all_.gain_nats + scope_.threshold_nats)) return false;
  if (!together.has_covariance) return false;
  all_ = together;
  return true;
}

// Of targets and a new one, these or a pair in place of one of them and the new one, as the photons
// are spread: two may first look like one in their middle, and what that leaves over like another
// beside it, or at a side lobe.
Model TargetSelection::likelier_start(const Model& with) {
  Model best = with;
  double most_nats = -std::numeric_limits<double>::infinity();
  const std::size_t last = with.count - 1;
  for (std::size_t k = 0; k < last; ++k) {
    Model about = with;
    const Target &one = with.targets[k], &other = with.targets[last];
    if (apart_widths(one.track, other.track) > pair_widths) {
      if (!may_be_side_lobe(other, one)) continue;
      about.targets[last] = {one.track, 0};
    }
    const auto pair = pair_about(about, k);
    if (!pair) continue;
    if (std::isinf(most_nats)) most_nats = maximizer_.judge(with, {}).gain_nats;
    const double nats = maximizer_.judge(*pair, {}).gain_nats;
    if (nats <= most_nats) continue;
    most_nats = nats;
    best = *pair;
  }
  return best;
}

// Two of equal signals in place of a target and the last one. Two at +-(d + t s) about their middle
// spread the offsets o of photons, beyond the pulse's width and the background, to the moments
//   <o o> = d d + t t / 12,   <o o s> = d t / 6,   <o o s s> - <o o> / 12 = t t / 180.
std::optional<Model> TargetSelection::pair_about(const Model& with, std::size_t target) {
  constexpr double reach_widths = 7, settled_widths = 0.25, least_widths = 0.6;
  constexpr int most_rounds = 4;
  const double width_ns = shape_.width_ns() * std::exp(with.log_width);
  const double reach_ns = reach_widths * width_ns;
  if (!maximizer_.likelihood().serves(with)) {
    maximizer_.likelihood().collect(with, NearSet::gathered_from);
  }
  const NearSet& near = maximizer_.likelihood().near().near(target);
  const Exposure& exposure = maximizer_.likelihood().exposure();
  const Target &one = with.targets[target], &last = with.targets[with.count - 1];
  const double S = one.signal_per_pulse + last.signal_per_pulse;
  const double share = last.signal_per_pulse / S;
  const double dark =
      with.background_per_ns * exposure.seen_ns * train_.pulses_per_ns * 2 * reach_ns;
  DelayTrack middle = one.track;
  middle.delay_ns += share * apart_ns(last.track, one.track);
  middle.walk_ns += share * (last.track.walk_ns - one.track.walk_ns);
  double square = 0, cross = 0, bow = 0;
  for (int round = 0; round < most_rounds; ++round) {
    const DelayTrack from = near.track();
    double photons = -dark, o1 = 0, os = 0, oo = 0, oos = 0, ooss = 0;
    for (std::size_t j = 0; j < near.entries(); ++j) {
      const double s = near.position[j];
      const double o = near.residual_ns[j] - (middle.at(s) - from.at(s)) - shape_.peak_offset_ns();
      if (std::abs(o) > reach_ns) continue;
      photons += 1, o1 += o, os += o * s, oo += o * o, oos += o * o * s, ooss += o * o * s * s;
    }
    photons = std::max(photons, 1.0);
    const double off_ns = o1 / photons, turn_ns = terms_ > 1 ? 12 * os / photons : 0;
    square = (oo - dark * reach_ns * reach_ns / 3) / photons - width_ns * width_ns -
             off_ns * off_ns - turn_ns * turn_ns / 12;
    cross = oos / photons - off_ns * turn_ns / 6;
    bow = (ooss - oo / 12) / photons - turn_ns * turn_ns / 180;
    middle.delay_ns += off_ns, middle.walk_ns += turn_ns;
    if (std::abs(off_ns) + std::abs(turn_ns) / 2 < settled_widths * width_ns) break;
  }
  const double t = terms_ > 1 ? std::sqrt(std::max(0.0, 180 * bow)) : 0;
  double d = std::sqrt(std::max(0.0, square - t * t / 12));
  if (std::hypot(d, t / std::sqrt(12.0)) < least_widths * width_ns) return std::nullopt;
  if (t < d) d = std::max(d, least_widths * width_ns);
  Model pair = with;
  for (const double side : {-1.0, 1.0}) {
    Target& half = pair.targets[side < 0 ? target : with.count - 1];
    half = {middle, S / 2};
    half.track.delay_ns += side * d;
    half.track.walk_ns += side * (cross < 0 ? -t : t);
  }
  return pair;
}

// Looks for two in place of one whose photons are spread as those of two.
bool TargetSelection::add_split() {
  if (!is_refined_) all_ = maximize(all_.model, greedy_nats);
  is_refined_ = true;
  for (std::size_t k = 0; k < all_.model.count; ++k) {
    Model with = all_.model;
    with.add({with.targets[k].track, 0});
    const auto pair = pair_about(with, k);
    if (!pair) continue;
    TargetSearch::Search& search = members_[all_.model.count].search;
    search.fit = {};
    search_.keep_peaks(search.peaks);
    if (accept(maximize(*pair, greedy_nats))) return true;
  }
  return false;
}

// The brighter ones first.
void TargetSelection::judge_claims() {
  std::array<std::size_t, most_targets> order{};
  const std::size_t count = all_.model.count;
  for (std::size_t k = 0; k < count; ++k) order[k] = k, members_[k].is_claimed = false;
  std::sort(order.begin(), order.begin() + count, [&](std::size_t a, std::size_t b) {
    return all_.model.targets[a].signal_per_pulse > all_.model.targets[b].signal_per_pulse;
  });
  for (std::size_t n = 0; n < count; ++n) {
    members_[order[n]].is_claimed = stands(order[n], std::span(order).first(n));
  }
}

// Whether a target is one, and not what a brighter one's pulse leaves over.
bool TargetSelection::stands(std::size_t target, std::span<const std::size_t> brighter) {
  const DelayTrack& own = all_.model.targets[target].track;
  const double narrow = std::exp(-all_.model.log_width);
  std::optional<std::size_t> bright;
  for (const std::size_t k : brighter) {
    const DelayTrack& other = all_.model.targets[k].track;
    const double apart = apart_widths(own, other) * narrow;
    const double parting = parting_widths(own, other) * narrow;
    if (apart < closest_widths && parting < crossing_widths) return false;
    if (!bright && apart <= tail_widths && parting <= alike_widths) bright = k;
  }
  if (!bright) return true;
  if (!is_refined_) all_ = maximize(all_.model, greedy_nats);
  is_refined_ = true;
  return beats_other_pulse(target, *bright);
}

// Whether a target explains more than another shape of a brighter one's pulse does, beside the
// others, and beside those that are known to be targets.
bool TargetSelection::beats_other_pulse(std::size_t target, std::size_t bright) {
  const Model& all = all_.model;
  const DelayTrack& own = all.targets[target].track;
  Target other = all.targets[bright];
  double log_width = all.log_width;
  const double d = apart_widths(own, other.track);
  if (d < one_pulse_widths) {
    const double signal = all.targets[target].signal_per_pulse;
    const double share = signal / (signal + other.signal_per_pulse);
    log_width += std::log1p(share * (1 - share) * d * d) / 2;
    other.track.delay_ns += share * apart_ns(own, other.track);
    other.track.walk_ns += share * (own.walk_ns - other.track.walk_ns);
    other.signal_per_pulse += signal;
  }
  const auto beats = [&](bool with_unknown) {
    Model without;
    without.log_width = log_width;
    without.background_per_ns = all.background_per_ns;
    without.add(other);
    for (std::size_t k = 0; k < all.count; ++k) {
      const bool stays = k != target && k != bright && (with_unknown || members_[k].is_claimed);
      if (stays) without.add(all.targets[k]);
    }
    return beats_shapes(without);
  };
  return beats(true) && (claimed() + 1 >= all.count || beats(false));
}

// The photons about the track show most targets apart. Where they do not, all is fitted.
bool TargetSelection::beats_shapes(const Model& without) {
  if (tail_.looks()) {
    tail_.count(*frame_, without);
    const double most_nats = tail_.nats(all_.model) - shape_margin_nats - sure_nats;
    if (tail_.other_width_nats(without, most_nats) < most_nats &&
        tail_.with_tail_nats(most_nats) < most_nats) {
      return true;
    }
  }
  const std::size_t terms = terms_ > 1 ? 3 : 1;
  const Maximum wide =
      wide_.maximize(without, {likelihood::free_set(without.count, terms, true),
                               -std::numeric_limits<double>::infinity(), roughly_nats});
  const double more_nats = all_.gain_nats - wide.gain_nats - shape_margin_nats;
  if (more_nats <= 0 || !tail_.looks()) return more_nats > 0;
  tail_.count(*frame_, wide.model);
  const double most_nats =
      tail_.other_width_nats(wide.model, std::numeric_limits<double>::infinity()) + more_nats;
  return tail_.with_tail_nats(most_nats) < most_nats;
}

void TargetSelection::drop(std::size_t target) {
  remove(all_.model, target);
  const auto first = members_.begin() + static_cast<std::ptrdiff_t>(target);
  std::rotate(first, first + 1, members_.end());
  is_refined_ = false;
}

void TargetSelection::keep_claimed() {
  for (std::size_t k = all_.model.count; k-- > 0;) {
    if (!members_[k].is_claimed && all_.model.count > 1) drop(k);
  }
}

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
  const std::size_t count = all_.model.count;
  const auto swap_places = [&](std::size_t a, std::size_t b) {
    auto& C = all_.covariance;
    for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(likelihood::of_target); ++i) {
      const auto x = static_cast<Eigen::Index>(likelihood::of_target * a) + i;
      const auto y = static_cast<Eigen::Index>(likelihood::of_target * b) + i;
      C.row(x).swap(C.row(y));
      C.col(x).swap(C.col(y));
    }
    std::swap(all_.model.targets[a], all_.model.targets[b]);
    std::swap(members_[a], members_[b]);
    std::swap(pair_odds_nats_[a], pair_odds_nats_[b]);
  };
  for (std::size_t k = 0; k < count; ++k) {
    std::size_t brightest = k;
    for (std::size_t m = k + 1; m < count; ++m) {
      const bool is_brighter =
          all_.model.targets[m].signal_per_pulse > all_.model.targets[brightest].signal_per_pulse;
      if (is_brighter) brightest = m;
    }
    if (brightest != k) swap_places(k, brightest);
  }
}

// Puts pairs where their light is as well another pair's, and notes by how much that is the worse.
//
// Design note: two targets of the same signal whose delays differ by a multiple of 9 ns make two
// more whole combs with an interleaved pattern of 180 and 189 ns (CombMeetings). All four places
// gain as much, and the two pairs differ in the light of the pulses that are of both rates alone,
// one pulse in 41. Of three targets and more, several pairs may have to change places.
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
  const double less = std::min(a.signal_per_pulse, b.signal_per_pulse);
  const double more = std::max(a.signal_per_pulse, b.signal_per_pulse);
  if (parting_widths(a.track, b.track) > same_walk_widths || less < least_alike * more) return;
  const CombMeetings::Places places = search_.meetings().find(a.track.delay_ns, b.track.delay_ns);
  const auto delays_ns = places.delays_ns();
  const auto at = [&](double delay_ns) {
    return Target{{delay_ns, (a.track.walk_ns + b.track.walk_ns) / 2,
                   (a.track.quadratic_ns + b.track.quadratic_ns) / 2},
                  (less + more) / 2};
  };
  for (std::size_t n = 0; n < delays_ns.size(); ++n) {
    for (std::size_t i = 0; i < n; ++i) {
      Model other = found.model;
      other.targets[k] = at(delays_ns[n]);
      other.targets[m] = at(delays_ns[i]);
      const Maximum there = maximizer_.maximize(
          other, {likelihood::free_set(other.count, terms_, scope_.is_width_free),
                  found.gain_nats - no_rival_nats});
      if (!there.has_covariance && there.stop != Stop::beaten) continue;
      const double odds_nats = std::abs(there.gain_nats - found.gain_nats);
      for (auto* odds : {&pair_odds_nats_[k], &pair_odds_nats_[m]}) {
        *odds = std::min(odds_nats, odds->value_or(odds_nats));
      }
      if (there.has_covariance && there.gain_nats > all_.gain_nats) all_ = there;
    }
  }
}

// What a target adds: the others keep their tracks.
double TargetSelection::gain_of(std::size_t target) {
  constexpr double near_enough_nats = 0.1;
  const Exposure& exposure = maximizer_.likelihood().exposure();
  Model without = all_.model;
  likelihood::FreeSet rates;
  rates.set(likelihood::background_place(without.count));
  for (std::size_t k = 0; k < without.count; ++k) {
    if (k != target) rates.set(likelihood::place_of(k, likelihood::signal));
  }
  Target& own = without.targets[target];
  without.background_per_ns += own.signal_per_pulse * exposure.amplitude / exposure.seen_ns;
  own.signal_per_pulse = no_signal;
  const Maximum rest = maximizer_.maximize(
      without, {rates, -std::numeric_limits<double>::infinity(), near_enough_nats});
  return all_.gain_nats - rest.gain_nats;
}

// How sure a target's range is, against all places but those of the others. The search that found
// it says so, unless the fit of all has put it elsewhere, or what had been left of it then was
// little; then it is looked at in the frame without the others.
double TargetSelection::range_odds_nats(std::size_t target) {
  constexpr double least_seen = 0.5, most_moved_widths = 2;
  const Target& own = all_.model.targets[target];
  lines_.clear();
  for (std::size_t k = 0; k < all_.model.count; ++k) {
    if (k == target) continue;
    const DelayTrack& other = all_.model.targets[k].track;
    lines_.push_back(line_of(other));
    if (!pair_odds_nats_[target] || parting_widths(own.track, other) > same_walk_widths) continue;
    const auto places = search_.meetings().find(own.track.delay_ns, other.delay_ns);
    for (const double delay_ns : places.delays_ns()) {
      lines_.push_back({delay_ns, own.track.walk_ns});
    }
  }
  const TargetSearch::Search& search = members_[target].search;
  const DelayLine& seen = search.fit.parameters.line;
  const DelayTrack searched = {seen.delay_ns, seen.travel_ns, own.track.quadratic_ns};
  double odds_nats = 0;
  if (apart_widths(searched, own.track) < most_moved_widths &&
      search.fit.gain_nats > least_seen * selection_.targets[target].gain_nats) {
    odds_nats = search.peaks.range_odds_nats(search.fit, lines_);
  } else {
    const FoldedFrame* rest = &thinning_.rest(*frame_, all_.model, target);
    if (own.track.quadratic_ns != 0 && bends_ != nullptr) {
      rest = &bends_->straightened(*rest, 6 * own.track.quadratic_ns);
    }
    const Fit fit = search_.judge(
        *rest, {line_of(own.track), own.signal_per_pulse, all_.model.background_per_ns});
    odds_nats = search_.range_odds_in(*rest, fit).value_or(0);
  }
  return std::min(odds_nats, pair_odds_nats_[target].value_or(odds_nats));
}

double TargetSelection::gain_by_moving_nats() {
  const Maximum moving = maximizer_.maximize(
      all_.model, {likelihood::free_set(all_.model.count, 2, scope_.is_width_free),
                   -std::numeric_limits<double>::infinity(), greedy_nats});
  return moving.gain_nats - all_.gain_nats;
}

}  // namespace splid::selection
