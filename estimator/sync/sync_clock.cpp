#include "estimator/sync/sync_clock.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace splid {
namespace {

// Design note: a sync may be off its place by a 16th of the period, 5 ns at most, while the line is
// still unknown. 5 ns is ten times the jitter of a bad sync input; of syncs at random an eighth fit
// a window of +-T/16, far from the 60 % asked for.
constexpr double window_of_period = 1.0 / 16;
constexpr double widest_window_ps = 5000;
constexpr double min_agreeing = 0.6;  // of the syncs, doubles aside

// Design note: an oscillator changes by far less than 1 ppm between two frames, so the last period
// is tried within that before the calibrated one within max_drift_ppm.
constexpr double drift_between_fits = 1e-6;

constexpr std::size_t first_walk = 64;  // syncs followed one by one
constexpr std::size_t growth = 8;       // then so many times more at each step
constexpr std::size_t early_seeds = 8;
constexpr std::size_t least_syncs = 3;

constexpr double outlier_sigmas = 5;
constexpr double least_sigma_ps = 2;  // taggers round to 1 to 4 ps
constexpr double sigma_per_mad = 1.4826;
constexpr std::size_t mad_sample = 1024;  // the MAD's standard error is then 4 %

double first_window_ps(double period_ps) {
  return std::min(period_ps * window_of_period, widest_window_ps);
}

// Design note: rounds by adding 1.5 * 2^52, in a fifth of the time of the library's call, for which
// the baseline instruction set has no instruction. Holds for up to 2^51 periods.
double round_quickly(double value) {
  constexpr double shift = 6755399441055744.0;
  return (value + shift) - shift;
}

// Pattern starts are at phase + k * period, relative to the fit's origin.
struct Line {
  double phase_ps = 0;
  double period_ps = 0;

  // The same line, counted from the pattern start nearest to the origin.
  [[nodiscard]] Line at_origin() const {
    return {phase_ps - std::round(phase_ps / period_ps) * period_ps, period_ps};
  }
};

// One accepted sync: the period it belongs to, and how far it is from the line.
struct Point {
  double k = 0;
  double residual_ps = 0;
};

// Sums for a least-squares line through points.
struct Sums {
  double n = 0, k = 0, r = 0, kk = 0, kr = 0, rr = 0;

  void add(const Point& p) {
    n += 1;
    k += p.k;
    r += p.residual_ps;
    kk += p.k * p.k;
    kr += p.k * p.residual_ps;
    rr += p.residual_ps * p.residual_ps;
  }
  [[nodiscard]] double sxx() const { return kk - k * k / n; }
  // Sum of squares about the line offset + slope * k.
  [[nodiscard]] double squares(double offset, double slope) const {
    const double sum = rr - 2 * offset * r - 2 * slope * kr + offset * offset * n +
                       2 * offset * slope * k + slope * slope * kk;
    return std::max(sum, 0.0);
  }
};

// How far from a line a sync may be: window at period `centre`, growing by slope for each further.
struct Gate {
  double window_ps = 0;
  double slope_ps = 0;
  double centre = 0;
};

// What one pass over syncs found.
struct Pass {
  Sums sums;
  Point first, last;     // accepted
  std::size_t near = 0;  // not accepted, but within window_of_period, or doubles
  double sigma_ps = 0;   // robust, of the accepted
};

// Follows syncs from a seed, counting each step by a period that is the better known the longer the
// way: at first to within a ratio, then to twice the window over the way.
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
      // Too long a gap to say how many periods: go on from here with what is known so far.
      first_ps_ = last_ps_ = x_ps;
      steps_ = 0;
    } else if (off_ps > slack_ps) {
      if (off_ps > period_ps_ * window_of_period) ++astray_;
    } else if (steps > 0) {
      advance(x_ps, steps);
    }
  }

  [[nodiscard]] bool agrees() const {
    return accepted_ + 1 >= least_syncs &&
           static_cast<double>(accepted_) >=
               min_agreeing * static_cast<double>(accepted_ + astray_);
  }
  [[nodiscard]] Line line() const { return {first_ps_, period_ps_}; }

 private:
  void advance(double x_ps, double steps) {
    ++accepted_;
    last_ps_ = x_ps;
    steps_ += steps;
    const double way_ps = last_ps_ - first_ps_;
    known_ = std::min(known_, 2 * window_ps_ / way_ps);
    period_ps_ = std::clamp(way_ps / steps_, given_ps_ * (1 - drift_), given_ps_ * (1 + drift_));
  }

  double first_ps_, last_ps_;
  double given_ps_, drift_;
  double known_;  // to within this ratio the period is
  double period_ps_;
  double window_ps_;
  double steps_ = 0;
  std::size_t accepted_ = 0;  // beside the seed
  std::size_t astray_ = 0;
};

