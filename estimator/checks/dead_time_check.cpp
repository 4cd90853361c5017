#include "estimator/checks/dead_time_check.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/checks/middle_photons.hpp"
#include "estimator/model/units.hpp"

namespace splid {
namespace {

constexpr double pulse_widths = 4;
constexpr double least_excess = 1.05;  // of the blind time over the configured dead time
constexpr double signal_deviations = 0.5;
constexpr double background_deviations = 3;

// Design note: where 30 are expected and more, a dark count or a tag out of order may come too
// early, and some jitter is forgiven: of the expected pairs 2 and a fiftieth. Chance leaves so few
// of 30 in one frame of 1e10.
constexpr double least_pairs = 30;
constexpr double few_pairs = 2;
constexpr double most_early = 0.02;

// Several inputs are blind each on their own: of the pairs that would be, those on one input are
// missing. At least half of these must be, by so many deviations.
constexpr double least_missing = 0.5;
constexpr double deviations_of_missing = 7;
constexpr double ladder = 1.5;  // from one time that is looked at to the next
constexpr int most_rungs = 24;
constexpr double over = 0.7;  // as at twice the blind time, where nothing more is missing

// What several inputs lack within a time.
struct Missing {
  double deviations;  // the missing pairs over what chance makes
  double blind_ns;    // that it takes for them to be missing
};

// How many pairs of photons are from_ps to to_ps apart.
double count_pairs(std::span<const std::int64_t> times_ps, std::int64_t from_ps,
                   std::int64_t to_ps) {
  std::size_t first = 0, last = 0;
  std::uint64_t pairs = 0;
  for (const std::int64_t t : times_ps) {
    while (first < times_ps.size() && times_ps[first] < t + from_ps) ++first;
    while (last < times_ps.size() && times_ps[last] < t + to_ps) ++last;
    pairs += last - first;
  }
  return static_cast<double>(pairs);
}

std::int64_t in_ps(double ns) { return std::llround(ns / ns_per_ps); }

}  // namespace

DeadTimeCheck::DeadTimeCheck(const PulseTrain& train, const PulseShape& shape, double dead_time_ns,
                             std::size_t inputs)
    : train_(train),
      pulse_ns_(pulse_widths * shape.width_ns()),
      dead_time_ns_(dead_time_ns),
      inputs_(static_cast<double>(inputs)) {
  gaps_ps_.reserve(MiddlePhotons::most);
}

// Whether what is lost beyond the configured dead time biases a value. The blind time after each
// detection lowers signal and background by its share of the time; a pulse's own first photon
// lowers the signal by S / 2, unless a dead time is known.
bool DeadTimeCheck::biases(const Light& light, double blind_ns) const {
  const double lost = light.per_ns / inputs_ * std::max(0.0, blind_ns - dead_time_ns_);
  const double of_pulse = dead_time_ns_ < pulse_ns_ && blind_ns >= pulse_ns_ ? light.S / 2 : 0;
  return (lost + of_pulse) * light.in_deviations > signal_deviations ||
         lost * std::sqrt(light.photons) > background_deviations;
}

// The shortest blind time that biases a value and that so many pairs tell.
double DeadTimeCheck::least_ns(const Light& light, double pairs) const {
  const double of_pulse = dead_time_ns_ < pulse_ns_ ? light.S / 2 : 0;
  const double from_ns = dead_time_ns_;
  const double per_input = light.per_ns / inputs_;
  double lost = background_deviations / std::sqrt(light.photons);
  if (light.in_deviations > 0) {
    lost = std::min(lost, signal_deviations / light.in_deviations - of_pulse);
  }
  const double pulses = train_.pulses_per_ns * light.looked / light.per_ns;
  const bool pulses_tell =
      of_pulse > 0 && pulses * inputs_ * inputs_ * light.S * light.S / 2 >= pairs;
  const double telling_ns = pulses_tell ? 0 : 2 * pairs / (light.looked * light.per_ns);
  return std::max(
      {pulse_ns_, least_excess * from_ns, from_ns + lost / per_input, from_ns + telling_ns});
}

// The pairs that independent light has within to_ns, beyond the configured dead time.
double DeadTimeCheck::control(Times times_ps, double to_ns, double period_ns) const {
  const double lag_ns = period_ns * std::ceil(2 * to_ns / period_ns);
  return count_pairs(times_ps, in_ps(lag_ns + dead_time_ns_), in_ps(lag_ns + to_ns));
}

std::optional<double> DeadTimeCheck::shortest_gap_ns(Times times_ps, const Light& light,
                                                     double period_ns) {
  const double least = least_ns(light, least_pairs);
  const std::int64_t least_ps = in_ps(least);
  std::size_t early = 0;
  for (std::size_t i = 0; i + 1 < times_ps.size(); ++i) {
    early += times_ps[i + 1] - times_ps[i] < least_ps ? 1 : 0;
  }
  const double even = light.looked * light.per_ns * (least - dead_time_ns_) / 2;
  const double forgiven = few_pairs + most_early * std::min(even, light.looked);
  if (static_cast<double>(early) > forgiven) return std::nullopt;
  gaps_ps_.clear();
  for (std::size_t i = 0; i + 1 < times_ps.size(); ++i) {
    gaps_ps_.push_back(times_ps[i + 1] - times_ps[i]);
  }
  const auto shortest = static_cast<std::size_t>(forgiven);
  if (shortest >= gaps_ps_.size()) return std::nullopt;
  std::nth_element(gaps_ps_.begin(), gaps_ps_.begin() + static_cast<std::ptrdiff_t>(shortest),
                   gaps_ps_.end());
  const double gap_ns = static_cast<double>(gaps_ps_[shortest]) * ns_per_ps;
  const double expected = control(times_ps, gap_ns, period_ns);
  if (expected < least_pairs || forgiven > most_early * expected + few_pairs) return std::nullopt;
  return gap_ns;
}

std::optional<double> DeadTimeCheck::gap_of_inputs_ns(Times times_ps, const Light& light,
                                                      double period_ns) const {
  // As many as can be missing by so many deviations.
  const double pairs = 2 * std::pow(deviations_of_missing * inputs_ / least_missing, 2);
  const auto missing_within = [&](double ns) {
    const double expected = control(times_ps, ns, period_ns);
    const double seen = count_pairs(times_ps, in_ps(dead_time_ns_) + 1, in_ps(ns));
    const double spread = std::sqrt((expected + seen) * (1 + 2 * light.per_ns * ns));
    const double missing = expected - seen;
    if (missing < least_missing * expected / inputs_) return Missing{0, 0};
    // Pairs on one input are missing up to the blind time alone.
    const double share = std::clamp(inputs_ * missing / expected, 0.0, 1.0);
    return Missing{missing / spread, dead_time_ns_ + share * (ns - dead_time_ns_)};
  };
  double ns = least_ns(light, pairs);
  Missing surest = missing_within(ns);
  if (!(surest.deviations >= deviations_of_missing)) return std::nullopt;
  for (int rung = 0; rung < most_rungs; ++rung) {
    ns *= ladder;
    const Missing next = missing_within(ns);
    if (next.deviations < over * surest.deviations) break;
    if (next.deviations > surest.deviations) surest = next;
  }
  return surest.blind_ns;
}

std::optional<double> DeadTimeCheck::misfit_ns(const FrameView& frame, Times times_ps,
                                               const Estimate& estimate) {
  const double seen_ns = frame.seen_ns();
  if (frame.photons_ps.size() < 2 || !(seen_ns > 0)) return std::nullopt;
  Light light{};
  light.photons = static_cast<double>(frame.photons_ps.size());
  light.per_ns = light.photons / seen_ns;
  light.looked = static_cast<double>(times_ps.size());
  if (estimate.has_values && estimate.std_signal_per_pulse > 0) {
    light.S = estimate.signal_per_pulse * train_.mean_amplitude() / inputs_;
    light.in_deviations = estimate.signal_per_pulse / estimate.std_signal_per_pulse;
  }
  // The pattern's own period, and of rates in turn that of the first.
  const double in_tagger = frame.sync.period_ps * ns_per_ps / train_.period_ns;
  const double period_ns = train_.stretches.front().comb.period_ns * in_tagger;
  const std::optional<double> blind_ns = inputs_ > 1 ? gap_of_inputs_ns(times_ps, light, period_ns)
                                                     : shortest_gap_ns(times_ps, light, period_ns);
  if (!blind_ns || *blind_ns < least_excess * dead_time_ns_ || !biases(light, *blind_ns)) {
    return std::nullopt;
  }
  return blind_ns;
}

}  // namespace splid
