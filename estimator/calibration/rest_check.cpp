#include "estimator/calibration/rest_check.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/model/chance.hpp"

namespace splid::calibration {
namespace {

// Weighted sums over shifts.
struct Sums {
  double w = 0, t = 0, x = 0;
};

}  // namespace

bool RestReport::moves() const {
  return std::abs(delay_rate_ps_per_s) > sure_deviations * std_delay_rate_ps_per_s;
}

bool RestReport::wanders() const { return wander_deviations > sure_deviations; }

RestCheck::RestCheck(const PhaseHistogram& fold, const Calibration& calibration)
    : bins_(fold.bins()) {
  FoldModel model = model_of(fold, calibration);
  const std::vector<double>& rates = model.rates();
  std::vector<double> slope(bins_);
  for (std::size_t p = 0; p < model.pulses(); ++p) {
    const FoldModel::Window window = model.window(p);
    for (std::size_t i = 0; i < window.slope.size(); ++i) {
      slope[fold.wrapped(window.first + static_cast<std::ptrdiff_t>(i))] -=
          model.counts[p] * window.slope[i] * model.bin_ps();
    }
  }
  double all = 0;
  score_.resize(bins_);
  for (std::size_t b = 0; b < bins_; ++b) {
    score_[b] = static_cast<float>(slope[b] / rates[b]);
    information_ += slope[b] * slope[b] / rates[b];
    all += rates[b];
  }
  information_ /= all;
}

void RestCheck::add(const FrameView& frame) {
  if (!frame.sync.locked || frame.photons_ps.empty()) return;
  const std::int64_t middle_ps = frame.mid_ps();
  if (!begin_ps_) begin_ps_ = middle_ps;
  const FramePhase phase(frame);
  double sum = 0;
  for (const std::int64_t photon_ps : frame.photons_ps) {
    sum += score_[phase.bin_of(photon_ps, bins_)];
  }
  const double information = information_ * static_cast<double>(frame.photons_ps.size());
  const double variance = 1 / information + frame.sync.std_phase_ps * frame.sync.std_phase_ps;
  shifts_.push_back(
      {static_cast<double>(middle_ps - *begin_ps_) * 1e-12, sum / information, 1 / variance});
}

RestReport RestCheck::report() const {
  RestReport report;
  report.frames = shifts_.size();
  if (shifts_.size() < 2) return report;
  report.seconds = shifts_.back().time_s - shifts_.front().time_s;
  Sums mean;
  for (const Shift& s : shifts_) {
    mean.w += s.weight;
    mean.t += s.weight * s.time_s;
    mean.x += s.weight * s.shift_ps;
  }
  mean.t /= mean.w;
  mean.x /= mean.w;
  double tt = 0, tx = 0;
  for (const Shift& s : shifts_) {
    tt += s.weight * (s.time_s - mean.t) * (s.time_s - mean.t);
    tx += s.weight * (s.time_s - mean.t) * (s.shift_ps - mean.x);
  }
  report.delay_rate_ps_per_s = tx / tt;
  report.std_delay_rate_ps_per_s = 1 / std::sqrt(tt);
  // Frames are taken in groups of 1, 4, 16, and so on: a slow wander that no single frame shows
  // stands out in the means of larger groups.
  for (std::size_t length = 1; length == 1 || 4 * length <= shifts_.size(); length *= 4) {
    double chi_square = 0, free = -2;
    for (std::size_t from = 0; from < shifts_.size(); from += length) {
      Sums group;
      for (std::size_t i = from; i < std::min(from + length, shifts_.size()); ++i) {
        const double line_ps = mean.x + report.delay_rate_ps_per_s * (shifts_[i].time_s - mean.t);
        group.w += shifts_[i].weight;
        group.x += shifts_[i].weight * (shifts_[i].shift_ps - line_ps);
      }
      chi_square += group.x * group.x / group.w;
      free += 1;
    }
    if (free < 1) break;
    const double deviations = deviations_of(chi_square, free);
    if (deviations <= report.wander_deviations) continue;
    report.wander_deviations = deviations;
    report.wander_ps = std::sqrt(std::max(chi_square - free, 0.0) / mean.w);
  }
  return report;
}

}  // namespace splid::calibration
