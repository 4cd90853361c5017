#include "estimator/search/joint_start.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace splid {
namespace {

// Peaks so high, as parts of the best one's gain, are targets. A shoulder of [P]'s pattern has 0.4
// of it.
constexpr double least_of_best = 0.7;
// Such a target keeps so much of its gain when all others are fitted with it. Where the combs of
// two targets meet, half of the photons are one's, and half the other's.
constexpr double least_kept = 0.75;
// Two are all that there is where the next peak is lower than this part of the second one's.
constexpr double least_of_pair = 0.85;
// What is seen beside a bright target, as a part of its light, and what is seen in a row.
constexpr double least_of_bright = 0.02, least_in_row = 0.3;
// With two rates the light of two targets has two more places, with three rates six.
constexpr std::size_t most_peaks = 8;

// A signal that is added was background up to now.
void take_from_background(const Exposure& exposure, double signal, JointParameters& at) {
  const double added = std::max(signal, 0.0) * exposure.amplitude / exposure.seen_ns;
  at.background_per_ns -= std::min(added, at.background_per_ns / 2);
}

}  // namespace

JointStart::Guess JointStart::guess(const Exposure& exposure, const JointParameters& alone,
                                    const TargetSearch::Search& first, bool moving) {
  const Guess row = row_about(exposure, alone, first, moving);
  if (row.at.count > 1) return row;
  // Peaks are compared with a maximum.
  return first.fit.stop == Stop::spread ? Guess{alone} : with_peaks(exposure, alone, first);
}

// The best target, or two or more in its place that are far enough apart to be told apart.
JointStart::Guess JointStart::row_about(const Exposure& exposure, const JointParameters& alone,
                                        const TargetSearch::Search& first, bool moving) {
  JointParameters row = alone;
  row.add({row.targets.front().line, 0});
  row = pair_about(exposure, row, 0, moving);
  const double widths = claims_.apart_widths(row.targets.at(0), row.targets.at(1));
  // Where another place is as bright, half of its pulses may be what parts from this one.
  const auto rival = first.peaks.odds.best_beside({&alone.targets.front().line, 1});
  const bool is_brightest = !rival || rival->gain_nats < least_of_best * first.fit.gain_nats;
  if (moving && is_brightest && widths < TargetClaims::closest_widths) {
    if (const auto parting = parting_pair(row)) return {*parting, true, true};
  }
  if (widths < least_spread_widths) return {alone};
  row = as_profile_has_it(exposure, row, alone.targets.front());
  if (!are_told_apart(row)) return {alone};
  // The one that stands where the best target was has its photons collected already.
  const auto apart = [&](const TargetParameters& target) {
    return claims_.apart_widths(target, alone.targets.front());
  };
  auto* const begin = row.targets.begin();
  std::iter_swap(begin, std::min_element(begin, begin + row.count,
                                         [&](auto& a, auto& b) { return apart(a) < apart(b); }));
  return {row, true};
}

// A pair whose lines part over the frame, in place of one that the photons are spread as; nothing
// where they do not surely part.
//
// Design note: the moments of the photons do not tell well how far such a pair is apart at
// mid-frame, since the squares of the background's offsets count as much as theirs. The likelihood
// weighs each photon by how likely it is light of the pair.
std::optional<JointParameters> JointStart::parting_pair(const JointParameters& pair) const {
  const TargetParameters& a = pair.targets.at(0);
  const TargetParameters& b = pair.targets.at(1);
  const TargetParameters middle = {
      {(a.line.delay_ns + b.line.delay_ns) / 2, (a.line.travel_ns + b.line.travel_ns) / 2},
      a.signal_per_pulse + b.signal_per_pulse};
  const auto off = claims_.parting_about(0, middle, pair.background_per_ns);
  if (!off) return std::nullopt;
  const auto at = [&](double side) {
    return TargetParameters{{middle.line.delay_ns + side * off->delay_ns,
                             middle.line.travel_ns + side * off->travel_ns},
                            middle.signal_per_pulse / 2};
  };
  JointParameters parting = pair;
  parting.targets.at(0) = at(-1);
  parting.targets.at(1) = at(1);
  if (!claims_.crossing(parting, 0, 1).does_part) return std::nullopt;
  return parting;
}

