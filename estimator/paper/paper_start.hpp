#pragma once

#include <optional>
#include <vector>

#include "estimator/model/pulse_shape.hpp"
#include "estimator/paper/corrected_times.hpp"
#include "estimator/paper/emission_times.hpp"
#include "estimator/paper/matched_filter.hpp"
#include "estimator/paper/paper_likelihood.hpp"
#include "estimator/paper/train_photons.hpp"
#include "protocol/pattern.hpp"

namespace splid::paper {

// [P]'s initialisers: where the refinement starts. Each takes a frame of its own modes and gives
// none where the photons show no peak. max_speed_mps 0: a target at rest. Threads: any.
class PaperStart {
 public:
  // emission and shape must outlive it.
  PaperStart(const Pattern& pattern, const EmissionTimes& emission, const PulseShape& shape,
             double max_speed_mps);

  [[nodiscard]] std::optional<PaperParameters> find(const CorrectedTimes& frame) const;

 private:
  // The evenly spaced pulses of a train, as one pulse a period.
  struct Repetition {
    double period_ns;
    double offset_ns;  // of the pulse in the period
    double amplitude;  // of it; the mean where several differ
  };
  [[nodiscard]] Repetition repetition_of(const EmissionTimes::Train& train) const;
  [[nodiscard]] Repetition subperiod_of(double nominal_ns) const;
  [[nodiscard]] TrainPhotons photons_of(const CorrectedTimes& frame, std::size_t index) const;
  [[nodiscard]] TrainPhotons photons_of_subperiod(const CorrectedTimes& frame,
                                                  const Repetition& subperiod) const;
  // Fourier analysis and censoring of each train; their mean, and the delay that the robust Chinese
  // remainder theorem makes of their delays.
  [[nodiscard]] std::optional<PaperParameters> from_trains(
      const std::vector<TrainPhotons>& trains) const;
  [[nodiscard]] PaperParameters by_matched_filter(const CorrectedTimes& frame) const;

  const EmissionTimes& emission_;
  const PulseShape& shape_;
  double max_speed_mps_;
  Mode mode_;
  double unambiguous_ns_;
  std::optional<MatchedFilter> filter_;  // of random patterns
  std::vector<Repetition> repetitions_;  // of each train, or of each sub-period where interleaved
};

}  // namespace splid::paper
