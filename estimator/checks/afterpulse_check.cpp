#include "estimator/checks/afterpulse_check.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "estimator/model/units.hpp"

namespace splid {
namespace {

constexpr double widths_of_a_pulse = 4;
constexpr int shift_of_first_lag = 13;  // 2^13 ps are 8.2 ns

// Next detections are looked at up to the lag within which light alone brings two.
constexpr double most_expected = 2;
constexpr std::size_t fewest_rungs = 4;
constexpr std::size_t far_rungs = 2;  // the longest lags, that say how light changes

// Design note: six deviations of the difference of two counts, of which one may be light that
// changes faster than is sure. Chance alone makes five in 3e-7 frames.
constexpr double sure_deviations = 6;
constexpr double doubtful_deviations = 2;  // from which all photons are looked at
constexpr double unsure_deviations = 2;
// Over the longest lags light that changes in 10 us and more loses a third of its excess at most.
constexpr double most_change = 1.5;
constexpr double most_ended = 0.9;  // waits that light ends, up to the longest lag
constexpr int most_distances = 3;
constexpr std::size_t most_looked_at = 262144;  // photons, which take 12 ms
constexpr double most_share = 0.5;              // no detector has more afterpulses: bursts of light
constexpr double biased_deviations = 3;         // of the background
// What the first look asks for of the excess that biases: some afterpulses come after the next
// photon, or after the lag that it looks at.
constexpr double least_at_once = 0.4;
constexpr double at_once_ns = 1000;
constexpr double most_at_once = 0.25;  // detections that light brings up to that lag
constexpr double weak_signal = 0.1;    // of all photons

constexpr std::int64_t lag_ps(std::size_t rung) {
  return std::int64_t{1} << (shift_of_first_lag + rung);
}

std::size_t rung_of(std::int64_t beyond_ps) {
  return static_cast<std::size_t>(
      std::bit_width(static_cast<std::uint64_t>(beyond_ps) >> shift_of_first_lag));
}

// The period after which all parts of a train repeat.
double common_period_ns(const PulseTrain& train) {
  if (train.single()) return train.stretches.front().comb.period_ns;
  const auto is_whole = [](const PulseTrain::Stretch& stretch) { return stretch.copies > 0; };
  const bool has_circle = std::all_of(train.stretches.begin(), train.stretches.end(), is_whole);
  return has_circle ? train.circle_ns : train.period_ns;
}

}  // namespace

AfterpulseCheck::AfterpulseCheck(const PulseTrain& train, const PulseShape& shape,
                                 double dead_time_ns, std::size_t max_photons)
    : mask_(train, shape, max_photons),
      period_ns_(common_period_ns(train)),
      in_pattern_(train.period_ns),
      from_ps_(
          std::llround(std::max(dead_time_ns, widths_of_a_pulse * shape.width_ns()) / ns_per_ps)) {}

// Between detections, all inputs alive, light brings `per_ns` / (1 - per_ns dead time) of them in a
// ns, if it comes to a single one.
std::size_t AfterpulseCheck::longest(double per_ns) const {
  const double alive = std::max(1e-3, 1 - per_ns * static_cast<double>(from_ps_) * ns_per_ps);
  const double most_ns = most_expected * alive / per_ns;
  std::size_t last = rungs - 1;
  while (last > 0 && static_cast<double>(lag_ps(last)) * ns_per_ps > most_ns) --last;
  return last;
}

double AfterpulseCheck::control_lag_ns(const FrameView& frame, std::size_t last) const {
  const double in_tagger = frame.sync.period_ps * ns_per_ps / in_pattern_;
  const double period_ns = period_ns_ * in_tagger;
  const double least_ns = 2 * static_cast<double>(from_ps_ + lag_ps(last)) * ns_per_ps;
  return period_ns * std::ceil(least_ns / period_ns);
}

// So many detections show that a share `least` of them has afterpulses, by five deviations where
// these come at once. A detection takes 15 ns, so that the first look takes 0.5 ms at most.
std::size_t AfterpulseCheck::enough_to_doubt(double per_ns, double least) {
  constexpr double shown_deviations = 5;
  constexpr double fewest = 2048, most = 32768;
  const double by_light = per_ns * static_cast<double>(lag_ps(1)) * ns_per_ps;
  const double wanted = 2 * by_light * std::pow(shown_deviations / least, 2);
  return static_cast<std::size_t>(std::clamp(wanted, fewest, most));
}

// Detections that follow another within a microsecond or less, less those of light that is even.
double AfterpulseCheck::excess_at_once(Times times_ps, double per_ns) const {
  const double lag_ns = std::min(at_once_ns, most_at_once / per_ns);
  const std::int64_t lag = std::llround(lag_ns / ns_per_ps);
  // Design note: signs are counted, as vectors of all processors have no comparison of 64 bits.
  const auto is_negative = [](std::int64_t ps) { return static_cast<std::uint64_t>(ps) >> 63; };
  std::uint64_t sooner = 0, later = 0;
  for (std::size_t i = 0; i + 1 < times_ps.size(); ++i) {
    const std::int64_t beyond_ps = times_ps[i + 1] - times_ps[i] - from_ps_;
    sooner += is_negative(beyond_ps);
    later += is_negative(lag - beyond_ps);
  }
  const auto count = static_cast<double>(times_ps.size() - 1) - static_cast<double>(sooner);
  return count * std::exp(-per_ns * lag_ns) - static_cast<double>(later);
}

// Adds the waits of all instants, with the same instants control_ps later.
void AfterpulseCheck::count(Both& waits, const Looked& photons, std::int64_t control_ps) const {
  const Times times_ps = photons.times_ps;
  const std::size_t later = waits.last + 1;
  const std::int64_t end_ps = times_ps.back() - from_ps_ - lag_ps(waits.last);
  std::size_t next = 0, shared = 0;
  double sharing = 0;
  std::uint32_t instants = 0;
  for (std::size_t i = 0; i + 1 < times_ps.size(); ++i) {
    const std::int64_t instant_ps = times_ps[i] + control_ps;
    if (instant_ps > end_ps) break;
    const std::int64_t gap_ps = times_ps[i + 1] - times_ps[i] - from_ps_;
    if (gap_ps <= 0) continue;
    while (times_ps[next] <= instant_ps) ++next;
    const std::int64_t wait_ps = times_ps[next] - instant_ps - from_ps_;
    if (wait_ps <= 0) continue;
    ++instants;
    const std::size_t after = std::min(rung_of(gap_ps), later);
    waits.after.ended[after] += 1;
    waits.after.counted[after] += photons.counts(i + 1) ? 1 : 0;
    const std::size_t beyond = std::min(rung_of(wait_ps), later);
    waits.beyond.ended[beyond] += 1;
    if (!photons.counts(next)) continue;
    // Several instants may wait for the same detection: their counts come and go together.
    sharing = next == shared ? sharing + 1 : 1;
    shared = next;
    waits.beyond.counted[beyond] += 1;
    waits.beyond.spread[beyond] += 2 * sharing - 1;
  }
  waits.instants += instants;
  ++waits.distances;
}

AfterpulseCheck::Excess AfterpulseCheck::excess(const Looked& photons, double control_ns,
                                                std::size_t last, int distances) const {
  Both waits;
  waits.last = last;
  for (int k = 1; k <= distances; ++k) {
    count(waits, photons, std::llround(k * control_ns / ns_per_ps));
  }
  // In light that comes in bursts most waits are over long before light that is even ends them.
  double waiting = waits.after.ended[last + 1];
  while (waiting < (1 - most_ended) * waits.instants && waits.last >= fewest_rungs) {
    waiting += waits.after.ended[waits.last--];
  }
  // The same gaps were counted at each distance.
  for (std::size_t rung = 0; rung <= waits.last; ++rung) {
    waits.after.spread[rung] = waits.distances * waits.after.counted[rung];
  }
  return excess_of(waits);
}

AfterpulseCheck::Expected AfterpulseCheck::expected(const Waits& waits, double instants,
                                                    std::size_t last) {
  Expected light;
  double waiting = instants, sum = 0, variance = 0;
  for (std::size_t rung = 0; rung <= last; ++rung) {
    const double waited = waiting - waits.ended[rung] / 2 + 1;
    light.sum[rung] = sum += waits.counted[rung] / waited;
    light.variance[rung] = variance += waits.spread[rung] / (waited * waited);
    waiting -= waits.ended[rung];
  }
  return light;
}

AfterpulseCheck::Excess AfterpulseCheck::excess_of(const Both& waits) {
  const Expected after = expected(waits.after, waits.instants, waits.last);
  const Expected beyond = expected(waits.beyond, waits.instants, waits.last);
  const std::size_t near = waits.last - far_rungs;
  // What light that changes adds to the longest lags, as far as that is sure, for each ps.
  const double far_excess =
      after.sum[waits.last] - after.sum[near] - (beyond.sum[waits.last] - beyond.sum[near]);
  const double far_deviation = std::sqrt(after.variance[waits.last] - after.variance[near] +
                                         beyond.variance[waits.last] - beyond.variance[near]);
  const double changing = std::max(0.0, far_excess - unsure_deviations * far_deviation) /
                          static_cast<double>(lag_ps(waits.last) - lag_ps(near));
  Excess surest;
  std::size_t at = 0;
  for (std::size_t rung = 0; rung <= near; ++rung) {
    const double excess = after.sum[rung] - beyond.sum[rung] -
                          most_change * changing * static_cast<double>(lag_ps(rung));
    const double deviation = std::sqrt(after.variance[rung] + beyond.variance[rung]);
    if (!(excess > surest.deviations * deviation)) continue;
    surest.deviations = excess / deviation;
    at = rung;
  }
  // Most afterpulses come within four times the lag that shows them best.
  const std::size_t most = std::min(at + 2, waits.last);
  surest.share = -std::expm1(beyond.sum[most] - after.sum[most]);
  return surest;
}

void AfterpulseCheck::look(const FrameView& frame, Times times_ps, const FoldedFrame& folded,
                           double to_reference, Estimate& estimate) {
  const double seen_ns = frame.seen_ns();
  if (times_ps.size() < 4 || !(seen_ns > 0)) return;
  const Times all_ps = frame.photons_ps;
  const auto photons = static_cast<double>(all_ps.size());
  const double per_ns = photons / seen_ns;
  const std::size_t last = longest(per_ns);
  if (last + 1 < fewest_rungs) return;
  const double deviation = estimate.std_background_per_ns > 0 ? estimate.std_background_per_ns
                                                              : std::sqrt(photons) / seen_ns;
  // The share that biases the background.
  const double least = biased_deviations * deviation / per_ns;
  const bool is_even =
      !estimate.has_values || estimate.background_per_ns > (1 - weak_signal) * per_ns;
  const double biasing = least * static_cast<double>(times_ps.size());
  const Times half_ps = times_ps.subspan(times_ps.size() / 4, times_ps.size() / 2);
  if (is_even && excess_at_once(half_ps, per_ns) < least_at_once * biasing / 2) return;
  const double control_ns = control_lag_ns(frame, last);
  const double looked_ns = static_cast<double>(times_ps.back() - times_ps.front()) * ns_per_ps;
  if (2 * most_distances * control_ns > looked_ns) return;
  // Photons that came in no order have been put in order elsewhere, and have no marks.
  const bool in_order = times_ps.data() >= all_ps.data() &&
                        times_ps.data() + times_ps.size() <= all_ps.data() + all_ps.size();
  const auto look_at = [&](Times some_ps, int distances) {
    const auto first = in_order ? static_cast<std::size_t>(some_ps.data() - all_ps.data()) : 0;
    const auto marks = in_order ? mask_.mark(folded, first, some_ps.size(), to_reference, estimate)
                                : std::span<const std::uint8_t>();
    return excess({some_ps, marks}, control_ns, last, distances);
  };
  const std::size_t few = std::min(times_ps.size(), enough_to_doubt(per_ns, least));
  const Times few_ps = times_ps.subspan((times_ps.size() - few) / 2, few);
  if (look_at(few_ps, 1).deviations < doubtful_deviations) return;
  const std::size_t many = std::min(all_ps.size(), most_looked_at);
  const Times many_ps = all_ps.subspan((all_ps.size() - many) / 2, many);
  const bool is_sorted = in_order && std::is_sorted(many_ps.begin(), many_ps.end());
  const Excess found = look_at(is_sorted ? many_ps : times_ps, most_distances);
  if (found.deviations < sure_deviations || found.share < least || found.share > most_share) return;
  estimate.afterpulse_misfit = found.share;
  if (estimate.std_background_per_ns > 0) {
    estimate.std_background_per_ns =
        std::hypot(estimate.std_background_per_ns, found.share * per_ns);
  }
}

}  // namespace splid
