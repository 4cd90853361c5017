#include "estimator/calibration/target_motion.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>

#include "estimator/calibration/phase_histogram.hpp"
#include "estimator/model/chance.hpp"

namespace splid::calibration {
namespace {

constexpr std::size_t most_slices = 64;
constexpr std::size_t least_slice_bins = 64;
constexpr std::size_t most_slice_bins = 1 << 17;
constexpr double moving_bins = 3;

// Lays slices upon each other, one after the other.
class Alignment {
 public:
  explicit Alignment(std::size_t bins) : sum_(bins), wave_(bins), correlation_(bins) {}

  // Adds a slice; returns the shift, in bins, by which the slice is later than the first slice.
  std::size_t place(const std::vector<float>& slice) {
    if (!empty_) shift_ = best_shift(slice);
    empty_ = false;
    for (std::size_t b = 0; b < sum_.size(); ++b) sum_[b] += slice[(b + shift_) % sum_.size()];
    return shift_;
  }

 private:
  std::size_t best_shift(const std::vector<float>& slice) {
    std::vector<std::complex<float>> of_sum;
    fft_.fwd(of_sum, sum_);
    fft_.fwd(wave_, slice);
    for (std::size_t f = 0; f < wave_.size(); ++f) wave_[f] *= std::conj(of_sum[f]);
    fft_.inv(correlation_, wave_);
    const auto best = static_cast<std::size_t>(
        std::max_element(correlation_.begin(), correlation_.end()) - correlation_.begin());
    const double gain = correlation_[best] - correlation_[shift_];
    return gain > sure_deviations_of_many * std::sqrt(noise(slice, best)) ? best : shift_;
  }

  // The variance, by the slice's photons, of the gain in correlation at a shift over the present
  // shift.
  [[nodiscard]] double noise(const std::vector<float>& slice, std::size_t shift) const {
    const std::size_t bins = sum_.size();
    double variance = 0;
    for (std::size_t b = 0; b < bins; ++b) {
      const double there = sum_[(b + bins - shift) % bins];
      const double here = sum_[(b + bins - shift_) % bins];
      variance += slice[b] * (there - here) * (there - here);
    }
    return variance;
  }

  Eigen::FFT<float> fft_;
  std::vector<float> sum_;  // of all slices so far, each shifted back
  std::vector<std::complex<float>> wave_;
  std::vector<float> correlation_;
  std::size_t shift_ = 0;
  bool empty_ = true;
};

struct Point {
  double time_s;
  double shift_bins;  // not modulo the circle: from slice to slice it goes the nearer way
};

TargetMotion::Motion line_through(const std::vector<Point>& points, double bin_ps) {
  const auto n = static_cast<double>(points.size());
  double t = 0, x = 0;
  for (const Point& p : points) {
    t += p.time_s / n;
    x += p.shift_bins / n;
  }
  double tt = 0, tx = 0, xx = 0;
  double low = points.front().shift_bins, high = low;
  for (const Point& p : points) {
    tt += (p.time_s - t) * (p.time_s - t);
    tx += (p.time_s - t) * (p.shift_bins - x);
    xx += (p.shift_bins - x) * (p.shift_bins - x);
    low = std::min(low, p.shift_bins);
    high = std::max(high, p.shift_bins);
  }
  // The variance is at least that of rounding to bins.
  const double left = std::max((xx - tx * tx / tt) / std::max(n - 2, 1.0), 1.0 / 12);
  return {(high - low) * bin_ps, tx / tt * bin_ps, std::sqrt(left / tt) * bin_ps};
}

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
  const std::int64_t middle_ps = frame.mid_ps();
  if (!begin_ps_) begin_ps_ = middle_ps;
  Slice& slice = slices_.back();
  ++slice.frames;
  slice.middle_s += static_cast<double>(middle_ps - *begin_ps_) * 1e-12;
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
  const auto bins = static_cast<double>(bins_);
  std::vector<Point> points;
  for (const Slice& slice : slices_) {
    const auto shift = static_cast<double>(alignment.place(slice.counts));
    const double before = points.empty() ? 0 : points.back().shift_bins;
    points.push_back({slice.middle_s / static_cast<double>(slice.frames),
                      before + std::remainder(shift - before, bins)});
  }
  const Motion motion = line_through(points, bin_ps_);
  if (motion.moved_ps < moving_bins * bin_ps_) return std::nullopt;
  return motion;
}

}  // namespace splid::calibration
