#include "estimator/sync/sync_line.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "protocol/saturated.hpp"

namespace splid {
namespace {

// Of a frame's start: what the tagger's rounding leaves where syncs have no jitter at all.
constexpr double least_std_ps = 0.01;

// Between two frames, as a part of a period.
constexpr double surely_countable = 1.0 / 8;

struct Sums {
  double w = 0, k = 0, e = 0;
};

}  // namespace

void SyncLine::add(const SyncFit& fit) {
  if (!fit.locked) return;
  const double std_ps = std::max(fit.std_phase_ps, least_std_ps);
  Start start{0, 0, 0, 1 / (std_ps * std_ps)};
  if (starts_.empty()) {
    first_period_ps_ = fit.period_ps;
    first_std_period_ps_ = fit.std_period_ps;
  } else {
    // Design note: the excess is summed from frame to frame. k times the period, formed at once,
    // passes 2^53 ps after 2.5 hours and would be rounded to 2 ps and more.
    const double gap_ps =
        static_cast<double>(saturated_difference(fit.origin_ps, last_.origin_ps)) + fit.phase_ps -
        last_.phase_ps;
    const double period_ps = (fit.period_ps + last_.period_ps) / 2;
    const double periods = std::round(gap_ps / period_ps);
    const double off_by = periods * (fit.std_period_ps + last_.std_period_ps) / period_ps;
    const Start& before = starts_.back();
    start.stretch = before.stretch;
    if (periods > 0 && off_by < surely_countable && !is_cut_) {
      start.k = before.k + periods;
      start.excess_ps = before.excess_ps + (gap_ps - periods * first_period_ps_);
    } else {
      ++start.stretch;
    }
  }
  is_cut_ = false;
  starts_.push_back(start);
  last_ = fit;
}

SyncLine::Period SyncLine::period() const {
  if (starts_.empty()) return {};
  std::vector<Sums> means(starts_.back().stretch + std::size_t{1});
  for (const Start& s : starts_) {
    Sums& mean = means[s.stretch];
    mean.w += s.weight;
    mean.k += s.weight * s.k;
    mean.e += s.weight * s.excess_ps;
  }
  double kk = 0, ke = 0, ee = 0;
  for (const Start& s : starts_) {
    const Sums& mean = means[s.stretch];
    const double k = s.k - mean.k / mean.w;
    const double e = s.excess_ps - mean.e / mean.w;
    kk += s.weight * k * k;
    ke += s.weight * k * e;
    ee += s.weight * e * e;
  }
  if (!(kk > 0)) return {first_period_ps_, first_std_period_ps_};
  const double slope = ke / kk;
  const auto free = static_cast<double>(starts_.size()) - static_cast<double>(means.size()) - 1;
  // Clocks wander more than their syncs' jitter says: the line is then no better known than what
  // is left about it.
  const double wander = free > 0 ? std::max(1.0, (ee - slope * ke) / free) : 1;
  return {first_period_ps_ + slope, std::sqrt(wander / kk)};
}

}  // namespace splid
