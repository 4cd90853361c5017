#include "estimator/calibration/rest_check.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>

#include "estimator/model/chance.hpp"
#include "estimator/model/pulse_shape.hpp"

namespace splid::calibration {
namespace {

constexpr std::size_t most_slices = 64;
constexpr std::size_t least_slice_bins = 64;
constexpr std::size_t most_slice_bins = 1 << 17;

// The straight line through shifts, by their weights.
struct ShiftLine {
  double weight = 0, time_s = 0, later_ps = 0;  // sum, and means
  double spread_s2 = 0;                         // of the times, weighted
  double ps_per_s = 0;
  double squares = 0;  // of what is left, weighted

  explicit ShiftLine(const std::vector<Shift>& shifts) {
    for (const Shift& s : shifts) {
      weight += s.weight;
      time_s += s.weight * s.time_s;
      later_ps += s.weight * s.later_ps;
    }
    time_s /= weight, later_ps /= weight;
    double moment = 0;
    for (const Shift& s : shifts) {
      spread_s2 += s.weight * (s.time_s - time_s) * (s.time_s - time_s);
      moment += s.weight * (s.time_s - time_s) * (s.later_ps - later_ps);
    }
    ps_per_s = moment / spread_s2;
    for (const Shift& s : shifts) squares += s.weight * left_ps(s) * left_ps(s);
  }
  [[nodiscard]] double left_ps(const Shift& s) const {
    return s.later_ps - later_ps - ps_per_s * (s.time_s - time_s);
  }
};

double seconds_since(std::optional<std::int64_t>& begin_ps, const FrameView& frame) {
  if (!begin_ps) begin_ps = frame.mid_ps();
  return static_cast<double>(frame.mid_ps() - *begin_ps) * 1e-12;
}

// Lays slices upon each other, one after the other.
class Alignment {
 public:
  explicit Alignment(std::size_t bins) : sum_(bins), wave_(bins), correlation_(bins) {}

  // Adds a slice; returns the shift, in bins, by which the slice is later than the first slice.
  std::size_t place(const std::vector<float>& slice) {
    std::vector<std::complex<float>> of_sum;
    fft_.fwd(of_sum, sum_);
    fft_.fwd(wave_, slice);
    for (std::size_t f = 0; f < wave_.size(); ++f) wave_[f] *= std::conj(of_sum[f]);
    fft_.inv(correlation_, wave_);
    const auto best = static_cast<std::size_t>(
        std::max_element(correlation_.begin(), correlation_.end()) - correlation_.begin());
    // The variance, by the slice's photons, of the gain over the present shift.
    const std::size_t bins = sum_.size();
    double variance = 0;
    for (std::size_t b = 0; b < bins; ++b) {
      const double there = sum_[(b + bins - best) % bins];
      const double here = sum_[(b + bins - shift_) % bins];
      variance += slice[b] * (there - here) * (there - here);
    }
    const double gain = correlation_[best] - correlation_[shift_];
    if (gain > sure_deviations_of_many * std::sqrt(variance)) shift_ = best;
    for (std::size_t b = 0; b < bins; ++b) sum_[b] += slice[(b + shift_) % bins];
    return shift_;
  }

