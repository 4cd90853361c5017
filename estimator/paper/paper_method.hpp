#pragma once

#include <optional>
#include <vector>

#include "estimator/model/options.hpp"
#include "estimator/paper/alternation.hpp"
#include "estimator/paper/crt.hpp"
#include "estimator/paper/train_photons.hpp"
#include "estimator/search/frame_search.hpp"
#include "protocol/pattern.hpp"

// The room paper/ is the method of [P] as [P] has it, the yardstick for splid's own search: its
// initialisers, then L-BFGS on two pairs of parameters in turn, with the likelihood of likelihood/.
// It allocates and is slower than search/. Open this file first. Its parts, in the order in which a
// folded frame passes them:
//   paper_start.cpp        where the refinement starts, by mode
//     matched_filter.hpp     random patterns: [P] Eq. 8 to 10
//     train_photons.hpp      other modes: the photons of one pulse train, those that belong to a
//                            sub-period of an interleaved pattern, their velocity by the observed
//                            repetition frequency, their delay modulo the period, and
//     crt.hpp                the delay itself, by a Chinese remainder theorem: [P] Eq. 16 to 18
//   alternation.hpp        the refinement

namespace splid::paper {

// What method `paper` found in a frame. All values are finite; delays are in the tagger's clock.
struct PaperResult {
  // Whether the values gain anything over no target. Where they do not, they are what the
  // refinement ended with, unless `stop` is not_run: then none holds.
  bool found = false;
  double delay_start_ns = 0;  // tau, round trip at the frame's start, in [0, unambiguous delay)
  double delay_ns = 0;        // round trip at mid-frame, in [0, unambiguous delay)
  double velocity_mps = 0;
  double signal_per_pulse = 0;   // S, of a pulse of amplitude 1
  double background_per_ns = 0;  // b
  double gain_nats = 0;          // log-likelihood over no target
  PaperParameters start;         // what the initialiser found, where the refinement started
  Stop stop = Stop::not_run;
};

// The method of [P], whole. Its limits, as [P] names them or as they follow from it:
//  - With a random pattern, a target that moves by more than some 15 pulse widths in a frame (5 m/s
//    in 50 ms) starts outside the reach of the refinement.
//  - A single pulse in each period needs more light for the Fourier analysis than for the
//    likelihood (see fourier_velocity_mps()).
//  - With MRR each photon counts for the train that plays when it arrives, so that trains have to
//    be long against the delay. Where delays nearly repeat (with 99.9 and 104.1 ns to 0.3 ns within
//    34.7 us), remainders have to be as good: with 48 photons of a rate in 8 to 9 frames of 10.
//
// The mixed-integer program has the answer of Wang's theorem wherever that applies; the study of
// [P] Fig. 5, which compares the two, gives Wang's (bench/studies/crt_wang.hpp).
//
// Threads: one call at a time. Errors: std::bad_alloc alone. Allocates. Nothing is found in frames
// that are not locked, have fewer than 3 photons, or whose photons all came at one time.
class PaperMethod {
 public:
  // pattern: valid.
  PaperMethod(const Pattern& pattern, const PulseShape& shape, const SceneOptions& scene,
              RemainderTheorem theorem = crt_mixed_integer);

  [[nodiscard]] PaperResult estimate(const FrameView& view) const;
  // The same as a start that is judged as a result of the search is: by the same likelihood, with
  // the same deviations and the same threshold. frame: the folded view. The search runs too, for
  // the odds of the range.
  std::optional<Start> start(const FrameView& view, const FoldedFrame& frame, FrameSearch& search);

 private:
  [[nodiscard]] PaperResult estimate(const FrameView& view, const FoldedFrame& frame) const;

  // The evenly spaced pulses of a comb, taken as one pulse in each of their spacings.
  struct Repetition {
    double period_ns;
    double offset_ns;  // where the pulse is in that period
    double amplitude;  // of the pulse; the mean where several differ
  };
  [[nodiscard]] static Repetition repetition_of(const Comb& comb);
  [[nodiscard]] Repetition subperiod_of(double nominal_ns) const;
  // The photons of a train, or of a sub-period.
  [[nodiscard]] TrainPhotons photons_of(const FrameView& view, const FoldedFrame& frame,
                                        std::size_t index) const;
  // Where the refinement starts: by matched filter, or by Fourier analysis and censoring of each
  // train. Their result is the mean over the trains, with the delay that the Chinese remainder
  // theorem makes of the trains' delays. Absent where the photons show no peak.
  [[nodiscard]] std::optional<PaperParameters> find_start(const FrameView& view,
                                                          const FoldedFrame& frame) const;

  const PulseShape& shape_;
  SceneOptions scene_;
  double max_speed_mps_;  // 0 for a target at rest
  Mode mode_;
  double unambiguous_ns_;
  RemainderTheorem theorem_;
  PulseTrain train_;
  std::vector<Repetition> repetitions_;  // of each train, or of each sub-period where interleaved
};

}  // namespace splid::paper
