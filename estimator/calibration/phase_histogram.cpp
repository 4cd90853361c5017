#include "estimator/calibration/phase_histogram.hpp"

#include <algorithm>
#include <cmath>

namespace splid::calibration {
namespace {

constexpr double bins_per_width = 32;
constexpr double most_bins = 1 << 23;

}  // namespace

FramePhase::FramePhase(const FrameView& view)
    : origin_ps_(view.sync.origin_ps), turns_per_ps_(1 / view.sync.period_ps) {
  const double half_ps = static_cast<double>(view.end_ps - view.start_ps) / 2;
  phase_ps_ = view.sync.phase_ps - view.sync.curvature_ps * view.sync.curvature_zero;
  curvature_ = view.sync.curvature_ps / (half_ps * half_ps);
}

double FramePhase::turn_of(std::int64_t photon_ps) const {
  const auto from_ps = static_cast<double>(photon_ps - origin_ps_);
  const double turns = (from_ps - phase_ps_ - curvature_ * from_ps * from_ps) * turns_per_ps_;
  return turns - std::floor(turns);
}

std::size_t FramePhase::bin_of(std::int64_t photon_ps, std::size_t bins) const {
  const double place = turn_of(photon_ps) * static_cast<double>(bins);
  return std::min(static_cast<std::size_t>(place), bins - 1);
}

PhaseHistogram::PhaseHistogram(double period_ps, double width_ps) {
  const double bins = std::ceil(period_ps / width_ps * bins_per_width);
  counts_.resize(static_cast<std::size_t>(std::min(bins, most_bins)));
}

void PhaseHistogram::add(const FrameView& frame) {
  if (!frame.sync.locked) return;
  const FramePhase phase(frame);
  for (const std::int64_t photon_ps : frame.photons_ps) ++counts_[phase.bin_of(photon_ps, bins())];
  period_.add(frame.sync);
  photons_ += frame.photons_ps.size();
  seconds_ += frame.seen_ns() * 1e-9;
  const double share = static_cast<double>(frame.photons_ps.size()) * frame.sync.std_phase_ps;
  phase_variance_ps2_ += share * share;
}

double PhaseHistogram::std_phase_ps() const {
  return photons_ > 0 ? std::sqrt(phase_variance_ps2_) / static_cast<double>(photons_) : 0;
}

std::size_t PhaseHistogram::wrapped(std::ptrdiff_t bin) const {
  const auto count = static_cast<std::ptrdiff_t>(bins());
  const std::ptrdiff_t rest = bin % count;
  return static_cast<std::size_t>(rest < 0 ? rest + count : rest);
}

}  // namespace splid::calibration