bool JointStart::are_told_apart(const JointParameters& row) const {
  for (std::size_t k = 0; k < row.count; ++k) {
    for (std::size_t m = 0; m < k; ++m) {
      const double widths = claims_.apart_widths(row.targets.at(k), row.targets.at(m));
      if (widths < TargetClaims::closest_widths) return false;
    }
  }
  return true;
}

// The best target with the peaks that are nearly as high as it is. Where combs meet, the light of
// two targets makes other places as high as they are: then the two whose combs meet at all others.
// The best target alone where there are more peaks than there may be targets.
JointStart::Guess JointStart::with_peaks(const Exposure& exposure, const JointParameters& alone,
                                         const TargetSearch::Search& first) const {
  const Fit& best = first.fit;
  const double least_nats = std::max(least_of_best * best.gain_nats, sure_nats_);
  std::array<DelayLine, most_peaks> lines = {alone.targets.front().line};
  std::array<double, most_peaks> gains = {best.gain_nats};
  std::size_t count = 1;
  const auto next = [&] { return first.peaks.odds.best_beside(std::span(lines).first(count)); };
  for (auto peak = next(); peak && peak->gain_nats >= least_nats; peak = next()) {
    const auto known = std::span(lines).first(count);
    if (count == most_peaks || !search_.has_looked_beside(best, peak->line)) return {alone};
    if (!is_far_from(known, peak->line)) return {alone};
    gains.at(count) = peak->gain_nats;
    lines.at(count++) = peak->line;
  }
  const std::size_t partner = partner_of_first(std::span(lines).first(count));
  if (partner > 0) {
    std::swap(lines.at(1), lines.at(partner));
    std::swap(gains.at(1), gains.at(partner));
    count = 2;
  }
  if (count > most_) return {alone};
  Guess guess = {alone};
  for (std::size_t k = 1; k < count; ++k) {
    const double S = best.parameters.signal_per_pulse * gains.at(k) / best.gain_nats;
    guess.least_nats.at(k) = least_kept * gains.at(k);
    guess.at.add({lines.at(k), S});
    take_from_background(exposure, S, guess.at);
  }
  // Where combs meet, the light of two has two more peaks, as high as these or nearly so.
  const auto another = next();
  const bool is_pair = count == 2 && (!another || another->gain_nats < least_of_pair * gains[1]);
  if (is_pair && partner == 0) share_light(exposure, alone, guess);
  return guess;
}

// Where a part w of one target's pulses are the other's too, each alone seems to have its own
// signal and w of the other's. It keeps what it gains by its other pulses when both are fitted.
void JointStart::share_light(const Exposure& exposure, const JointParameters& alone,
                             Guess& guess) const {
  constexpr double most_shared = 0.7;  // beyond that one is a near copy of the other's comb
  TargetParameters& one = guess.at.targets.at(0);
  TargetParameters& other = guess.at.targets.at(1);
  const double apart_ns = other.line.delay_ns - one.line.delay_ns;
  const double w = light_on_itself(train_, apart_ns, 3 * shape_.width_ns());
  const double of_one = one.signal_per_pulse - w * other.signal_per_pulse;
  const double of_other = other.signal_per_pulse - w * one.signal_per_pulse;
  if (w > most_shared || of_one <= 0 || of_other <= 0) return;
  const double own = of_other / (1 - w * w);
  guess.least_nats.at(1) *= (1 - w) * own / other.signal_per_pulse;
  other.signal_per_pulse = own;
  one.signal_per_pulse = of_one / (1 - w * w);
  guess.at.background_per_ns = alone.background_per_ns;
  const double alone_S = alone.targets.front().signal_per_pulse;
  take_from_background(exposure, own + one.signal_per_pulse - alone_S, guess.at);
}

