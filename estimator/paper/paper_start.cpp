#include "estimator/paper/paper_start.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/model/units.hpp"
#include "estimator/paper/clusters.hpp"
#include "estimator/paper/crt.hpp"
#include "estimator/paper/folded_peak.hpp"
#include "estimator/paper/fourier_velocity.hpp"

namespace splid::paper {

PaperStart::PaperStart(const Pattern& pattern, const EmissionTimes& emission,
                       const PulseShape& shape, double max_speed_mps, RemainderTheorem theorem)
    : emission_(emission),
      shape_(shape),
      max_speed_mps_(max_speed_mps),
      mode_(pattern.mode),
      unambiguous_ns_(pattern.unambiguous_delay_ps * ns_per_ps),
      theorem_(theorem) {
  if (mode_ == Mode::random) {
    filter_.emplace(emission, shape);
  } else if (mode_ == Mode::interleaved) {
    for (const double subperiod_ps : pattern.subperiods_ps) {
      repetitions_.push_back(subperiod_of(subperiod_ps * ns_per_ps));
    }
  } else {
    for (const auto& segment : emission.train().segments) {
      repetitions_.push_back(repetition_of(segment.comb));
    }
  }
}

// A train whose pulses are not evenly spaced is no periodic mode of [P]. Its strongest pulse then
// stands for all of them.
PaperStart::Repetition PaperStart::repetition_of(const Comb& comb) const {
  const auto pulses = static_cast<double>(comb.times_ns.size());
  const double spacing_ns = comb.period_ns / pulses;
  bool even = true;
  for (std::size_t p = 0; p < comb.times_ns.size(); ++p) {
    const double place_ns = comb.times_ns.front() + static_cast<double>(p) * spacing_ns;
    even = even && std::abs(comb.times_ns[p] - place_ns) <= shape_.width_ns();
  }
  if (even) return {spacing_ns, comb.times_ns.front(), comb.total_amplitude / pulses};
  const auto strongest = std::max_element(comb.amplitudes.begin(), comb.amplitudes.end());
  const auto place = static_cast<std::size_t>(strongest - comb.amplitudes.begin());
  return {comb.period_ns, comb.times_ns[place], *strongest};
}

// The pulses of a sub-period are where most of the pattern's light lies modulo t_k. That is at 0,
// except in a calibrated pattern, whose times may have any origin.
PaperStart::Repetition PaperStart::subperiod_of(double nominal_ns) const {
  const Comb& comb = emission_.train().segments.front().comb;
  const double turns = std::round(comb.period_ns / nominal_ns);
  const double period_ns = comb.period_ns / turns;
  std::vector<double> rests_ns;
  for (const double time_ns : comb.times_ns) rests_ns.push_back(fold_on(time_ns, period_ns));
  const Cluster cluster =
      find_largest_cluster(rests_ns, comb.amplitudes, period_ns, shape_.width_ns());
  return {period_ns, cluster.middle_ns, cluster.weight / turns};
}

TrainPhotons PaperStart::photons_of(const CorrectedTimes& frame, std::size_t index) const {
  const PulseTrain::Segment& train = emission_.train().segments[index];
  const double length_ns = train.end_ns - train.begin_ns;
  const Repetition& repetition = repetitions_[index];
  TrainPhotons photons;
  photons.period_ns = repetition.period_ns;
  // Where the frame starts while the train plays, the train is seen from the frame's start on.
  const double into_ns = fold_on(frame.start_phase_ns - train.begin_ns, frame.period_ns);
  photons.start_ns = into_ns < length_ns ? 0 : frame.period_ns - into_ns;
  for (std::size_t j = 0; j < frame.time_ns.size(); ++j) {
    const double within_ns = frame.phase_ns[j] - train.begin_ns;
    if (within_ns < 0 || within_ns >= length_ns) continue;
    photons.phase_ns.push_back(fold_on(within_ns - repetition.offset_ns, repetition.period_ns));
    photons.time_ns.push_back(frame.time_ns[j] - photons.start_ns);
  }
  // How long the train was on between the frame's start and a time.
  const auto on_ns = [&](double time_ns) {
    const double since_ns = time_ns + into_ns;
    const double turns = std::floor(since_ns / frame.period_ns);
    return turns * length_ns + std::min(since_ns - turns * frame.period_ns, length_ns);
  };
  for (const auto& span : frame.seen) photons.seen_ns += on_ns(span.end_ns) - on_ns(span.begin_ns);
  photons.amplitude = repetition.amplitude * photons.seen_ns / repetition.period_ns;
  photons.counted = static_cast<double>(photons.size());
  return photons;
}

TrainPhotons PaperStart::photons_of_subperiod(const CorrectedTimes& frame,
                                              const Repetition& subperiod) const {
  TrainPhotons photons;
  photons.period_ns = subperiod.period_ns;
  for (const double phase_ns : frame.phase_ns) {
    photons.phase_ns.push_back(fold_on(phase_ns - subperiod.offset_ns, subperiod.period_ns));
  }
  photons.time_ns = frame.time_ns;
  photons.seen_ns = frame.seen_ns;
  photons.amplitude = subperiod.amplitude * photons.seen_ns / subperiod.period_ns;
  photons.counted = static_cast<double>(photons.size());
  const double motion_ns = 2 * max_speed_mps_ / speed_of_light_mps * frame.length_ns;
  keep_largest_cluster(photons, 4 * shape_.width_ns() + motion_ns);
  return photons;
}

std::optional<PaperParameters> PaperStart::from_trains(
    const std::vector<TrainPhotons>& trains) const {
  PaperParameters mean;
  std::vector<double> delays_ns, counts;
  for (const TrainPhotons& photons : trains) {
    if (!(photons.seen_ns > 0)) return std::nullopt;
    const double velocity_mps = fourier_velocity_mps(photons, shape_.width_ns(), max_speed_mps_);
    const FoldedPeak peak = find_folded_peak(photons, velocity_mps, shape_);
    if (!peak.found) return std::nullopt;
    delays_ns.push_back(peak.delay_ns);
    counts.push_back(peak.signal_per_pulse * photons.amplitude);
    const auto share = 1 / static_cast<double>(trains.size());
    mean.velocity_mps += share * velocity_mps;
    mean.signal_per_pulse += share * peak.signal_per_pulse;
    mean.background_per_ns += share * peak.background_per_ns;
  }
  const double beta = mean.velocity_mps / speed_of_light_mps;
  const double rate = 2 * beta / (1 + beta);
  if (trains.size() == 1) {
    mean.delay_ns = (delays_ns.front() - rate * trains.front().start_ns) * (1 + beta);
    return mean;
  }
  // [P] Eq. 5: train k sees tau + 2 v t_0^k / c, which is taken back to the frame's start here. A
  // mean of n photons has n times the weight of one photon.
  std::vector<Remainder> remainders;
  for (std::size_t k = 0; k < trains.size(); ++k) {
    const double value_ns = delays_ns[k] - rate * trains[k].start_ns;
    remainders.push_back(
        {fold_on(value_ns, trains[k].period_ns), trains[k].period_ns, std::max(counts[k], 1e-3)});
  }
  const CrtSolution crt = theorem_ == RemainderTheorem::wang
                              ? crt_wang(remainders, wang_unit_ns)
                              : crt_mixed_integer(remainders, unambiguous_ns_);
  if (!crt.found) return std::nullopt;
  mean.delay_ns = crt.value_ns * (1 + beta);
  return mean;
}

PaperParameters PaperStart::by_matched_filter(const CorrectedTimes& frame) const {
  PaperParameters start;
  start.delay_ns = filter_->delay_ns(frame);
  const Counting counting =
      count_signal(frame, emission_, shape_.width_ns(), start.delay_ns, max_speed_mps_);
  start.signal_per_pulse = counting.signal_per_pulse;
  start.background_per_ns = counting.background_per_ns;
  return start;
}

std::optional<PaperParameters> PaperStart::find(const CorrectedTimes& frame) const {
  std::optional<PaperParameters> start;
  if (filter_) {
    start = by_matched_filter(frame);
  } else {
    std::vector<TrainPhotons> trains;
    for (std::size_t k = 0; k < repetitions_.size(); ++k) {
      trains.push_back(mode_ == Mode::interleaved ? photons_of_subperiod(frame, repetitions_[k])
                                                  : photons_of(frame, k));
    }
    start = from_trains(trains);
  }
  // The background was counted in the pattern's clock, in which the frame is shorter by `scale`.
  if (start) start->background_per_ns /= frame.scale;
  return start;
}

}  // namespace splid::paper
