#include "estimator/sync/recording_period.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "protocol/saturated.hpp"

namespace splid {
namespace {

// The least standard deviation of a frame's pattern start: what the tagger's rounding leaves where
// the syncs have no jitter at all.
constexpr double least_std_ps = 0.01;

// The periods between two frames can be counted where their sum is known to this part of a period.
constexpr double surely_countable = 1.0 / 8;

struct Sums {
  double w = 0, k = 0, e = 0;
};

}  // namespace

void RecordingPeriod::add(const SyncFit& fit) {
  if (!fit.locked) return;
  const double std_ps = std::max(fit.std_phase_ps, least_std_ps);
  Start start{0, 0, 0, 1 / (std_ps * std_ps)};
  if (starts_.empty()) {
    first_period_ps_ = fit.period_ps;
    first_std_period_ps_ = fit.std_period_ps;
  } else {
    // Design note: the excess is summed from frame to frame. The product of k and the period passes
    // 2^53 ps after 2.5 hours, and would from then on be rounded to 2 ps and more.
    const double gap_ps =
        static_cast<double>(saturated_difference(fit.origin_ps, last_.origin_ps)) + fit.phase_ps -
        last_.phase_ps;
    const double period_ps = (fit.period_ps + last_.period_ps) / 2;
    const double periods = std::round(gap_ps / period_ps);
    const double off_by = periods * (fit.std_period_ps + last_.std_period_ps) / period_ps;
    const Start& before = starts_.back();
    start.run = before.run;
    if (periods > 0 && off_by < surely_countable && !is_cut_) {
      start.k = before.k + periods;
      start.excess_ps = before.excess_ps + (gap_ps - periods * first_period_ps_);
    } else {
      ++start.run;
    }
  }
  is_cut_ = false;
  starts_.push_back(start);
  last_ = fit;
}

MeasuredPeriod RecordingPeriod::period() const {
  if (starts_.empty()) return {};
  std::vector<Sums> means(starts_.back().run + std::size_t{1});
  for (const Start& s : starts_) {
    Sums& mean = means[s.run];
    mean.w += s.weight;
    mean.k += s.weight * s.k;
    mean.e += s.weight * s.excess_ps;
  }
  double kk = 0, ke = 0, ee = 0;
  for (const Start& s : starts_) {
    const Sums& mean = means[s.run];
    const double k = s.k - mean.k / mean.w;
    const double e = s.excess_ps - mean.e / mean.w;
    kk += s.weight * k * k;
    ke += s.weight * k * e;
    ee += s.weight * e * e;
  }
  if (!(kk > 0)) return {first_period_ps_, first_std_period_ps_};
  const double slope = ke / kk;
  const auto free = static_cast<double>(starts_.size()) - static_cast<double>(means.size()) - 1;
  // Clocks may wander more than the jitter of their syncs says. The line is then known no better
  // than the spread of the frames about it says.
  const double wander = free > 0 ? std::max(1.0, (ee - slope * ke) / free) : 1;
  return {first_period_ps_ + slope, std::sqrt(wander / kk)};
}

}  // namespace splid
