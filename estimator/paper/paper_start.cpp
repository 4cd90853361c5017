#include <algorithm>
#include <cmath>

#include "estimator/model/units.hpp"
#include "estimator/paper/matched_filter.hpp"
#include "estimator/paper/paper_method.hpp"

namespace splid::paper {

PaperMethod::Repetition PaperMethod::repetition_of(const Comb& comb) {
  const auto pulses = static_cast<double>(comb.times_ns.size());
  return {comb.period_ns / pulses, comb.times_ns.front(), comb.total_amplitude / pulses};
}

// The pulses of a sub-period are where most of the pattern's light lies modulo t_k. That is at 0,
// except in a calibrated pattern, whose times may have any origin.
PaperMethod::Repetition PaperMethod::subperiod_of(double nominal_ns) const {
  const Comb& comb = train_.segments.front().comb;
  const double turns = std::round(comb.period_ns / nominal_ns);
  const double period_ns = comb.period_ns / turns;
  std::vector<double> rests_ns;
  for (const double time_ns : comb.times_ns) rests_ns.push_back(fold_on(time_ns, period_ns));
  const Cluster cluster =
      find_largest_cluster(rests_ns, comb.amplitudes, period_ns, shape_.width_ns());
  return {period_ns, cluster.middle_ns, cluster.weight / turns};
}

TrainPhotons PaperMethod::photons_of(const FrameView& view, const FoldedFrame& frame,
                                     std::size_t index) const {
  // All sub-periods of an interleaved pattern play in its one train.
  const bool is_subperiod = mode_ == Mode::interleaved;
  const PulseTrain::Segment& train = train_.segments[is_subperiod ? 0 : index];
  const double length_ns = train.end_ns - train.begin_ns, period_ns = train_.period_ns;
  const Repetition& repetition = repetitions_[index];
  TrainPhotons photons;
  photons.period_ns = repetition.period_ns;
  // Where the frame starts while the train plays, the train is seen from the frame's start on.
  const double mid_ns = frame.length_ns / 2;
  const double into_ns =
      fold_on(frame.phase_ns[0] - (frame.time_ns[0] + mid_ns) - train.begin_ns, period_ns);
  photons.start_ns = into_ns < length_ns ? 0 : period_ns - into_ns;
  for (std::size_t j = 0; j < frame.size(); ++j) {
    const double within_ns = frame.phase_ns[j] - train.begin_ns;
    if (within_ns < 0 || within_ns >= length_ns) continue;
    photons.phase_ns.push_back(fold_on(within_ns - repetition.offset_ns, repetition.period_ns));
    photons.time_ns.push_back(frame.time_ns[j] + mid_ns - photons.start_ns);
  }
  // How long the train was on between the frame's start and a time.
  const auto on_ns = [&](std::int64_t time_ps) {
    const double time_ns = static_cast<double>(time_ps - view.start_ps) * ns_per_ps / frame.scale;
    const double turns = std::floor((time_ns + into_ns) / period_ns);
    return turns * length_ns + std::min(time_ns + into_ns - turns * period_ns, length_ns);
  };
  photons.seen_ns = on_ns(view.end_ps) - on_ns(view.start_ps);
  for (const Loss& loss : view.losses) photons.seen_ns -= on_ns(loss.end_ps) - on_ns(loss.begin_ps);
  photons.amplitude = repetition.amplitude * photons.seen_ns / repetition.period_ns;
  photons.counted = static_cast<double>(photons.size());
  if (is_subperiod) {
    const double motion_ns = 2 * max_speed_mps_ / speed_of_light_mps * frame.length_ns;
    keep_largest_cluster(photons, 4 * shape_.width_ns() + motion_ns);
  }
  return photons;
}

std::optional<PaperParameters> PaperMethod::find_start(const FrameView& view,
                                                       const FoldedFrame& frame) const {
  if (mode_ == Mode::random) {
    const double delay_ns = matched_delay_ns(frame, train_, shape_);
    return count_signal(frame, train_, shape_.width_ns(), delay_ns, max_speed_mps_);
  }
  PaperParameters mean;
  std::vector<Remainder> remainders;
  std::vector<double> starts_ns;
  for (std::size_t k = 0; k < repetitions_.size(); ++k) {
    const TrainPhotons photons = photons_of(view, frame, k);
    if (!(photons.seen_ns > 0)) return std::nullopt;
    const double velocity_mps = fourier_velocity_mps(photons, shape_.width_ns(), max_speed_mps_);
    const auto peak = find_folded_peak(photons, velocity_mps, shape_);
    if (!peak) return std::nullopt;
    // A mean of n photons has n times the weight of one photon.
    const double counts = peak->signal_per_pulse * photons.amplitude;
    remainders.push_back({peak->delay_ns, photons.period_ns, std::max(counts, 1e-3)});
    starts_ns.push_back(photons.start_ns);
    const auto share = 1 / static_cast<double>(repetitions_.size());
    mean.velocity_mps += share * velocity_mps;
    mean.signal_per_pulse += share * peak->signal_per_pulse;
    mean.background_per_ns += share * peak->background_per_ns;
  }
  // The background was counted in the pattern's clock, in which the frame is shorter by `scale`.
  mean.background_per_ns /= frame.scale;
  const double beta = mean.velocity_mps / speed_of_light_mps;
  const double rate = 2 * beta / (1 + beta);
  // [P] Eq. 5: train k sees tau + 2 v t_0^k / c, which is taken back to the frame's start here.
  for (std::size_t k = 0; k < remainders.size(); ++k) {
    remainders[k].value_ns -= rate * starts_ns[k];
  }
  if (remainders.size() == 1) {
    mean.delay_ns = remainders.front().value_ns * (1 + beta);
    return mean;
  }
  for (Remainder& r : remainders) r.value_ns = fold_on(r.value_ns, r.modulus_ns);
  const CrtSolution crt = theorem_(remainders, unambiguous_ns_);
  if (!crt.found) return std::nullopt;
  mean.delay_ns = crt.value_ns * (1 + beta);
  return mean;
}

}  // namespace splid::paper
