#include "estimator/sync/recording_period.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "estimator/sync/deviations.hpp"
#include "protocol/saturated.hpp"

namespace splid {
namespace {

// A frame may come so many times its length after the frame before it. After a longer pause nobody
// knows whether the pattern played on, nor how its clock wandered meanwhile.
constexpr double longest_step = 4;

// Of the time in which its syncs were.
double length_ps(const SyncFit& fit) {
  return (static_cast<double>(fit.count) + static_cast<double>(fit.missing) -
          static_cast<double>(fit.spurious)) *
         fit.period_ps;
}

// The time from one frame's pattern start to that of another, and how many periods it has.
struct Step {
  double gap_ps;
  double periods;
};

// Nothing where the pattern may have stopped. A clock was set anew, or the generator began
// again: the pattern's starts are then farther from where the fit before expects them than the
// errors of both fits, and an oscillator that wanders, explain.
std::optional<Step> step_between(const SyncFit& before, const SyncFit& fit) {
  const double gap_ps = static_cast<double>(saturated_difference(fit.origin_ps, before.origin_ps)) +
                        fit.phase_ps - before.phase_ps;
  const double period_ps = (fit.period_ps + before.period_ps) / 2;
  const double periods = std::round(gap_ps / period_ps);
  const double longest_ps = longest_step * std::max(length_ps(before), length_ps(fit));
  if (!(periods > 0 && gap_ps < longest_ps)) return std::nullopt;
  const double std_ps = in_quadrature(before.std_phase_ps, fit.std_phase_ps) +
                        periods * (before.std_period_ps + fit.std_period_ps) / 2;
  const double most_off_ps = sure_deviations * std_ps + sync::drift_between_frames * gap_ps + 1;
  if (std::abs(gap_ps - periods * period_ps) > most_off_ps) return std::nullopt;
  return Step{gap_ps, periods};
}

}  // namespace

void RecordingPeriod::add(const SyncFit& fit) {
  if (!fit.locked) return;
  if (runs_.empty()) first_ = fit;
  const auto step = runs_.empty() ? std::nullopt : step_between(runs_.back().last_fit, fit);
  sync::Point start;
  if (step) {
    // Design note: the excess is summed from frame to frame. The product of k and the period passes
    // 2^53 ps after 2.5 hours, and would from then on be rounded to 2 ps and more.
    const sync::Point& last = runs_.back().last;
    start = {last.k + step->periods,
             last.residual_ps + (step->gap_ps - step->periods * first_.period_ps)};
  } else {
    runs_.emplace_back();
  }
  Run& run = runs_.back();
  // Where the syncs have no jitter at all, the tagger's rounding is left.
  const double std_ps = std::max(
      fit.std_phase_ps, sync::least_sigma_ps / 2 / std::sqrt(static_cast<double>(fit.count)));
  run.sums.add(start, 1 / (std_ps * std_ps));
  ++run.starts;
  run.last = start;
  run.last_fit = fit;
}

MeasuredPeriod RecordingPeriod::period() const {
  if (runs_.empty()) return {};
  double kk = 0, ke = 0, ee = 0;
  double free = -1;
  for (const Run& run : runs_) {
    if (run.starts > 1) {
      kk += run.sums.sxx();
      ke += run.sums.sxy();
      ee += run.sums.syy();
      free += static_cast<double>(run.starts) - 1;
      continue;
    }
    // A frame by itself knows the period by its own syncs.
    const double excess_ps = run.last_fit.period_ps - first_.period_ps;
    const double weight = 1 / (run.last_fit.std_period_ps * run.last_fit.std_period_ps);
    kk += weight;
    ke += weight * excess_ps;
    ee += weight * excess_ps * excess_ps;
    free += 1;
  }
  if (!(kk > 0 && std::isfinite(kk))) return {first_.period_ps, first_.std_period_ps};
  const double slope = ke / kk;
  // Clocks may wander more than the jitter of their syncs says. The line is then known no better
  // than the spread of the frames about it says.
  const double wander = free > 0 ? std::max(1.0, (ee - slope * ke) / free) : 1;
  return {first_.period_ps + slope, std::sqrt(wander / kk)};
}

}  // namespace splid
