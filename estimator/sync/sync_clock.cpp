#include "estimator/sync/sync_clock.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "estimator/sync/deviations.hpp"
#include "estimator/sync/drift_regression.hpp"
#include "estimator/sync/sync_curvature.hpp"
#include "estimator/sync/sync_lock.hpp"

namespace splid {
namespace {

using sync::Accepted;
using sync::Line;

// Pattern starts in [begin, end) that no accepted sync belongs to. Those within a sync's jitter of
// either end are left out, since their syncs may be in the next frame.
double missing_syncs(const Accepted& accepted, double begin_ps, double end_ps, double scale) {
  const double margin_ps = sure_deviations * accepted.sigma_ps;
  const auto from = [&](double x_ps) {
    const Line& line = accepted.line;
    return std::ceil((line.straight_ps(x_ps) - line.phase_ps) / line.period_ps);
  };
  const double low = from(begin_ps + margin_ps);
  const double high = from(end_ps - margin_ps);
  double inside = accepted.sums.n;
  if (accepted.first.k < low) inside -= 1;
  if (accepted.last.k >= high) inside -= 1;
  return std::max(high - low - inside * scale, 0.0);
}

// Syncs that wander: what they leave uncertain does not fall with their number, as any of the
// places they are at may be the right one.
void widen_by(double wander_ps, double length_ps, SyncFit& fit) {
  fit.std_phase_ps = in_quadrature(fit.std_phase_ps, wander_ps / 2);
  fit.std_period_ps = in_quadrature(fit.std_period_ps, wander_ps * fit.period_ps / length_ps);
}

}  // namespace

SyncClock::SyncClock(double calibrated_period_ps, DriftMethod method, std::size_t max_syncs,
                     double max_drift_ppm)
    : calibrated_period_ps_(calibrated_period_ps),
      method_(method),
      max_drift_ppm_(max_drift_ppm),
      period_ps_(calibrated_period_ps),
      position_(std::max(max_syncs, sync::least_syncs)),
      residual_(position_.size()) {}

SyncFit SyncClock::fit(std::span<const std::int64_t> syncs_ps, std::int64_t begin_ps,
                       std::int64_t end_ps) {
  SyncFit fit;
  fit.origin_ps = begin_ps + (end_ps - begin_ps) / 2;
  fit.period_ps = period_ps_;
  fit.count = syncs_ps.size();
  const std::size_t stride = (syncs_ps.size() + position_.size() - 1) / position_.size();
  std::size_t taken = 0;
  for (std::size_t i = 0; i < syncs_ps.size(); i += stride) {
    position_[taken++] = static_cast<double>(syncs_ps[i] - fit.origin_ps);
  }
  if (taken < sync::least_syncs) return fit;

  const std::span<const double> syncs(position_.data(), taken);
  const double max_drift = max_drift_ppm_ * 1e-6;
  const bool may_curve = method_ == DriftMethod::regression;
  // A line as the last one is looked for first, and one within max_drift_ppm of the calibrated
  // period only where there is none.
  auto found = sync::lock(syncs, period_ps_, sync::drift_between_frames, may_curve, residual_);
  if (!found) found = sync::lock(syncs, calibrated_period_ps_, max_drift, may_curve, residual_);
  if (!found) return fit;
  const Accepted& accepted = *found;
  const double period_ps = sync::regressed(accepted.line, accepted.sums).period_ps;
  if (std::abs(period_ps / calibrated_period_ps_ - 1) > max_drift) return fit;

  fit.locked = true;
  period_ps_ = period_ps;
  sync::fill_period(fit, method_, calibrated_period_ps_, accepted);  // [P] Eq. 19
  const auto length_ps = static_cast<double>(end_ps - begin_ps);
  const auto departure = sync::departure(syncs, accepted.line);
  const double wander_ps = departure ? departure->wander_ps : 0;
  if (wander_ps > 0) {
    widen_by(wander_ps, length_ps, fit);
  } else if (may_curve) {
    sync::fill_curvature(fit, length_ps / 2, calibrated_period_ps_, accepted);
  }
  const double scale = static_cast<double>(syncs_ps.size()) / static_cast<double>(taken);
  fit.missing = static_cast<std::size_t>(
      missing_syncs(accepted, static_cast<double>(begin_ps - fit.origin_ps),
                    static_cast<double>(end_ps - fit.origin_ps), scale));
  const double expected = std::min(accepted.sums.n * scale, static_cast<double>(fit.count));
  fit.spurious = fit.count - static_cast<std::size_t>(std::lround(expected));
  return fit;
}

}  // namespace splid
