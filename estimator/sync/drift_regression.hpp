#pragma once

#include <algorithm>

#include "estimator/sync/sync_fit.hpp"

// The measured pattern period, [P] Eq. 19, and with it the drift of the pattern's clock, from syncs
// that are known to lie on one line (sync_lock.hpp finds them). All times are in ps from the fit's
// origin.
namespace splid::sync {

inline constexpr double least_sigma_ps = 2;           // taggers round to 1 to 4 ps
inline constexpr double drift_between_frames = 1e-6;  // an oscillator changes by far less

// Pattern starts are at the times x_ps where straight_ps(x_ps) is phase_ps + k * period_ps, for
// every whole k. Where the clock's rate is steady, curvature_per_ps is 0 and straight_ps(x_ps) is
// x_ps.
struct Line {
  double phase_ps = 0;
  double period_ps = 0;
  double curvature_per_ps = 0;  // 1 ppm/s is 5e-19 / ps

  [[nodiscard]] double straight_ps(double x_ps) const {
    return x_ps - curvature_per_ps * (x_ps * x_ps);
  }
  // The same line, with the pattern start nearest to the origin as number 0.
  [[nodiscard]] Line at_origin() const;
  // The line of syncs that are a_ps + b x + c_per_ps x^2 later than this one, at times of x ps.
  [[nodiscard]] Line later(double a_ps, double b, double c_per_ps) const;
};

// An accepted sync: the number of its period, and how much later than the line it is.
struct Point {
  double k = 0;
  double residual_ps = 0;
};

// The sums that a least-squares line through points needs, and those that a parabola needs beside.
// n, k and r are those of all points' weights, k and residuals, kk of the squares of k, and so on.
struct Sums {
  double n = 0, k = 0, r = 0, kk = 0, kr = 0, rr = 0;
  double kkk = 0, kkkk = 0, kkr = 0;

  void add(const Point& p, double weight = 1) {
    n += weight;
    k += weight * p.k;
    r += weight * p.residual_ps;
    kk += weight * p.k * p.k;
    kr += weight * p.k * p.residual_ps;
    rr += weight * p.residual_ps * p.residual_ps;
  }
  void add_for_parabola(const Point& p) {
    const double square = p.k * p.k;
    kkk += square * p.k;
    kkkk += square * square;
    kkr += square * p.residual_ps;
  }
  // The sums about the mean of all points.
  [[nodiscard]] double sxx() const { return kk - k * k / n; }
  [[nodiscard]] double sxy() const { return kr - k * r / n; }
  [[nodiscard]] double syy() const { return rr - r * r / n; }
  // The sum of squared distances from the line offset + slope * k.
  [[nodiscard]] double squares(double offset, double slope) const {
    const double sum = rr - 2 * offset * r - 2 * slope * kr + offset * offset * n +
                       2 * offset * slope * k + slope * slope * kk;
    return std::max(sum, 0.0);
  }
};

// r = a + b k + c k^2, in ps.
struct Parabola {
  double a = 0, b = 0, c = 0;
  double spread_b = 0, spread_c = 0;  // sums of the squares of k beside k^2, and of k^2 beside k
  double squares = 0;                 // of the points' distances from it

  [[nodiscard]] double at(double k) const { return a + k * (b + k * c); }
};
// The least-squares parabola, and that with c = 0.
Parabola parabola_through(const Sums& sums);
Parabola straight_through(const Sums& sums);

// The syncs that were accepted as those of one line.
struct Accepted {
  Line line;  // what the points' residuals are relative to
  Sums sums;
  Point first, last;
  double sigma_ps = 0;  // robust standard deviation of the syncs about their mean
};

// The least-squares line through the points, whose residuals are relative to `line`. Its period is
// the slope of arrival time over period number: [P] Eq. 19 from all syncs instead of two.
Line regressed(const Line& line, const Sums& sums);

// Fills the fit's phase, period, drift, their deviations and the jitter.
//
// Design note: [P] Eq. 19 takes the first and the last sync. With 10 ps of sync jitter a frame of
// 50 ms then has 4.2 cm/s of velocity error from its period alone, as much as its photons' own
// bound (4.3 cm/s); the line through all 13,227 syncs leaves 0.09 cm/s.
void fill_period(SyncFit& fit, DriftMethod method, double calibrated_ps, const Accepted& accepted);

// Fills the fit's quadratic term, if that of the least-squares parabola through the syncs is four
// standard deviations; phase, period and jitter are then those of the parabola. Slow syncs lie
// unevenly about mid-frame, and their line takes a part of the quadratic term for drift: 6 cm/s of
// 49 syncs in 50 ms at 1.5 ppm/s. half_length_ps: half of the frame's length.
void fill_curvature(SyncFit& fit, double half_length_ps, double calibrated_ps,
                    const Accepted& accepted);

}  // namespace splid::sync