 private:
  Eigen::FFT<float> fft_;
  std::vector<float> sum_;  // of all slices so far, each shifted back
  std::vector<std::complex<float>> wave_;
  std::vector<float> correlation_;
  std::size_t shift_ = 0;
};

}  // namespace

TargetMotion::TargetMotion(double period_ps, double width_ps)
    : bins_(std::bit_ceil(std::clamp(static_cast<std::size_t>(std::min(period_ps / width_ps, 1e9)),
                                     least_slice_bins, most_slice_bins))),
      bin_ps_(period_ps / static_cast<double>(bins_)) {}

void TargetMotion::add(const FrameView& frame) {
  if (!frame.sync.locked) return;
  if (slices_.empty() || slices_.back().frames == frames_per_slice_) {
    if (slices_.size() == most_slices) merge_pairs();
    slices_.push_back({std::vector<float>(bins_), 0, 0});
  }
  Slice& slice = slices_.back();
  ++slice.frames;
  slice.middle_s += seconds_since(begin_ps_, frame);
  const FramePhase phase(frame);
  for (const std::int64_t photon_ps : frame.photons_ps) {
    slice.counts[phase.bin_of(photon_ps, bins_)] += 1;
  }
}

void TargetMotion::merge_pairs() {
  for (std::size_t s = 0; s < slices_.size(); s += 2) {
    Slice& into = slices_[s / 2];
    if (s > 0) into = std::move(slices_[s]);
    const Slice& other = slices_[s + 1];
    for (std::size_t b = 0; b < bins_; ++b) into.counts[b] += other.counts[b];
    into.frames += other.frames;
    into.middle_s += other.middle_s;
  }
  slices_.resize(slices_.size() / 2);
  frames_per_slice_ *= 2;
}

std::optional<TargetMotion::Motion> TargetMotion::motion() const {
  if (slices_.size() < 3) return std::nullopt;
  Alignment alignment(bins_);
  std::vector<Shift> places;
  for (const Slice& slice : slices_) {
    // Not modulo the circle: from slice to slice it goes the nearer way.
    const double shift_ps = static_cast<double>(alignment.place(slice.counts)) * bin_ps_;
    const double before_ps = places.empty() ? 0 : places.back().later_ps;
    const double step_ps =
        std::remainder(shift_ps - before_ps, bin_ps_ * static_cast<double>(bins_));
    places.push_back({slice.middle_s / static_cast<double>(slice.frames), before_ps + step_ps, 1});
  }
  const auto [low, high] =
      std::minmax_element(places.begin(), places.end(),
                          [](const Shift& a, const Shift& b) { return a.later_ps < b.later_ps; });
  const double moved_ps = high->later_ps - low->later_ps;
  if (moved_ps < half_pulse_widths * bin_ps_) return std::nullopt;
  const ShiftLine line(places);
  // The variance is at least that of rounding to bins.
  const double variance =
      std::max(line.squares / std::max(line.weight - 2, 1.0), bin_ps_ * bin_ps_ / 12);
  return Motion{moved_ps, line.ps_per_s, std::sqrt(variance / line.spread_s2)};
}

bool RestReport::moves() const {
  return std::abs(delay_rate_ps_per_s) > sure_deviations * std_delay_rate_ps_per_s;
}

bool RestReport::wanders() const { return wander_deviations > sure_deviations; }

RestCheck::RestCheck(const PhaseHistogram& fold, const Calibration& calibration)
    : score_(fold.bins()) {
  FoldModel model = model_of(fold, calibration);
  const std::vector<double>& rates = model.rates();
  std::vector<double> slope(fold.bins());
  model.each_reached([&](std::size_t p, const FoldModel::Window& window, std::size_t i, auto bin) {
    slope[bin] -= model.counts[p] * window.slope[i] * model.bin_ps();
  });
  double all = 0;
  for (std::size_t b = 0; b < slope.size(); ++b) {
    score_[b] = static_cast<float>(slope[b] / rates[b]);
    information_ += slope[b] * slope[b] / rates[b];
    all += rates[b];
  }
  information_ /= all;
}

void RestCheck::add(const FrameView& frame) {
  if (!frame.sync.locked || frame.photons_ps.empty()) return;
  const FramePhase phase(frame);
  double sum = 0;
  for (const std::int64_t photon_ps : frame.photons_ps) {
    sum += score_[phase.bin_of(photon_ps, score_.size())];
  }
  const double information = information_ * static_cast<double>(frame.photons_ps.size());
  const double variance = 1 / information + frame.sync.std_phase_ps * frame.sync.std_phase_ps;
  shifts_.push_back({seconds_since(begin_ps_, frame), sum / information, 1 / variance});
}

RestReport RestCheck::report() const {
  RestReport report;
  report.frames = shifts_.size();
  if (shifts_.size() < 2) return report;
  report.seconds = shifts_.back().time_s - shifts_.front().time_s;
  const ShiftLine line(shifts_);
  report.delay_rate_ps_per_s = line.ps_per_s;
  report.std_delay_rate_ps_per_s = 1 / std::sqrt(line.spread_s2);
  // Frames are taken in groups of 1, 4, 16, and so on: a slow wander that no single frame shows
  // stands out in the means of larger groups.
  for (std::size_t length = 1; length == 1 || 4 * length <= shifts_.size(); length *= 4) {
    double chi_square = 0, free = -2;
    for (std::size_t from = 0; from < shifts_.size(); from += length) {
      double weight = 0, left = 0;
      for (std::size_t i = from; i < std::min(from + length, shifts_.size()); ++i) {
        weight += shifts_[i].weight;
        left += shifts_[i].weight * line.left_ps(shifts_[i]);
      }
      chi_square += left * left / weight;
      free += 1;
    }
    if (free < 1) break;
    const double deviations = deviations_of(chi_square, free);
    if (deviations <= report.wander_deviations) continue;
    report.wander_deviations = deviations;
    report.wander_ps = std::sqrt(std::max(chi_square - free, 0.0) / line.weight);
  }
  return report;
}

}  // namespace splid::calibration