// The points of syncs on a line, doubles merged: of those in one period the nearer one stays.
class Gatherer {
 public:
  Gatherer(const Line& line, const Gate& gate, std::vector<double>& residuals)
      : line_(line),
        gate_(gate),
        per_ps_(1 / line.period_ps),
        near_ps_(line.period_ps * window_of_period),
        residuals_(residuals.data()) {}

  void take(double x_ps) {
    const double from_phase_ps = x_ps - line_.phase_ps;
    const double k = round_quickly(from_phase_ps * per_ps_);
    const double residual_ps = from_phase_ps - k * line_.period_ps;
    const double off_ps = std::abs(residual_ps);
    if (off_ps > gate_.window_ps + std::abs(k - gate_.centre) * gate_.slope_ps) {
      if (off_ps < near_ps_) ++pass_.near;
      return;
    }
    if (any_ && k == pending_.k) {
      ++pass_.near;
      if (off_ps < std::abs(pending_.residual_ps)) pending_.residual_ps = residual_ps;
      return;
    }
    flush();
    any_ = true;
    pending_ = {k, residual_ps};
  }

  Pass finish() {
    flush();
    pass_.last = pending_;
    pass_.sigma_ps = sigma_ps();
    return pass_;
  }

 private:
  void flush() {
    if (!any_) return;
    if (count_ == 0) pass_.first = pending_;
    residuals_[count_++] = pending_.residual_ps;
    pass_.sums.add(pending_);
  }

  // From the median absolute residual about the mean of an even sample.
  double sigma_ps() {
    if (count_ < least_syncs) return 0;
    const std::size_t stride = (count_ + mad_sample - 1) / mad_sample;
    const double slope_k = pass_.sums.r / pass_.sums.n;
    std::size_t sample = 0;
    for (std::size_t i = 0; i < count_; i += stride) {
      residuals_[sample++] = std::abs(residuals_[i] - slope_k);
    }
    std::nth_element(residuals_, residuals_ + sample / 2, residuals_ + sample);
    return std::max(sigma_per_mad * residuals_[sample / 2], least_sigma_ps);
  }

  Line line_;
  Gate gate_;
  double per_ps_;
  double near_ps_;
  double* residuals_;  // room for one a sync
  std::size_t count_ = 0;
  bool any_ = false;
  Point pending_;
  Pass pass_;
};

Pass gather(std::span<const double> syncs, const Line& line, const Gate& gate,
            std::vector<double>& scratch) {
  Gatherer gatherer(line, gate, scratch);
  for (const double x_ps : syncs) gatherer.take(x_ps);
  return gatherer.finish();
}

// The least-squares correction of the line that the points are relative to.
Line regressed(const Line& line, const Sums& s) {
  const double sxx = s.sxx();
  const double slope = sxx > 0 ? (s.kr - s.k * s.r / s.n) / sxx : 0;
  const double offset = (s.r - slope * s.k) / s.n;
  return {line.phase_ps + offset, line.period_ps + slope};
}

