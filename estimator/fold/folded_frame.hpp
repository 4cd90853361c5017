#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/fold/delay_track.hpp"
#include "estimator/model/frame_view.hpp"
#include "estimator/model/pulse_train.hpp"

// The room fold/ turns the photons' times into what search/ works on. Open this file first.
// Its parts:
//   folded_frame.hpp       times in the pattern's clock ([P] Eq. 20), and phases in its period
//   dead_intervals.hpp         when the detector was dead
//   near_set.hpp           the photons near one line, and how far from its pulses they are
//   search_kernels.hpp     the inner loops of the search
//   kernel_choice.hpp      those for this processor's vectors

namespace splid {

struct DeadIntervals;

// A frame's photons in the pattern's own clock: their times from mid-frame, and their phases, which
// are these times folded on the pattern period; in ns of the calibrated pattern. `scale`, measured
// over calibrated period (Eq. 19), turns them into the tagger's ([P] Eq. 20).
//
// A target that moves at v = c g / (2 - g), with delay D = tau / (1 + v/c) at mid-frame, has its
// photons at phase = D + g time (+ pulse time), a straight line: [P] Eq. 1 solved for the emission
// time, (t - tau / (1 - beta)) (1 - beta) / (1 + beta) = t - D - g t, with g = 2 beta / (1 + beta).
// g is kept as itself, never as a difference from 1: at v = 10 nm/s it is 6.7e-17.
//
// There is one group for each segment of the train, of the photons that can only have left in it.
// In a train of several segments a last group holds the others: photons so soon after a segment's
// begin that they may have left in the one before, and those of segments whose period does not fit
// into the circle of delays.
struct FoldedFrame {
  std::vector<double> phase_ns;         // in [0, pattern period)
  std::vector<double> time_ns;          // from mid-frame, in [-length / 2, length / 2]
  std::vector<std::uint32_t> phase_32;  // from the segment's begin, in 2^-32 of its
                                        // comb's period: wraps by itself
  std::vector<std::size_t> group_end;   // photons of group k end here
  double length_ns = 0;                 // t_a
  double seen_ns = 0;                   // t_a less losses, in the tagger's clock
  double scale = 1;                     // measured over calibrated period
  // When the detector was dead, where the likelihood is to know it; else null. Not owned. A sample
  // of the frame does not have it.
  const DeadIntervals* dead = nullptr;

  // Makes room for frames of max_photons, whose fold() then allocates nothing. reach_ns: how far a
  // photon of a target may lie from its place at mid-frame: half the largest range walk, and the
  // reach of the pulse.
  FoldedFrame(const PulseTrain& train, std::size_t max_photons, double reach_ns = 0);
  // frame: locked to its syncs. train: that of the constructor.
  void fold(const FrameView& frame, const PulseTrain& train);
  // Becomes another frame, with its phases moved back by a track's quadratic term. The path of a
  // target that accelerates becomes a straight line. The frame is then without dead time, which
  // DeadIntervals::straighten() gives.
  void straighten(const FoldedFrame& curved, double quadratic_ns, const PulseTrain& train);
  // Becomes every step-th photon of another frame: a sample that shows the same target, with the
  // rates divided by step.
  void take_every(std::size_t step, const FoldedFrame& all);
  // Becomes another frame without the photons whose entry of `stays`, 0 or 1, is 0.
  void take_some(std::span<const std::uint8_t> stays, const FoldedFrame& all);
  [[nodiscard]] std::size_t size() const { return phase_ns.size(); }
  [[nodiscard]] double reach_ns() const { return reach_ns_; }
  // How much of the time seen the detector was dead, where that is known; tagger's clock.
  [[nodiscard]] double dead_ns() const;
  [[nodiscard]] std::size_t group_begin(std::size_t group) const {
    return group == 0 ? 0 : group_end[group - 1];
  }

 private:
  void group_by_segment(const PulseTrain& train);
  void resize(std::size_t count);
  // Takes the facts of another frame, but none of its groups.
  void begin_like(const FoldedFrame& other);
  void copy_photon(std::size_t to, const FoldedFrame& from, std::size_t photon);

  double reach_ns_;
  std::vector<std::uint8_t> group_;       // scratch: one a photon
  std::vector<double> phases_, times_;    // scratch
  std::vector<std::uint32_t> phases_32_;  // scratch
};

}  // namespace splid
