#include "estimator/sync/recording_period.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "estimator/sync/in_quadrature.hpp"
#include "protocol/saturated.hpp"

namespace splid {
namespace {

// The least standard deviation of a frame's pattern start: what the tagger's rounding leaves where
// the syncs have no jitter at all.
constexpr double least_std_ps = 0.01;

// The periods between two frames can be counted where their sum is known to this part of a period.
constexpr double surely_countable = 1.0 / 8;

// A frame may come so many times its length after the frame before it. After a longer pause nobody
// knows whether the pattern played on, nor how its clock wandered meanwhile.
constexpr double longest_step = 4;

struct Sums {
  double w = 0, k = 0, e = 0;
  std::size_t starts = 0;
};

// Of the time in which its syncs were.
double length_ps(const SyncFit& fit) {
  return (static_cast<double>(fit.count) + static_cast<double>(fit.missing) -
          static_cast<double>(fit.spurious)) *
         fit.period_ps;
}

// The time from one frame's pattern start to that of another, and how many periods it has.
struct Step {
  double gap_ps;
  double period_ps;
  double periods;
};

Step step_between(const SyncFit& before, const SyncFit& fit) {
  const double gap_ps = static_cast<double>(saturated_difference(fit.origin_ps, before.origin_ps)) +
                        fit.phase_ps - before.phase_ps;
  const double period_ps = (fit.period_ps + before.period_ps) / 2;
  return {gap_ps, period_ps, std::round(gap_ps / period_ps)};
}

// Whether the generator began again between two fits: the pattern's starts are then farther from
// where the fit before expects them than the errors of both fits, and an oscillator that wanders by
// 0.1 ppm, explain.
bool began_again(const SyncFit& before, const SyncFit& fit, const Step& step) {
  constexpr double wander = 1e-7;
  constexpr double deviations = 10;
  const double std_ps = in_quadrature(before.std_phase_ps, fit.std_phase_ps) +
                        step.periods * (before.std_period_ps + fit.std_period_ps) / 2;
  return std::abs(step.gap_ps - step.periods * step.period_ps) >
         deviations * std_ps + wander * step.gap_ps + 1;
}

// Whether it is sure that the pattern played on between two fits, and how many periods.
bool played_on(const SyncFit& before, const SyncFit& fit, const Step& step) {
  if (!(step.periods > 0)) return false;
  const double off_by = step.periods * (fit.std_period_ps + before.std_period_ps) / step.period_ps;
  const double longest_ps = longest_step * std::max(length_ps(before), length_ps(fit));
  return off_by < surely_countable && step.gap_ps < longest_ps && !began_again(before, fit, step);
}

}  // namespace

void RecordingPeriod::add(const SyncFit& fit) {
  if (!fit.locked) return;
  const double std_ps = std::max(fit.std_phase_ps, least_std_ps);
  Start start{0, 0, 0, 1 / (std_ps * std_ps), 0, 0};
  if (starts_.empty()) {
    first_period_ps_ = fit.period_ps;
    first_std_period_ps_ = fit.std_period_ps;
  } else {
    // Design note: the excess is summed from frame to frame. The product of k and the period passes
    // 2^53 ps after 2.5 hours, and would from then on be rounded to 2 ps and more.
    const Step step = step_between(last_, fit);
    const Start& before = starts_.back();
    start.run = before.run;
    if (played_on(last_, fit, step)) {
      start.k = before.k + step.periods;
      start.excess_ps = before.excess_ps + (step.gap_ps - step.periods * first_period_ps_);
    } else {
      ++start.run;
    }
  }
  start.period_excess_ps = fit.period_ps - first_period_ps_;
  start.std_period_ps = fit.std_period_ps;
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
    ++mean.starts;
  }
  double kk = 0, ke = 0, ee = 0;
  double free = -1;
  for (const Sums& mean : means)
    free += mean.starts == 1 ? 1 : static_cast<double>(mean.starts) - 1;
  for (const Start& s : starts_) {
    const Sums& mean = means[s.run];
    double k = s.k - mean.k / mean.w;
    double e = s.excess_ps - mean.e / mean.w;
    double weight = s.weight;
    if (mean.starts == 1) {
      // A frame by itself knows the period by its own syncs.
      k = 1;
      e = s.period_excess_ps;
      weight = 1 / (s.std_period_ps * s.std_period_ps);
    }
    kk += weight * k * k;
    ke += weight * k * e;
    ee += weight * e * e;
  }
  if (!(kk > 0 && std::isfinite(kk))) return {first_period_ps_, first_std_period_ps_};
  const double slope = ke / kk;
  // Clocks may wander more than the jitter of their syncs says. The line is then known no better
  // than the spread of the frames about it says.
  const double wander = free > 0 ? std::max(1.0, (ee - slope * ke) / free) : 1;
  return {first_period_ps_ + slope, std::sqrt(wander / kk)};
}

}  // namespace splid