// The peak whose comb meets that of the first at all other peaks; 0 where there is none, or none
// other.
std::size_t JointStart::partner_of_first(std::span<const DelayLine> peaks) const {
  const double first_ns = peaks.front().delay_ns;
  for (std::size_t k = 1; k < peaks.size() && peaks.size() > 2; ++k) {
    std::size_t others = 0;
    for (std::size_t m = 1; m < peaks.size(); ++m) {
      const bool is_other =
          m != k && search_.meetings().do_meet(first_ns, peaks[k].delay_ns, peaks[m].delay_ns);
      others += is_other ? 1 : 0;
    }
    if (others + 2 == peaks.size()) return k;
  }
  return 0;
}

bool JointStart::is_far_from(std::span<const DelayLine> others, DelayLine line) const {
  return std::all_of(others.begin(), others.end(), [&](DelayLine other) {
    return claims_.apart_widths({line, 0}, {other, 0}) > TargetClaims::tail_widths;
  });
}

// How the photons about a line lie beside their own mean line, as if two targets of equal signals
// had made them: the line in their middle, and how far off that they are, at +-(d + t s). Beyond
// the pulse's width and the background, the offsets o then have the moments
//   <o o> = d d + t t / 12,   <o o s> = d t / 6,   <o o s s> - <o o> / 12 = t t / 180.
JointStart::Spread JointStart::spread_about(const Exposure& exposure, const JointParameters& at,
                                            std::size_t target, DelayLine line) const {
  constexpr double reach_widths = 7;
  constexpr double settled_widths = 0.25;
  constexpr int most_rounds = 4;
  const double width_ns = shape_.width_ns();
  const double reach_ns = reach_widths * width_ns;
  const double dark = at.background_per_ns * exposure.seen_ns * train_.pulses_per_ns * 2 * reach_ns;
  JointLikelihood::Moments sums;
  double photons = 0, off_ns = 0, turn_ns = 0;
  for (int round = 0; round < most_rounds; ++round) {
    line = {line.delay_ns + off_ns, line.travel_ns + turn_ns};
    sums = likelihood_.moments_near(target, line, reach_ns);
    photons = std::max(sums.photons - dark, 1.0);
    off_ns = sums.o / photons;
    turn_ns = 12 * sums.os / photons;
    if (std::abs(off_ns) + std::abs(turn_ns) / 2 < settled_widths * width_ns) break;
  }
  const double square = (sums.oo - dark * reach_ns * reach_ns / 3) / photons - width_ns * width_ns -
                        off_ns * off_ns - turn_ns * turn_ns / 12;
  const double cross = sums.oos / photons - off_ns * turn_ns / 6;
  const double bow = (sums.ooss - sums.oo / 12) / photons - turn_ns * turn_ns / 180;
  const double t = std::sqrt(std::max(0.0, 180 * bow));
  const double d = std::sqrt(std::max(0.0, square - t * t / 12));
  return {{line.delay_ns + off_ns, line.travel_ns + turn_ns}, {d, cross < 0 ? -t : t}};
}

JointParameters JointStart::pair_about(const Exposure& exposure, const JointParameters& start,
                                       std::size_t target, bool moving) const {
  constexpr double least_widths = 0.6;
  const TargetParameters& one = start.targets.at(target);
  const TargetParameters& last = start.targets.at(start.count - 1);
  const double S = one.signal_per_pulse + last.signal_per_pulse;
  const double share = last.signal_per_pulse / S;
  const double apart_ns = std::remainder(last.line.delay_ns - one.line.delay_ns, train_.circle_ns);
  const DelayLine about = {one.line.delay_ns + share * apart_ns,
                           one.line.travel_ns + share * (last.line.travel_ns - one.line.travel_ns)};
  Spread spread = spread_about(exposure, start, target, about);
  if (!moving) spread.middle.travel_ns = spread.off.travel_ns = 0;
  if (std::abs(spread.off.travel_ns) < spread.off.delay_ns || !moving) {
    spread.off.delay_ns = std::max(spread.off.delay_ns, least_widths * shape_.width_ns());
  }
  const auto& [middle, off] = spread;
  JointParameters pair = start;
  pair.targets.at(target) = {{middle.delay_ns - off.delay_ns, middle.travel_ns - off.travel_ns},
                             S / 2};
  pair.targets.at(start.count - 1) = {
      {middle.delay_ns + off.delay_ns, middle.travel_ns + off.travel_ns}, S / 2};
  return pair;
}

