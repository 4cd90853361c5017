#include "estimator/checks/detector_watch.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/model/units.hpp"

namespace splid::checks {
namespace {

constexpr std::size_t most_photons = 1 << 16;
constexpr double second_ns = 1e9, longest_ns = 60e9;
constexpr double enough_detections = 1 << 18;
constexpr double return_widths = 3;

}  // namespace

DetectorWatch::DetectorWatch(const Pattern& pattern, const PulseOptions& pulse,
                             const DetectorOptions& detector, ClockReference reference,
                             std::size_t inputs)
    : train_(pattern),
      shape_(configured_pulse(pattern, pulse)),
      reference_(reference),
      inputs_(inputs),
      reach_ns_(return_widths * shape_->width_ns()),
      windows_(comb_windows(train_, -reach_ns_, reach_ns_)),
      folded_(train_, most_photons),
      near_(most_photons, most_photons * widest_overlap(windows_), true),
      waits_(detector.dead_time_ns) {}

void DetectorWatch::clear() {
  waits_.clear();
  since_judged_ns_ = since_clear_ns_ = 0;
  found_ = {};
}

void DetectorWatch::add(const FrameView& frame, const Estimate& estimate) {
  if (inputs_ > 1 || !frame.sync.locked || !frame.losses.empty()) return;
  const std::size_t count = std::min(frame.photons_ps.size(), most_photons);
  const auto looked = frame.photons_ps.subspan((frame.photons_ps.size() - count) / 2, count);
  times_ps_.assign(looked.begin(), looked.end());
  if (!std::is_sorted(times_ps_.begin(), times_ps_.end())) {
    std::sort(times_ps_.begin(), times_ps_.end());
  }
  waits_.add(times_ps_, frame.sync.period_ps);
  if (estimate.status == FrameStatus::ok && train_.single()) add_returns(frame, estimate);
  const auto length_ns = static_cast<double>(frame.end_ps - frame.start_ps) * ns_per_ps;
  since_judged_ns_ += length_ns, since_clear_ns_ += length_ns;
  if (since_judged_ns_ < second_ns) return;
  found_ = waits_.found(static_cast<double>(frame.photons_ps.size()), shape_->width_ns());
  if (found_.has(FindingName::timing_walk)) walk_ = waits_.walk(shape_->width_ns());
  since_judged_ns_ = 0;
  if (waits_.detections() < enough_detections && since_clear_ns_ < longest_ns) return;
  waits_.clear();
  since_clear_ns_ = 0;
}

void DetectorWatch::add_returns(const FrameView& frame, const Estimate& estimate) {
  FrameView looked = frame;
  looked.photons_ps = times_ps_;
  folded_.fold(looked, train_);
  const double in_pulse = estimate.signal_per_pulse * train_.mean_amplitude();
  const double share = in_pulse / (in_pulse + 2 * reach_ns_ * estimate.background_per_ns);
  const double beta = estimate.velocity_mps / speed_of_light_mps;
  const double to_reference = reference_ == ClockReference::tagger ? folded_.scale : 1;
  const double delay_ns = estimate.delay_ns / to_reference / (1 + beta);
  near_.collect(folded_, windows_, train_,
                {delay_ns, walk_ns_at(estimate.velocity_mps, folded_.length_ns)});
  for (std::size_t n = 0; n < near_.photons(); ++n) {
    const std::size_t i = near_.index[n];
    if (i == 0) continue;
    waits_.add_return(times_ps_[i] - times_ps_[i - 1], near_.residual_ns[near_.first[n]], share);
  }
}

}  // namespace splid::checks
