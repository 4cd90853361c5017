#include "estimator/sync/sync_lock.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/sync/deviations.hpp"
#include "estimator/sync/round_quickly.hpp"
#include "estimator/sync/sync_curvature.hpp"

namespace splid::sync {
namespace {

constexpr std::size_t first_walk = 64;    // syncs that are followed one by one
constexpr std::size_t growth = 8;         // each later step takes so many times more syncs
constexpr std::size_t curved_growth = 4;  // the same along a curved clock, see departure()
constexpr std::size_t early_seeds = 8;

// So many of the syncs, doubles aside, or of the gaps between them, have to be on the line.
constexpr double min_agreeing = 0.6;

constexpr std::size_t mad_sample = 1024;  // the median's standard error is then 4 %

// How far from a line a sync may be: window_ps at period number `centre`, and slope_ps more for
// each period further away.
struct Gate {
  double window_ps = 0;
  double slope_ps = 0;
  double centre = 0;
};

// Follows the syncs from a seed on, one by one. How many periods a step has is counted with a
// period that is known the better the longer the way: at first to within the ratio `drift`, later
// to within twice the window over the way.
class Walk {
 public:
  Walk(double seed_ps, double period_ps, double drift)
      : first_ps_(seed_ps),
        last_ps_(seed_ps),
        given_ps_(period_ps),
        drift_(drift),
        known_(drift),
        period_ps_(period_ps),
        window_ps_(first_window_ps(period_ps)) {}

  void take(double x_ps) {
    const double step_ps = x_ps - last_ps_;
    const double steps = round_quickly(step_ps / period_ps_);
    const double off_ps = std::abs(step_ps - steps * period_ps_);
    const double slack_ps = window_ps_ + std::abs(step_ps) * known_;
    if (slack_ps > period_ps_ / 4) {
      // The gap is too long to say how many periods it has: the walk begins again behind the gap,
      // and keeps the period that it has found so far.
      first_ps_ = last_ps_ = x_ps;
      steps_ = 0;
    } else if (off_ps > slack_ps) {
      if (off_ps > period_ps_ * window_of_period) ++astray_;
    } else if (steps > 0) {
      ++accepted_;
      last_ps_ = x_ps;
      steps_ += steps;
      const double way_ps = last_ps_ - first_ps_;
      known_ = std::min(known_, 2 * window_ps_ / way_ps);
      period_ps_ = std::clamp(way_ps / steps_, given_ps_ * (1 - drift_), given_ps_ * (1 + drift_));
    }
  }

  [[nodiscard]] bool agrees() const {
    return accepted_ + 1 >= least_syncs &&
           static_cast<double>(accepted_) >=
               min_agreeing * static_cast<double>(accepted_ + astray_);
  }
  [[nodiscard]] Line line() const { return {first_ps_, period_ps_}; }

