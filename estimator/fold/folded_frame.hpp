#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/model/comb.hpp"
#include "estimator/model/frame_view.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid {

// A frame's photons in the pattern's own clock: relative to mid-frame, and folded on the pattern
// period. All times here are ns of the calibrated pattern; `scale` turns them into the tagger's.
//
// A target that moves at v = c g / (2 - g) with delay D = tau / (1 + v/c) at mid-frame has its
// photons at phase = D + g time (+ pulse time), a straight line: [P] Eq. 1 solved for the emission
// time, (t - tau / (1 - beta)) (1 - beta) / (1 + beta) = t - D - g t, g = 2 beta / (1 + beta).
//
// Design note: g is kept, never 1 - g: at v = 10 nm/s g is 6.7e-17, which 1 - g would lose.
//
// Photons stand in groups, one for each stretch of the pulse train: those that can only have left
// in the stretch in which they came. In a train of several stretches a last group holds those that
// came so soon after a stretch's begin that they may have left in the one before, and those of
// stretches whose period does not fit into the circle of delays.
struct FoldedFrame {
  std::vector<double> phase_ns;                    // in [0, pattern period)
  std::vector<double> time_ns;                     // from mid-frame, in [-length / 2, length / 2]
  std::vector<std::uint32_t> phase_32;             // from the stretch's begin, in 2^-32 of its
                                                   // comb's period: wraps by itself
  std::vector<std::size_t> group_end;              // photons of group k end here
  double length_ns = 0;                            // t_a
  double seen_ns = 0;                              // t_a less losses, in the tagger's clock
  double scale = 1;                                // measured over calibrated period
  std::vector<double> lost_begin_ns, lost_end_ns;  // losses, from mid-frame

  // Room for max_photons without allocation. reach_ns: how far a photon may lie from where a target
  // with a delay in the train's circle has it at mid-frame (half the largest travel).
  FoldedFrame(const PulseTrain& train, std::size_t max_photons, double reach_ns = 0);
  // The frame must be locked to its syncs; the train is the constructor's.
  void fold(const FrameView& frame, const PulseTrain& train);
  // Every step-th photon of another's: what they say is the same, the exposure that many times
  // less.
  void take_every(std::size_t step, const FoldedFrame& all);
  [[nodiscard]] std::size_t size() const { return phase_ns.size(); }
  [[nodiscard]] double reach_ns() const { return reach_ns_; }
  [[nodiscard]] std::size_t group_begin(std::size_t group) const {
    return group == 0 ? 0 : group_end[group - 1];
  }

 private:
  void correct_times(const FrameView& frame, double period_ns);
  void group_by_stretch(const PulseTrain& train);

  double reach_ns_;
  std::vector<std::uint8_t> group_;       // scratch: one a photon
  std::vector<double> phases_, times_;    // scratch
  std::vector<std::uint32_t> phases_32_;  // scratch
};

// A line through a folded frame: where a moving target's photons lie.
struct DelayLine {
  double delay_ns = 0;   // D at mid-frame
  double travel_ns = 0;  // g t_a: how far the delay moves over the frame; positive recedes
};

}  // namespace splid
