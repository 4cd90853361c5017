#include "estimator/model/comb.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "estimator/model/units.hpp"

namespace splid {
namespace {

// How much of a comb's light falls on its own pulses again after a shift, from 0 to 1, and how far
// these pulses are from those that they fall on, on average.
struct LightOnItself {
  double share = 0;
  double offset_ns = 0;
};

LightOnItself light_on_itself(const Comb& comb, double shift_ns, double tolerance_ns) {
  double light = 0;
  double moment = 0;
  for (std::size_t p = 0; p < comb.times_ns.size(); ++p) {
    const double nearest = comb.to_nearest_ns(comb.times_ns[p] + shift_ns);
    if (std::abs(nearest) > tolerance_ns) continue;
    light += comb.amplitudes[p];
    moment += comb.amplitudes[p] * nearest;
  }
  return {light / comb.total_amplitude, light > 0 ? moment / light : 0};
}

}  // namespace

Comb::Comb(const PatternSegment& segment) : period_ns(segment.period_ps * ns_per_ps) {
  for (std::size_t p = 0; p < segment.pulse_times_ps.size(); ++p) {
    if (segment.amplitudes[p] <= 0) continue;
    times_ns.push_back(segment.pulse_times_ps[p] * ns_per_ps);
    amplitudes.push_back(segment.amplitudes[p]);
    total_amplitude += segment.amplitudes[p];
    uniform = uniform && segment.amplitudes[p] == amplitudes.front();
  }
  closest_ns = period_ns;
  for (std::size_t p = 0; p < times_ns.size(); ++p) {
    const double next = p + 1 < times_ns.size() ? times_ns[p + 1] : times_ns.front() + period_ns;
    closest_ns = std::min(closest_ns, next - times_ns[p]);
  }
}

double Comb::to_nearest_ns(double time_ns) const {
  const double at = time_ns - period_ns * std::floor(time_ns / period_ns);
  const auto next = std::lower_bound(times_ns.begin(), times_ns.end(), at);
  const double after = (next == times_ns.end() ? times_ns.front() + period_ns : *next) - at;
  const double before = (next == times_ns.begin() ? times_ns.back() - period_ns : *(next - 1)) - at;
  return after < -before ? after : before;
}

std::vector<double> strong_side_lobes_ns(const Comb& comb, double tolerance_ns) {
  // Design note: where 70 % of the pulses land on others, one of the first four does so too, except
  // in 1 of 120 combs. Combs of more than 4096 pulses are random, or would take a second to try.
  constexpr std::size_t tried = 4;
  constexpr std::size_t max_pulses = 4096;
  std::vector<double> copies;
  const std::size_t pulses = comb.times_ns.size();
  if (pulses < 2 || pulses > max_pulses) return copies;
  for (std::size_t from = 0; from < std::min(tried, pulses); ++from) {
    for (std::size_t to = 0; to < pulses; ++to) {
      if (to == from) continue;
      double shift = comb.times_ns[to] - comb.times_ns[from];
      if (shift < 0) shift += comb.period_ns;
      const LightOnItself fallen = light_on_itself(comb, shift, tolerance_ns);
      if (fallen.share < strong_side_lobe) continue;
      shift += fallen.offset_ns;
      const bool known = std::any_of(copies.begin(), copies.end(), [&](double copy) {
        return std::abs(copy - shift) <= tolerance_ns;
      });
      if (!known) copies.push_back(shift);
    }
  }
  std::sort(copies.begin(), copies.end());
  return copies;
}

CombWindow::CombWindow(const Comb& comb, double first_ns, double last_ns)
    : first_ns_(first_ns),
      last_ns_(last_ns),
      uniform_amplitude_(comb.uniform ? comb.amplitudes.front() : 0),
      pulses_a_period_(comb.times_ns.size()),
      amplitude_per_ns_(comb.total_amplitude / comb.period_ns) {
  const auto before = static_cast<int>(std::ceil(std::max(0.0, last_ns) / comb.period_ns)) + 1;
  const auto after = static_cast<int>(std::ceil(std::max(0.0, -first_ns) / comb.period_ns)) + 1;
  for (int turn = -before; turn <= after; ++turn) {
    for (std::size_t p = 0; p < comb.times_ns.size(); ++p) {
      pulses_.push_back({comb.times_ns[p] + turn * comb.period_ns, comb.amplitudes[p]});
    }
  }
  amplitudes_before_.assign(1, 0.0);
  for (const Pulse& pulse : pulses_) {
    amplitudes_before_.push_back(amplitudes_before_.back() + pulse.amplitude);
  }
  // Design note: with 64 buckets for each pulse most buckets are empty where windows are narrow, so
  // that most background photons cost one look into the table. 2^15 buckets of 9 bytes still fit
  // into the second-level cache.
  const std::size_t buckets =
      std::min<std::size_t>(std::size_t{1} << 15, std::bit_ceil(comb.times_ns.size() * 64));
  shift_ = 32 - std::countr_zero(buckets);
  const double buckets_per_ns = static_cast<double>(buckets) / comb.period_ns;
  buckets_.resize(buckets);
  flags_.resize(buckets);
  for (std::size_t k = 0; k < buckets; ++k) {
    // A little wider than the bucket, for the rounding of phases to 2^-32.
    const double lo = (static_cast<double>(k) - 1e-4) / buckets_per_ns - last_ns;
    const double hi = (static_cast<double>(k) + 1 + 1e-4) / buckets_per_ns - first_ns;
    const auto earlier = [](const Pulse& pulse, double time) { return pulse.time_ns < time; };
    const auto begin = std::lower_bound(pulses_.begin(), pulses_.end(), lo, earlier);
    const auto end = std::lower_bound(begin, pulses_.end(), hi, earlier);
    buckets_[k] = {static_cast<std::uint32_t>(begin - pulses_.begin()),
                   static_cast<std::uint32_t>(end - begin)};
    flags_[k] = end > begin ? 1 : 0;
    max_overlap_ = std::max(max_overlap_, static_cast<std::size_t>(end - begin));
  }
}

// Design note: four sums, since the processor adds four numbers in the time that one addition takes
// to be ready for the next. A million photons take a millisecond.
double CombWindow::amplitude_before(std::span<const std::uint32_t> phases_32) const {
  constexpr std::size_t lanes = 4;
  double sums[lanes] = {};
  std::size_t i = 0;
  for (; i + lanes <= phases_32.size(); i += lanes) {
    for (std::size_t k = 0; k < lanes; ++k) {
      sums[k] += amplitudes_before_[buckets_[phases_32[i + k] >> shift_].begin];
    }
  }
  for (; i < phases_32.size(); ++i) {
    sums[0] += amplitudes_before_[buckets_[phases_32[i] >> shift_].begin];
  }
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

}  // namespace splid