// What the next pass may accept, given how well this one's line is known.
Gate next_gate(const Pass& pass) {
  const Sums& s = pass.sums;
  const double slope = s.sxx() > 0 ? pass.sigma_ps / std::sqrt(s.sxx()) : 0;
  return {outlier_sigmas * pass.sigma_ps, outlier_sigmas * slope, s.k / s.n};
}

bool agrees(const Pass& pass, std::size_t syncs) {
  const double others = static_cast<double>(syncs - pass.near);
  return pass.sums.n >= least_syncs && pass.sums.n >= min_agreeing * others;
}

struct Found {
  Line line;
  Pass pass;
};

// The line through all syncs that goes on from the walk's over ever more of them, or nothing.
std::optional<Found> grow(std::span<const double> syncs, std::size_t seed, Line line,
                          std::vector<double>& scratch) {
  Gate gate{first_window_ps(line.period_ps), 0, 0};
  std::size_t count = std::min(first_walk, syncs.size() - seed);
  while (true) {
    const auto part = syncs.subspan(seed, count);
    line = line.at_origin();
    const Pass pass = gather(part, line, gate, scratch);
    if (!agrees(pass, part.size())) return std::nullopt;
    line = regressed(line, pass.sums);
    gate = next_gate(pass);
    if (seed + count == syncs.size()) break;
    count = std::min(count * growth, syncs.size() - seed);
  }
  // All syncs, also those before the seed; then once more with the outliers of a settled line.
  for (int round = 0; round < 2; ++round) {
    line = line.at_origin();
    const Pass pass = gather(syncs, line, gate, scratch);
    if (!agrees(pass, syncs.size())) return std::nullopt;
    if (round == 1) return Found{line, pass};
    line = regressed(line, pass.sums);
    gate = {outlier_sigmas * pass.sigma_ps, 0, 0};
  }
  return std::nullopt;
}

std::optional<Found> lock_from(std::span<const double> syncs, std::size_t seed, double period_ps,
                               double drift, std::vector<double>& scratch) {
  Walk walk(syncs[seed], period_ps, drift);
  const std::size_t end = std::min(syncs.size(), seed + first_walk);
  for (std::size_t i = seed + 1; i < end; ++i) walk.take(syncs[i]);
  if (!walk.agrees()) return std::nullopt;
  return grow(syncs, seed, walk.line(), scratch);
}

// A sync so close behind another is its reflection, or rings: as regular as the true ones, where
// all have one, and late.
bool is_double(std::span<const double> syncs, std::size_t i, double period_ps) {
  return i > 0 && syncs[i] - syncs[i - 1] < period_ps * window_of_period;
}

// Tries seeds near the beginning, as the first sync may be a stray one, and further on; doubles
// only where nothing else leads anywhere.
std::optional<Found> lock(std::span<const double> syncs, double period_ps, double drift,
                          std::vector<double>& scratch) {
  const std::size_t early = std::min(early_seeds, syncs.size() - least_syncs + 1);
  for (const bool doubles : {false, true}) {
    for (std::size_t i = 1; i <= early; ++i) {
      const std::size_t seed = i % early;
      if (is_double(syncs, seed, period_ps) != doubles) continue;
      if (const auto found = lock_from(syncs, seed, period_ps, drift, scratch)) return found;
    }
  }
  for (const std::size_t seed : {syncs.size() / 4, syncs.size() / 2}) {
    if (seed < early) continue;
    if (const auto found = lock_from(syncs, seed, period_ps, drift, scratch)) return found;
  }
  return std::nullopt;
}