// The row where the light beside the best target has it, with what else there is: settled from the
// pair, from three in its place, or from the best target with a weaker one beside it, whichever
// explains the light best. A pair whose lines cross within the frame is left as it is: its light is
// not one beside the other.
JointParameters JointStart::as_profile_has_it(const Exposure& exposure, const JointParameters& pair,
                                              const TargetParameters& alone) {
  const DelayLine& a = pair.targets.at(0).line;
  const DelayLine& b = pair.targets.at(1).line;
  if (std::abs(b.travel_ns - a.travel_ns) > 2 * std::abs(b.delay_ns - a.delay_ns)) return pair;
  const DelayLine middle = {(a.delay_ns + b.delay_ns) / 2, (a.travel_ns + b.travel_ns) / 2};
  see_profile(exposure, middle, pair.background_per_ns);
  const auto light_of = [&](const TargetParameters& target) {
    return RangeProfile::Target{target.line.delay_ns - middle.delay_ns,
                                target.signal_per_pulse * exposure.amplitude};
  };
  RangeProfile::Row found, uneven;
  for (std::size_t k = 0; k < 2; ++k) found.add(light_of(pair.targets.at(k)));
  profile_.settle(found);
  if (most_ > 2) found = likelier_with_middle(found);
  uneven.add(light_of(alone));
  profile_.settle(uneven);
  profile_.add_unexplained(uneven, 2, least_of_bright);
  if (profile_.nats(uneven) > profile_.nats(found)) found = uneven;
  profile_.add_unexplained(found, most_, least_in_row);
  JointParameters settled;
  settled.background_per_ns = pair.background_per_ns;
  double all = 0;
  for (const RangeProfile::Target& target : found.all()) {
    const double S = target.photons / exposure.amplitude;
    settled.add({{middle.delay_ns + target.offset_ns, middle.travel_ns}, S});
    all += S;
  }
  take_from_background(exposure, all - alone.signal_per_pulse, settled);
  return settled;
}

// Three targets in place of a pair where they surely explain the light better.
//
// Design note: at +-d a pair is spread by d d, and so are three of equal signals, evenly spaced, at
// -e, 0 and e with e e = 1.5 d d.
RangeProfile::Row JointStart::likelier_with_middle(const RangeProfile::Row& pair) {
  const RangeProfile::Target& a = pair.all().front();
  const RangeProfile::Target& b = pair.all().back();
  const double middle_ns = (a.offset_ns + b.offset_ns) / 2;
  const double e_ns = std::sqrt(1.5) * (b.offset_ns - a.offset_ns) / 2;
  const double photons = (a.photons + b.photons) / 3;
  RangeProfile::Row three;
  for (const double side : {-1, 0, 1}) three.add({middle_ns + side * e_ns, photons});
  profile_.settle(three);
  return profile_.nats(three) > profile_.nats(pair) + sure_nats_ ? three : pair;
}

// Counts the photons beside a line close to the first target.
void JointStart::see_profile(const Exposure& exposure, DelayLine line, double background_per_ns) {
  const double width_ns = shape_.width_ns();
  const double bin_ns = RangeProfile::bin_widths * width_ns;
  RangeProfile::Counts counts;
  likelihood_.count_near(0, line, shape_.peak_offset_ns() + RangeProfile::first_widths * width_ns,
                         bin_ns, counts);
  profile_.see(counts, background_per_ns * exposure.seen_ns * train_.pulses_per_ns * bin_ns);
}

}  // namespace splid
