#include "estimator/several/target_claims.hpp"

#include <algorithm>
#include <cmath>

namespace splid {
namespace {

// Two targets move together where the ends of their lines part by no more than this.
constexpr double together_widths = 8;
// The light between two pulses, beyond what the two leave there, must be so many deviations below
// that of the weaker pulse's middle, and no more than so much of it, to within a deviation.
constexpr double deviations_of_valley = 2;
constexpr double most_in_valley = 0.3;
// The light behind a pulse, from 2 to 3.5 widths beside it, may exceed what the fit has there by so
// many deviations and so much of the pulse.
constexpr double deviations_behind = 1.5;
constexpr double most_behind = 0.02;
// Behind a pulse before which the light rises by so many deviations, no tail is what has that
// light. There chance must not reach the limit: with 1.5 deviations it does in one frame of a
// hundred.
constexpr double deviations_of_clear_valley = 10;
constexpr double most_deviations_behind = 3;
// Of three or more targets close to each other, none is claimed before the others are known. They
// are where the light between neighbours falls below that of the weaker one's middle by so many
// deviations, and to so much of it: to 0.71 between two of the same signal 3 widths apart.
constexpr double deviations_of_fall = 3;
constexpr double most_between = 0.85;
// Two targets whose lines part by less than this over the frame move alike. The light of those that
// are further apart than this at one end of the frame shows which is which.
constexpr double least_parting_widths = 2;
constexpr double most_parted_widths = 6;
// Closer to a brighter target than this, a target of less than so much of its signal may be what
// the pulse's flank is beside its model.
constexpr double flank_widths = 8;
constexpr double least_in_flank = 0.2;
// It is a target where that explains the photons by so much better than another shape does. A
// twentieth 3 widths away is found in 97.8 % of 1000 frames, and tails of 0.1 to 0.5 ns with an
// eighth of the light are claimed in 2.7 % of 2000. With 2 nats that would be 98.7 % and 4.6 %, and
// with 4 nats 95.9 % and 1.7 %.
constexpr double nats_for_flank = 3;
// The lines of a weak target are chosen by the photons that say whether it moves, from many: that
// gains so many nats at most where nothing moves, but in one frame of a thousand.
constexpr double nats_of_choice = 9;
// Of two that are as alike as this, CrossingCheck says whether they move.
constexpr double least_alike = 0.5;

}  // namespace

TargetClaims::TargetClaims(const PulseShape& shape, const PulseTrain& train,
                           const JointLikelihood& likelihood, double false_alarm_rate)
    : shape_(shape),
      train_(train),
      likelihood_(likelihood),
      crossing_check_(shape, train, false_alarm_rate),
      flank_check_(shape),
      moving_light_(shape, train),
      nats_for_moving_(nats_of_choice - std::log(false_alarm_rate)) {}

void TargetClaims::begin(const Exposure& exposure) {
  exposure_ = exposure;
  is_claimed_ = {true};
  shape_odds_nats_ = {};
}

std::size_t TargetClaims::count() const {
  return static_cast<std::size_t>(std::count(is_claimed_.begin(), is_claimed_.end(), true));
}

void TargetClaims::judge(const JointParameters& at, std::size_t target) {
  is_claimed_.at(target) = stands_apart(at, target);
}

double TargetClaims::apart_widths(const TargetParameters& a, const TargetParameters& b) const {
  const double delay_ns = std::remainder(a.line.delay_ns - b.line.delay_ns, train_.circle_ns);
  const double travel_ns = a.line.travel_ns - b.line.travel_ns;
  return std::hypot(delay_ns, travel_ns / std::sqrt(12.0)) / shape_.width_ns();
}

// Whether a target of a joint fit is one, and not what another's pulse leaves over.
bool TargetClaims::stands_apart(const JointParameters& at, std::size_t target) {
  const TargetParameters& own = at.targets.at(target);
  for (std::size_t k = 0; k < at.count; ++k) {
    if (k == target) continue;
    const TargetParameters& other = at.targets.at(k);
    if (crossing(at, target, k).are_two()) continue;
    const bool is_weaker = own.signal_per_pulse < other.signal_per_pulse;
    if (moves_beside(at, is_weaker ? target : k, is_weaker ? k : target)) continue;
    if (apart_widths(own, other) < closest_widths) return false;
    if (!is_claimed_.at(k) || apart_widths(own, other) > tail_widths) continue;
    if (!is_beside(at, is_weaker ? target : k, is_weaker ? k : target)) return false;
  }
  return true;
}

CrossingCheck::Verdict TargetClaims::crossing(const JointParameters& at, std::size_t one,
                                              std::size_t other) const {
  const DelayLine& a = at.targets.at(one).line;
  const DelayLine& b = at.targets.at(other).line;
  const double apart_ns = std::remainder(b.delay_ns - a.delay_ns, train_.circle_ns);
  const double parting_ns = std::abs(b.travel_ns - a.travel_ns);
  const double widths = (std::abs(apart_ns) + parting_ns / 2) / shape_.width_ns();
  if (parting_ns < least_parting_widths * shape_.width_ns() || widths > most_parted_widths) {
    return {};
  }
  return crossing_check_.judge(likelihood_.near(one), at, one, other);
}

// Whether a weaker target surely moves through the light beside a bright one.
bool TargetClaims::moves_beside(const JointParameters& at, std::size_t target,
                                std::size_t bright) const {
  const double brightest = at.targets.at(bright).signal_per_pulse;
  return at.targets.at(target).signal_per_pulse < least_alike * brightest &&
         moving_light_.judge(likelihood_.near(target), at, target, bright)
             .does_move(nats_for_moving_);
}

// Whether a weaker target is one beside a bright one.
bool TargetClaims::is_beside(const JointParameters& at, std::size_t target, std::size_t bright) {
  const TargetParameters& own = at.targets.at(target);
  const TargetParameters& other = at.targets.at(bright);
  const double apart_ns = std::remainder(other.line.delay_ns - own.line.delay_ns, train_.circle_ns);
  const double side = apart_ns < 0 ? -1 : 1;
  const double apart_widths = std::abs(apart_ns) / shape_.width_ns();
  if (std::abs(own.line.travel_ns - other.line.travel_ns) > together_widths * shape_.width_ns()) {
    return rise_from(at, target, bright, 2.5, 5.5) > deviations_of_valley &&
           rise_from(at, target, bright, -2.5, -5.5) > deviations_of_valley;
  }
  const bool is_close = apart_widths < flank_widths;
  if (is_close && own.signal_per_pulse < least_in_flank * other.signal_per_pulse) {
    const double nats = nats_in_flank(at, target, bright, -side);
    std::optional<double>& odds_nats = shape_odds_nats_.at(target);
    odds_nats = std::min(nats, odds_nats.value_or(nats));
    return nats > nats_for_flank;
  }
  const double rise = rise_again(at, target, bright, side, apart_widths);
  const double behind =
      rise > deviations_of_clear_valley ? most_deviations_behind : deviations_behind;
  return rise > deviations_of_valley && has_nothing_behind(at, target, bright, -side, behind) &&
         (!is_close || has_nothing_behind(at, bright, target, side, deviations_behind));
}

// By how many nats a weak target on one side of a bright one explains the photons there better than
// a bright pulse of another shape does.
double TargetClaims::nats_in_flank(const JointParameters& at, std::size_t target,
                                   std::size_t bright, double side) {
  FlankCheck::Bins counts;
  const double unit_ns = side * shape_.width_ns();
  likelihood_.count_near(bright, at.targets.at(bright).line,
                         shape_.peak_offset_ns() + FlankCheck::first_widths * unit_ns,
                         FlankCheck::bin_widths * unit_ns, counts);
  std::array<FlankCheck::Bins, most_targets> others;
  std::size_t count = 0;
  for (std::size_t k = 0; k < at.count; ++k) {
    // What is not claimed may be a part of the bright pulse: three of them, of which two are too
    // close to be claimed, make one that is 2.5 times as wide.
    if (k == target || k == bright || !is_claimed_.at(k)) continue;
    if (apart_widths(at.targets.at(k), at.targets.at(bright)) > tail_widths) continue;
    others.at(count++) = flank_of(at, k, bright, side);
  }
  return flank_check_.nats_for_target(counts, side, flank_of(at, target, bright, side),
                                      std::span(others).first(count));
}

// The light of one target in the bins beside a bright one.
FlankCheck::Bins TargetClaims::flank_of(const JointParameters& at, std::size_t target,
                                        std::size_t bright, double side) const {
  constexpr int steps = 8;
  const DelayLine& line = at.targets.at(target).line;
  const DelayLine& about = at.targets.at(bright).line;
  const double delay_ns = std::remainder(line.delay_ns - about.delay_ns, train_.circle_ns);
  FlankCheck::Bins light{};
  std::array<double, FlankCheck::bins + 1> ends_ns, integrals;
  for (int step = 0; step < steps; ++step) {
    const double s = (step + 0.5) / steps - 0.5;
    const double off_ns =
        delay_ns + (line.travel_ns - about.travel_ns) * s - shape_.peak_offset_ns();
    for (std::size_t i = 0; i < ends_ns.size(); ++i) {
      const double widths =
          FlankCheck::first_widths + static_cast<double>(i) * FlankCheck::bin_widths;
      ends_ns[i] = side * widths * shape_.width_ns() - off_ns;
    }
    shape_.integrate(ends_ns, integrals);
    for (std::size_t i = 0; i < light.size(); ++i) {
      light[i] += side * (integrals[i + 1] - integrals[i]) / steps;
    }
  }
  return light;
}

// By how many deviations the light that has fallen on the way from a bright target to a weaker one
// rises again. The valley is the middle of the way, or from 2.5 to 5.5 widths beside the weaker
// pulse. 0 where there is too much light in it.
double TargetClaims::rise_again(const JointParameters& at, std::size_t target, std::size_t bright,
                                double side, double apart_widths) {
  const double near = apart_widths < 6 ? apart_widths / 2 - 0.5 : 2.5;
  const double far = apart_widths < 6 ? near + 1 : std::min(5.5, apart_widths - 2.5);
  return rise_from(at, target, bright, side * near, side * far);
}

double TargetClaims::rise_from(const JointParameters& at, std::size_t target, std::size_t bright,
                               double from_widths, double to_widths) {
  const Excess valley = excess_beside(at, target, bright, from_widths, to_widths);
  const double middle = light_of(at, target, target, -0.5, 0.5);
  const double widths = std::abs(to_widths - from_widths);
  const double more = valley.photons / widths;
  const double deviation = valley.deviation / widths;
  return more < most_in_valley * middle + deviation ? (middle - more) / deviation : 0;
}

bool TargetClaims::has_nothing_behind(const JointParameters& at, std::size_t target,
                                      std::size_t other, double side, double deviations) {
  const Excess behind = excess_beside(at, target, other, side * 2, side * 3.5);
  const double photons = at.targets.at(target).signal_per_pulse * exposure_.amplitude;
  return behind.photons < deviations * behind.deviation + most_behind * photons;
}

// The photons at such offsets from a target's pulses, in widths from their peaks, beyond those that
// the fit's background, this target, another, and all that are claimed have there.
TargetClaims::Excess TargetClaims::excess_beside(const JointParameters& at, std::size_t target,
                                                 std::size_t other, double from_widths,
                                                 double to_widths) {
  const double first = std::min(from_widths, to_widths);
  const double last = std::max(from_widths, to_widths);
  const double width_ns = shape_.width_ns();
  const double peak_ns = shape_.peak_offset_ns();
  const double counted = likelihood_.count_near(
      target, at.targets.at(target).line, peak_ns + first * width_ns, peak_ns + last * width_ns);
  const double dark =
      at.background_per_ns * exposure_.seen_ns * train_.pulses_per_ns * (last - first) * width_ns;
  double expected = dark;
  for (std::size_t k = 0; k < at.count; ++k) {
    // What is not claimed may be a part of the target's pulse.
    if (k == target || k == other || is_claimed_.at(k)) {
      expected += light_of(at, k, target, first, last);
    }
  }
  return {counted - expected, std::sqrt(std::max(expected, 1.0))};
}

// The photons that one target has at such offsets from the pulses of another, or of its own.
double TargetClaims::light_of(const JointParameters& at, std::size_t target, std::size_t about,
                              double first_widths, double last_widths) const {
  const int steps = target == about ? 1 : 32;  // along the frame
  const DelayLine& line = at.targets.at(target).line;
  const DelayLine& own = at.targets.at(about).line;
  const double delay_ns = std::remainder(line.delay_ns - own.delay_ns, train_.circle_ns);
  double sum = 0;
  for (int step = 0; step < steps; ++step) {
    const double s = (step + 0.5) / steps - 0.5;
    const double off_ns = delay_ns + (line.travel_ns - own.travel_ns) * s - shape_.peak_offset_ns();
    const double ends_ns[] = {first_widths * shape_.width_ns() - off_ns,
                              last_widths * shape_.width_ns() - off_ns};
    double integrals[2];
    shape_.integrate(ends_ns, integrals);
    sum += integrals[1] - integrals[0];
  }
  return at.targets.at(target).signal_per_pulse * exposure_.amplitude * sum / steps;
}

void TargetClaims::claim_in_rows(const JointParameters& at) {
  if (count() == at.count) return;
  for (std::size_t k = 0; k < at.count; ++k) light_.at(k) = light_about(k, at.targets.at(k).line);
  std::array<bool, most_targets> stands{};
  for (std::size_t k = 0; k < at.count; ++k) {
    stands.at(k) = is_claimed_.at(k) || stands_in_row(at, k);
  }
  is_claimed_ = stands;
}

// Whether the light falls between a target and its neighbours on both sides. A weak target that is
// not claimed is what the others' fit leaves over, and one in a bright one's flank is FlankCheck's.
bool TargetClaims::stands_in_row(const JointParameters& at, std::size_t target) const {
  const TargetParameters& own = at.targets.at(target);
  std::array<std::optional<std::size_t>, 2> neighbours;  // before and behind
  std::array<double, 2> nearest_ns = {train_.circle_ns, train_.circle_ns};
  for (std::size_t k = 0; k < at.count; ++k) {
    const TargetParameters& other = at.targets.at(k);
    const double widths = apart_widths(own, other);
    if (k == target || widths > tail_widths) continue;
    if (!is_claimed_.at(k) && other.signal_per_pulse < least_in_flank * own.signal_per_pulse) {
      continue;
    }
    if (own.signal_per_pulse < least_in_flank * other.signal_per_pulse && widths < flank_widths) {
      return false;
    }
    const double travel_ns = std::abs(own.line.travel_ns - other.line.travel_ns);
    if (widths < closest_widths || travel_ns > together_widths * shape_.width_ns()) return false;
    const double apart_ns =
        std::remainder(other.line.delay_ns - own.line.delay_ns, train_.circle_ns);
    const std::size_t side = apart_ns < 0 ? 0 : 1;
    if (std::abs(apart_ns) > nearest_ns.at(side)) continue;
    nearest_ns.at(side) = std::abs(apart_ns);
    neighbours.at(side) = k;
  }
  return std::all_of(neighbours.begin(), neighbours.end(),
                     [&](const auto& k) { return !k || falls_between(at, target, *k); });
}

bool TargetClaims::falls_between(const JointParameters& at, std::size_t one,
                                 std::size_t other) const {
  const DelayLine& a = at.targets.at(one).line;
  const DelayLine& b = at.targets.at(other).line;
  const DelayLine middle = {
      a.delay_ns + std::remainder(b.delay_ns - a.delay_ns, train_.circle_ns) / 2,
      (a.travel_ns + b.travel_ns) / 2};
  const double between = light_about(one, middle);
  const double least = std::min(light_.at(one), light_.at(other));
  return between < most_between * least &&
         least - between > deviations_of_fall * std::sqrt(least + between);
}

double TargetClaims::light_about(std::size_t target, DelayLine line) const {
  const double peak_ns = shape_.peak_offset_ns();
  const double half_ns = shape_.width_ns() / 2;
  return likelihood_.count_near(target, line, peak_ns - half_ns, peak_ns + half_ns);
}

}  // namespace splid
