#include "estimator/sync/drift_regression.hpp"

#include <cmath>

#include "estimator/sync/deviations.hpp"

namespace splid::sync {

Line Line::at_origin() const {
  return {phase_ps - std::round(phase_ps / period_ps) * period_ps, period_ps, curvature_per_ps};
}

Line Line::later(double a_ps, double b, double c_per_ps) const {
  const double stretch = 1 / (1 - b);
  return {(phase_ps + a_ps) * stretch, period_ps * stretch,
          (curvature_per_ps + c_per_ps) * stretch};
}

Parabola straight_through(const Sums& s) {
  Parabola p;
  p.spread_b = s.sxx();
  p.b = p.spread_b > 0 ? s.sxy() / p.spread_b : 0;
  p.a = (s.r - p.b * s.k) / s.n;
  p.squares = s.squares(p.a, p.b);
  return p;
}

Parabola parabola_through(const Sums& s) {
  const double kk = s.sxx(), kr = s.sxy();
  const double kkk = s.kkk - s.k * s.kk / s.n;
  const double kkkk = s.kkkk - s.kk * s.kk / s.n;
  const double kkr = s.kkr - s.kk * s.r / s.n;
  Parabola p;
  p.spread_b = kk - kkk * kkk / kkkk;
  p.spread_c = kkkk - kkk * kkk / kk;
  p.c = (kkr - kkk / kk * kr) / p.spread_c;
  p.b = (kr - p.c * kkk) / kk;
  p.a = (s.r - p.b * s.k - p.c * s.kk) / s.n;
  p.squares = std::max(s.syy() - kr * kr / kk - p.c * p.c * p.spread_c, 0.0);
  return p;
}

Line regressed(const Line& line, const Sums& sums) {
  const Parabola straight = straight_through(sums);
  return {line.phase_ps + straight.a, line.period_ps + straight.b, line.curvature_per_ps};
}

void fill_period(SyncFit& fit, DriftMethod method, double calibrated_ps, const Accepted& accepted) {
  const Sums& s = accepted.sums;
  const Parabola best = straight_through(s);
  const double sigma_ps = std::sqrt(best.squares / std::max(s.n - 2, 1.0));
  const double mean_k = s.k / s.n;
  double offset = best.a;
  double slope = best.b;
  fit.std_period_ps = sigma_ps / std::sqrt(best.spread_b);
  fit.std_phase_ps = sigma_ps * std::sqrt(1 / s.n + mean_k * mean_k / best.spread_b);
  if (method == DriftMethod::endpoints) {
    // [P] Eq. 19 as it is printed.
    const Point& first = accepted.first;
    const Point& last = accepted.last;
    const double span = last.k - first.k;
    slope = (last.residual_ps - first.residual_ps) / span;
    offset = first.residual_ps - slope * first.k;
    fit.std_period_ps = sigma_ps * std::sqrt(2.0) / span;
    fit.std_phase_ps = sigma_ps * in_quadrature(last.k, first.k) / span;
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

void fill_curvature(SyncFit& fit, double half_length_ps, double calibrated_ps,
                    const Accepted& accepted) {
  constexpr double least_syncs = 16;
  const Sums& s = accepted.sums;
  if (s.n < least_syncs) return;
  const Line& line = accepted.line;
  const Parabola p = parabola_through(s);
  const double sigma_ps = std::max(std::sqrt(p.squares / (s.n - 3)), least_sigma_ps / 2);
  const double c_per_ps = p.c / (line.period_ps * line.period_ps);
  const double std_per_ps = sigma_ps / std::sqrt(p.spread_c) / (line.period_ps * line.period_ps);
  const bool curves =
      std::abs(line.curvature_per_ps + c_per_ps) >= unlikely_deviations * std_per_ps;
  if (!curves && line.curvature_per_ps == 0) return;
  // At a time of x ps, k is (x - phase) / period.
  const double k0 = -line.phase_ps / line.period_ps;
  const Line curved = line.later(p.at(k0), (p.b + 2 * k0 * p.c) / line.period_ps, c_per_ps);
  const double mean_k = s.k / s.n - k0;
  fit.curvature_ps = curved.curvature_per_ps * half_length_ps * half_length_ps;
  fit.curvature_zero =
      (s.sxx() / s.n + mean_k * mean_k) * std::pow(line.period_ps / half_length_ps, 2);
  const Line mean =
      Line{curved.phase_ps + fit.curvature_ps * fit.curvature_zero, curved.period_ps}.at_origin();
  fit.phase_ps = mean.phase_ps;
  fit.period_ps = mean.period_ps;
  fit.drift_ppm = (mean.period_ps / calibrated_ps - 1) * 1e6;
  fit.std_period_ps = sigma_ps / std::sqrt(p.spread_b);
  fit.std_phase_ps = in_quadrature(sigma_ps / std::sqrt(s.n), fit.std_period_ps * mean_k);
  fit.jitter_ps = std::sqrt(p.squares / s.n);
}

}  // namespace splid::sync
