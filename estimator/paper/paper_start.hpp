#pragma once

#include <optional>
#include <vector>

#include "estimator/fold/folded_frame.hpp"
#include "estimator/model/frame_view.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"
#include "estimator/paper/alternation.hpp"
#include "estimator/paper/crt.hpp"
#include "estimator/paper/train_photons.hpp"
#include "protocol/pattern.hpp"

namespace splid::paper {

// The initialisers of [P], which find where the refinement starts. Which of them is used depends on
// the mode. The result is absent where the photons show no peak. max_speed_mps is 0 for a target at
// rest.
class PaperStart {
 public:
  PaperStart(const Pattern& pattern, const PulseTrain& train, const PulseShape& shape,
             double max_speed_mps, RemainderTheorem theorem = crt_mixed_integer);

  // frame: the folded view, which has photons.
  [[nodiscard]] std::optional<PaperParameters> find(const FrameView& view,
                                                    const FoldedFrame& frame) const;

 private:
  // The evenly spaced pulses of a comb, taken as one pulse in each of their spacings.
  struct Repetition {
    double period_ns;
    double offset_ns;  // where the pulse is in that period
    double amplitude;  // of the pulse; the mean where several differ
  };
  [[nodiscard]] Repetition repetition_of(const Comb& comb) const;
  [[nodiscard]] Repetition subperiod_of(double nominal_ns) const;
  [[nodiscard]] TrainPhotons photons_of(const FrameView& view, const FoldedFrame& frame,
                                        std::size_t index) const;
  [[nodiscard]] TrainPhotons photons_of_subperiod(const FoldedFrame& frame,
                                                  const Repetition& subperiod) const;
  // Fourier analysis and censoring of each train. The result is the mean over the trains, with the
  // delay that the Chinese remainder theorem makes of the trains' delays.
  [[nodiscard]] std::optional<PaperParameters> from_trains(
      const std::vector<TrainPhotons>& trains) const;
  [[nodiscard]] PaperParameters by_matched_filter(const FoldedFrame& frame) const;

  const PulseTrain& train_;
  const PulseShape& shape_;
  double max_speed_mps_;
  Mode mode_;
  double unambiguous_ns_;
  RemainderTheorem theorem_;
  std::vector<Repetition> repetitions_;  // of each train, or of each sub-period where interleaved
};

}  // namespace splid::paper