 private:
  double first_ps_, last_ps_;
  double given_ps_, drift_;
  double known_;  // the period is known to within this ratio
  double period_ps_;
  double window_ps_;
  double steps_ = 0;
  std::size_t accepted_ = 0;  // syncs beside the seed
  std::size_t astray_ = 0;
};

// From the median absolute residual about the mean, of an evenly thinned sample. The residuals are
// overwritten.
double sigma_about(double mean_ps, std::span<double> residuals) {
  const std::size_t stride = (residuals.size() + mad_sample - 1) / mad_sample;
  std::size_t sample = 0;
  for (std::size_t i = 0; i < residuals.size(); i += stride) {
    residuals[sample++] = std::abs(residuals[i] - mean_ps);
  }
  return robust_sigma_ps(residuals.first(sample));
}

// The syncs within the gate about a line; nothing where too few of the syncs are. Of several syncs
// in one period the nearest stays, and the others count as doubles. Growing lines are straight and
// need no sums of a parabola: with these, and with the curvature, their passes would take a quarter
// longer.
template <bool may_curve>
std::optional<Accepted> gather(std::span<const double> syncs, const Line& about, const Gate& gate,
                               std::span<double> scratch) {
  const Line line = about.at_origin();
  const double per_ps = 1 / line.period_ps;
  const double near_ps = line.period_ps * window_of_period;
  std::size_t count = 0;  // accepted
  std::size_t near = 0;   // not accepted, but doubles, or near the line
  bool any = false;
  Point first, pending;
  Sums sums;
  const auto accept = [&] {
    if (!any) return;
    if (count == 0) first = pending;
    scratch[count++] = pending.residual_ps;
    sums.add(pending);
    if constexpr (may_curve) sums.add_for_parabola(pending);
  };
  for (const double x_ps : syncs) {
    const double from_phase_ps = (may_curve ? line.straight_ps(x_ps) : x_ps) - line.phase_ps;
    const double k = round_quickly(from_phase_ps * per_ps);
    const double residual_ps = from_phase_ps - k * line.period_ps;
    const double off_ps = std::abs(residual_ps);
    if (off_ps > gate.window_ps + std::abs(k - gate.centre) * gate.slope_ps) {
      if (off_ps < near_ps) ++near;
    } else if (any && k == pending.k) {
      ++near;
      if (off_ps < std::abs(pending.residual_ps)) pending.residual_ps = residual_ps;
    } else {
      accept();
      any = true;
      pending = {k, residual_ps};
    }
  }
  accept();
  if (count < least_syncs || sums.n < min_agreeing * static_cast<double>(syncs.size() - near)) {
    return std::nullopt;
  }
  return Accepted{line, sums, first, pending, sigma_about(sums.r / sums.n, scratch.first(count))};
}

// The syncs about a line that is known; then once more, now that the line has settled and its
// outliers are known. wander_ps: by how much more than their jitter syncs may be off the line.
std::optional<Accepted> settle(std::span<const double> syncs, const Line& line, const Gate& gate,
                               double wander_ps, std::span<double> scratch) {
  const auto pass = gather<true>(syncs, line, gate, scratch);
  if (!pass) return std::nullopt;
  const Line settled = regressed(pass->line, pass->sums);
  return gather<true>(syncs, settled, {sure_deviations * pass->sigma_ps + wander_ps, 0, 0},
                      scratch);
}

// Extends the line of a walk over ever more syncs until it goes through all of them; nothing where
// at some step too few of the syncs lie on it.
std::optional<Accepted> grow(std::span<const double> syncs, std::size_t seed, Line line,
                             std::span<double> scratch) {
  Gate gate{first_window_ps(line.period_ps), 0, 0};
  std::size_t count = std::min(first_walk, syncs.size() - seed);
  while (true) {
    const auto pass = gather<false>(syncs.subspan(seed, count), line, gate, scratch);
    if (!pass) return std::nullopt;
    const Sums& s = pass->sums;
    line = regressed(pass->line, s);
    const double slope_ps = s.sxx() > 0 ? pass->sigma_ps / std::sqrt(s.sxx()) : 0;
    gate = {sure_deviations * pass->sigma_ps, sure_deviations * slope_ps, s.k / s.n};
    if (seed + count == syncs.size()) return settle(syncs, line, gate, 0, scratch);
    count = std::min(count * growth, syncs.size() - seed);
  }
}

// Twice, as a curvature that is still unknown widens the spread of the syncs.
std::optional<Departure> curved_departure(std::span<const double> syncs, const Line& line) {
  const auto first = departure(syncs, line);
  return first ? departure(syncs, first->line) : std::nullopt;
}

// Extends the line of a walk as grow() does, along a clock whose rate changes.
std::optional<Accepted> follow(std::span<const double> syncs, std::size_t seed, Line line,
                               std::span<double> scratch) {
  std::size_t count = std::min(first_walk, syncs.size() - seed);
  while (count < syncs.size() - seed) {
    const auto curved = curved_departure(syncs.subspan(seed, count), line);
    if (!curved) return std::nullopt;
    line = curved->line;
    count = std::min(count * curved_growth, syncs.size() - seed);
  }
  const auto curved = curved_departure(syncs, line);
  if (!curved) return std::nullopt;
  const double window_ps = sure_deviations * curved->sigma_ps + curved->wander_ps;
  return settle(syncs, curved->line, {window_ps, 0, 0}, curved->wander_ps, scratch);
}

// Whether most syncs are near the line, and do not depart from it by more than chance.
bool is_straight(std::span<const double> syncs, const Line& line) {
  const auto found = departure(syncs, line);
  return found && found->wander_ps == 0 && found->line.curvature_per_ps == 0;
}

}  // namespace

// Tries several seeds near the beginning, as the first sync may be a stray.
std::optional<Accepted> lock(std::span<const double> syncs, double period_ps, double drift,
                             bool may_curve, std::span<double> scratch) {
  const std::size_t early = std::min(early_seeds, syncs.size() - least_syncs + 1);
  for (std::size_t i = 1; i <= early; ++i) {
    const std::size_t seed = i % early;
    if (is_double(syncs, seed, period_ps)) continue;
    Walk walk(syncs[seed], period_ps, drift);
    const std::size_t end = std::min(syncs.size(), seed + first_walk);
    for (std::size_t k = seed + 1; k < end; ++k) walk.take(syncs[k]);
    if (!walk.agrees()) continue;
    const auto straight = grow(syncs, seed, walk.line(), scratch);
    if (may_curve && !(straight && is_straight(syncs, straight->line))) {
      if (const auto curved = follow(syncs, seed, walk.line(), scratch)) return curved;
    }
    if (straight) return straight;
  }
  return std::nullopt;
}

}  // namespace splid::sync
