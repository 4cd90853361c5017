#pragma once

#include <cstddef>

#include "estimator/model/estimate.hpp"
#include "estimator/model/frame_view.hpp"
#include "estimator/model/options.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/paper/emission_times.hpp"
#include "estimator/paper/paper_start.hpp"
#include "protocol/pattern.hpp"

namespace splid::paper {

// What method `paper` found in a frame; all values are finite.
struct PaperResult {
  bool found = false;         // false: nothing below holds but photons
  double delay_start_ns = 0;  // tau, round trip at the frame's start, in [0, unambiguous delay)
  double delay_ns = 0;        // round trip at mid-frame, in [0, unambiguous delay)
  double velocity_mps = 0;
  double signal_per_pulse = 0;        // S, of a pulse of amplitude 1
  double background_per_ns = 0;       // b
  double gain_nats = 0;               // log-likelihood over no target
  double initial_delay_start_ns = 0;  // where the refinement started
  double initial_velocity_mps = 0;
  Stop stop = Stop::not_run;
  std::size_t photons = 0;
};

// The method of [P], kept whole, as the yardstick for splid's own search: Fourier analysis and
// censoring (periodic modes), with the robust Chinese remainder theorem (MRR, interleaved), or a
// matched filter at v = 0 and counting (random); then L-BFGS on (S, b) and (tau, v) in turn.
//
// What it cannot do, as [P] says of it or as follows from it: a random pattern's target that moves
// by more than some 15 pulse widths in a frame (5 m/s in 50 ms) starts outside the refinement's
// reach; a single pulse a period needs more light for its Fourier analysis than for its likelihood
// (see fourier_velocity_mps); MRR gives each photon to the train that plays when it arrives, so
// trains must be long against the delay, and where delays nearly repeat within the unambiguous one
// (99.9 and 104.1 ns: to 0.3 ns within their common multiple of 34.7 us) their remainders must be
// as good: 8 to 9 of 10 frames with 48 photons a rate are.
//
// Of [P]'s two remainder theorems the mixed-integer program is used throughout: it has the same
// answer where Wang's applies, and the moduli of a calibrated pattern are never whole numbers.
//
// Threads: one call at a time; objects share nothing. Errors: std::bad_alloc alone; frames that are
// not locked to their syncs, of fewer than 3 photons, or whose photons all came at one time are not
// found. Allocates: it is for comparison, not for the way of a frame.
class PaperMethod {
 public:
  // pattern must be valid; shape must outlive the object.
  PaperMethod(const Pattern& pattern, const PulseShape& shape, const SceneOptions& scene);
  // start_ refers to emission_.
  PaperMethod(const PaperMethod&) = delete;
  PaperMethod& operator=(const PaperMethod&) = delete;

  PaperResult estimate(const FrameView& view);

 private:
  const PulseShape& shape_;
  double max_speed_mps_;
  double unambiguous_ns_;
  EmissionTimes emission_;
  PaperStart start_;
};

}  // namespace splid::paper
