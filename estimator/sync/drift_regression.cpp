#include "estimator/sync/drift_regression.hpp"

#include <cmath>

namespace splid::sync {

Line Line::at_origin() const {
  return {phase_ps - std::round(phase_ps / period_ps) * period_ps, period_ps};
}

// [P] Eq. 19, the measured pattern period, as the slope of a regression through all syncs.
Line regressed(const Line& line, const Sums& sums) {
  const double sxx = sums.sxx();
  const double slope = sxx > 0 ? (sums.kr - sums.k * sums.r / sums.n) / sxx : 0;
  const double offset = (sums.r - slope * sums.k) / sums.n;
  return {line.phase_ps + offset, line.period_ps + slope};
}

void fill_period(SyncFit& fit, DriftMethod method, double calibrated_ps, const Accepted& accepted) {
  const Sums& s = accepted.sums;
  const double sxx = s.sxx();
  const Line best = regressed(accepted.line, s);
  const double best_offset = best.phase_ps - accepted.line.phase_ps;
  const double best_slope = best.period_ps - accepted.line.period_ps;
  const double sigma_ps = std::sqrt(s.squares(best_offset, best_slope) / std::max(s.n - 2, 1.0));
  double offset = best_offset;
  double slope = best_slope;
  double mean_k = s.k / s.n;
  fit.std_period_ps = sigma_ps / std::sqrt(sxx);
  fit.std_phase_ps = sigma_ps * std::sqrt(1 / s.n + mean_k * mean_k / sxx);
  if (method == DriftMethod::endpoints) {
    // [P] Eq. 19 as it is printed: the time from the first sync to the last, divided by the number
    // of periods between them.
    const Point& first = accepted.first;
    const Point& last = accepted.last;
    const double span = last.k - first.k;
    slope = (last.residual_ps - first.residual_ps) / span;
    offset = first.residual_ps - slope * first.k;
    fit.std_period_ps = sigma_ps * std::sqrt(2.0) / span;
    fit.std_phase_ps = sigma_ps * std::hypot(last.k, first.k) / span;
  } else if (method == DriftMethod::off) {
    slope = calibrated_ps - accepted.line.period_ps;
    offset = (s.r - slope * s.k) / s.n;
    fit.std_period_ps = 0;
    fit.std_phase_ps = sigma_ps / std::sqrt(s.n);
  }
  const Line line =
      Line{accepted.line.phase_ps + offset, accepted.line.period_ps + slope}.at_origin();
  fit.phase_ps = line.phase_ps;
  fit.period_ps = line.period_ps;
  fit.drift_ppm = (line.period_ps / calibrated_ps - 1) * 1e6;
  fit.jitter_ps = std::sqrt(s.squares(offset, slope) / s.n);
}

void fill_bend(SyncFit& fit, std::span<const double> syncs, double half_length_ps) {
  constexpr double least_deviations = 4;
  const double gate_ps = outlier_sigmas * fit.jitter_ps + least_sigma_ps;
  double n = 0, u = 0, r = 0, uu = 0, ur = 0, rr = 0;
  for (const double x_ps : syncs) {
    const double from_phase_ps = x_ps - fit.phase_ps;
    const double k = round_quickly(from_phase_ps / fit.period_ps);
    const double off_ps = from_phase_ps - k * fit.period_ps;
    if (std::abs(off_ps) > gate_ps) continue;
    const double x = x_ps / half_length_ps;
    const double square = x * x;
    n += 1;
    u += square;
    r += off_ps;
    uu += square * square;
    ur += square * off_ps;
    rr += off_ps * off_ps;
  }
  const double spread = uu - u * u / n;
  if (n < 16 || !(spread > 0)) return;
  const double bend_ps = (ur - u * r / n) / spread;
  const double about_line = rr - r * r / n;
  const double about_bend = std::max(about_line - bend_ps * bend_ps * spread, 0.0);
  const double sigma_ps = std::max(std::sqrt(about_bend / (n - 3)), least_sigma_ps / 2);
  if (std::abs(bend_ps) < least_deviations * sigma_ps / std::sqrt(spread)) return;
  fit.bend_ps = bend_ps;
  fit.bend_zero = u / n;
  const double less = std::sqrt(about_bend / about_line);
  for (double* value : {&fit.jitter_ps, &fit.std_phase_ps, &fit.std_period_ps}) *value *= less;
}

}  // namespace splid::sync