// The fit's line and its spread, by method.
void fill_line(SyncFit& fit, DriftMethod method, double calibrated_ps, const Found& found) {
  const Sums& s = found.pass.sums;
  const double sxx = s.sxx();
  const Line best = regressed(found.line, s);
  const double best_offset = best.phase_ps - found.line.phase_ps;
  const double best_slope = best.period_ps - found.line.period_ps;
  const double sigma_ps = std::sqrt(s.squares(best_offset, best_slope) / std::max(s.n - 2, 1.0));
  double offset = best_offset;
  double slope = best_slope;
  double mean_k = s.k / s.n;
  fit.std_period_ps = sigma_ps / std::sqrt(sxx);
  fit.std_phase_ps = sigma_ps * std::sqrt(1 / s.n + mean_k * mean_k / sxx);
  if (method == DriftMethod::endpoints) {
    const Point& first = found.pass.first;
    const Point& last = found.pass.last;
    const double span = last.k - first.k;
    slope = (last.residual_ps - first.residual_ps) / span;
    offset = first.residual_ps - slope * first.k;
    fit.std_period_ps = sigma_ps * std::sqrt(2.0) / span;
    fit.std_phase_ps = sigma_ps * std::hypot(last.k, first.k) / span;
  } else if (method == DriftMethod::off) {
    slope = calibrated_ps - found.line.period_ps;
    offset = (s.r - slope * s.k) / s.n;
    fit.std_period_ps = 0;
    fit.std_phase_ps = sigma_ps / std::sqrt(s.n);
  }
  const Line line = Line{found.line.phase_ps + offset, found.line.period_ps + slope}.at_origin();
  fit.phase_ps = line.phase_ps;
  fit.period_ps = line.period_ps;
  fit.drift_ppm = (line.period_ps / calibrated_ps - 1) * 1e6;
  fit.jitter_ps = std::sqrt(s.squares(offset, slope) / s.n);
}

// What a changing rate leaves of the syncs about the fit's line.
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

// Pattern starts in [begin, end) that no accepted sync belongs to. Those within a sync's jitter of
// either side are left out: their syncs may be in the next frame.
double missing_syncs(const Found& found, double begin_ps, double end_ps, double scale) {
  const double margin_ps = outlier_sigmas * found.pass.sigma_ps;
  const auto from = [&](double x_ps) {
    return std::ceil((x_ps - found.line.phase_ps) / found.line.period_ps);
  };
  const double low = from(begin_ps + margin_ps);
  const double high = from(end_ps - margin_ps);
  double inside = found.pass.sums.n;
  if (found.pass.first.k < low) inside -= 1;
  if (found.pass.last.k >= high) inside -= 1;
  return std::max(high - low - inside * scale, 0.0);
}

}  // namespace

SyncClock::SyncClock(double calibrated_period_ps, DriftMethod method, std::size_t max_syncs,
                     double max_drift_ppm)
    : calibrated_period_ps_(calibrated_period_ps),
      method_(method),
      max_drift_ppm_(max_drift_ppm),
      period_ps_(calibrated_period_ps),
      position_(std::max(max_syncs, least_syncs)),
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
  if (taken < least_syncs) return fit;

  const std::span<const double> syncs(position_.data(), taken);
  const double max_drift = max_drift_ppm_ * 1e-6;
  auto found = lock(syncs, period_ps_, drift_between_fits, residual_);
  if (!found) found = lock(syncs, calibrated_period_ps_, max_drift, residual_);
  if (!found) return fit;
  const double period_ps = regressed(found->line, found->pass.sums).period_ps;
  if (std::abs(period_ps / calibrated_period_ps_ - 1) > max_drift) return fit;

  fit.locked = true;
  period_ps_ = period_ps;
  fill_line(fit, method_, calibrated_period_ps_, *found);
  if (method_ == DriftMethod::regression) {
    fill_bend(fit, syncs, static_cast<double>(end_ps - begin_ps) / 2);
  }
  const double scale = static_cast<double>(syncs_ps.size()) / static_cast<double>(taken);
  fit.missing =
      static_cast<std::size_t>(missing_syncs(*found, static_cast<double>(begin_ps - fit.origin_ps),
                                             static_cast<double>(end_ps - fit.origin_ps), scale));
  const double accepted = std::min(found->pass.sums.n * scale, static_cast<double>(fit.count));
  fit.spurious = fit.count - static_cast<std::size_t>(std::lround(accepted));
  return fit;
}

}  // namespace splid
