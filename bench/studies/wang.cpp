#include "bench/studies/wang.hpp"

#include <vector>

#include "estimator/model/units.hpp"
#include "estimator/paper/crt.hpp"
#include "estimator/paper/folded_peak.hpp"
#include "estimator/paper/fourier_velocity.hpp"

namespace splid::studies {
namespace {

// The photons of each segment: those that come while the segment is played.
std::vector<paper::TrainPhotons> trains_of(const Pattern& pattern, const FrameView& frame) {
  std::vector<paper::TrainPhotons> trains;
  double begin_ns = 0;
  for (const PatternSegment& segment : pattern.segments) {
    paper::TrainPhotons train;
    const auto repeats = static_cast<double>(segment.repeats);
    train.period_ns = segment.period_ps * ns_per_ps;
    train.start_ns = begin_ns;
    train.seen_ns = repeats * train.period_ns;
    train.amplitude = repeats;
    for (const std::int64_t photon_ps : frame.photons_ps) {
      const double time_ns = static_cast<double>(photon_ps - frame.start_ps) * ns_per_ps - begin_ns;
      if (time_ns < 0 || time_ns >= train.seen_ns) continue;
      train.time_ns.push_back(time_ns);
      train.phase_ns.push_back(paper::fold_on(time_ns, train.period_ns));
    }
    train.counted = static_cast<double>(train.size());
    begin_ns += train.seen_ns;
    trains.push_back(std::move(train));
  }
  return trains;
}

}  // namespace

Estimate estimate_by_wang(const Pattern& pattern, const PulseShape& shape, const FrameView& frame,
                          double max_mps) {
  const std::vector<paper::TrainPhotons> trains = trains_of(pattern, frame);
  const double share = 1 / static_cast<double>(trains.size());
  Estimate mean;
  std::vector<double> delays_ns;
  for (const paper::TrainPhotons& train : trains) {
    const double velocity_mps = paper::fourier_velocity_mps(train, shape.width_ns(), max_mps);
    const paper::FoldedPeak peak = paper::find_folded_peak(train, velocity_mps, shape);
    if (!peak.found) return {};
    delays_ns.push_back(peak.delay_ns);
    mean.velocity_mps += share * velocity_mps;
    mean.signal_per_pulse += share * peak.signal_per_pulse;
    mean.background_per_ns += share * peak.background_per_ns;
  }
  // [P] Eq. 5: train k sees the delay that the target has moved to when it starts.
  const double beta = mean.velocity_mps / speed_of_light_mps;
  std::vector<paper::Remainder> remainders;
  for (std::size_t k = 0; k < trains.size(); ++k) {
    const double moved_ns = 2 * beta / (1 + beta) * trains[k].start_ns;
    remainders.push_back(
        {paper::fold_on(delays_ns[k] - moved_ns, trains[k].period_ns), trains[k].period_ns, 1});
  }
  const paper::CrtSolution turns = paper::crt_wang(remainders, 1);
  if (!turns.found) return {};
  mean.has_values = true;
  mean.delay_start_ns = turns.value_ns * (1 + beta);
  const double half_ns = static_cast<double>(frame.end_ps - frame.start_ps) * ns_per_ps / 2;
  mean.delay_ns = mean.delay_start_ns + 2 * beta * half_ns;
  return mean;
}

}  // namespace splid::studies
