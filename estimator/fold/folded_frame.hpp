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
  // with a delay in the train's circle has it at mid-frame (half the largest drift).
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
  void fold_times(const FrameView& frame, double period_ns);
  void group_by_stretch(const PulseTrain& train);

  double reach_ns_;
  std::vector<std::uint8_t> group_;       // scratch: one a photon
  std::vector<double> phases_, times_;    // scratch
  std::vector<std::uint32_t> phases_32_;  // scratch
};

// A line through a folded frame: where a moving target's photons lie.
struct DelayLine {
  double delay_ns = 0;  // D at mid-frame
  double drift_ns = 0;  // g t_a: how far the delay moves over the frame; positive recedes
};

// The photons near a line's comb, as the likelihood needs them: one entry for each (photon, pulse)
// whose residual lies in the window. Photons without an entry are background to it.
struct NearSet {
  DelayLine line;                    // the residuals' zero
  std::vector<double> residual_ns;   // emission time less pulse time
  std::vector<double> position;      // time / t_a, in [-1/2, 1/2]
  std::vector<double> amplitude;     // a_p
  std::vector<std::uint32_t> first;  // entries of photon k are [first[k], first[k + 1])
  std::vector<double> weight;        // photons that photon k stands for; 1 but after gather()
  std::size_t far_photons = 0;       // those with no entry
  double near_photons = 0;           // those with one, the sum of weights

  // Room for sets of up to max_entries from frames of up to max_photons without allocation.
  NearSet(std::size_t max_photons, std::size_t max_entries);
  // windows: one for each stretch of the train.
  //
  // gather_width_ns: a pulse width, or 0. Where very many photons are near, each of them to one
  // pulse at most and all pulses of one amplitude, those are put together that lie within an eighth
  // of the width of one another and a 32nd of the frame, at their mean. What the likelihood loses
  // is 0.1 % of its information at most: the spread inside such a cell, (1/8)^2 / 12 of the
  // pulse's.
  void collect(const FoldedFrame& frame, std::span<const CombWindow> windows,
               const PulseTrain& train, DelayLine about, double gather_width_ns = 0);
  [[nodiscard]] std::size_t photons() const { return first.size() - 1; }
  [[nodiscard]] std::size_t entries() const { return residual_ns.size(); }

 private:
  // The cells that photons are gathered in: rows along the frame, columns across the window.
  struct Cells {
    double first_ns, last_ns;  // the window
    double per_ns;             // columns
    std::size_t columns;
    double rows_per_ns;
  };
  [[nodiscard]] std::size_t pick_groups(const FoldedFrame& frame,
                                        std::span<const CombWindow> windows,
                                        const PulseTrain& train);
  template <class Add>
  void visit_near(const FoldedFrame& frame, std::span<const CombWindow> windows,
                  const PulseTrain& train, const Add& add) const;
  template <class Add>
  void visit_group(const FoldedFrame& frame, std::size_t group, const CombWindow& window,
                   const PulseTrain::Stretch& stretch, const Add& add) const;
  template <class Add>
  void visit_between(const FoldedFrame& frame, std::span<const CombWindow> windows,
                     const PulseTrain& train, const Add& add) const;
  void add_photon(const FoldedFrame& frame, std::size_t photon, double phase_ns,
                  std::span<const CombWindow::Pulse> pulses, const CombWindow& window);
  void add_to_cell(const FoldedFrame& frame, std::size_t photon, double residual_ns,
                   const Cells& cells);
  void take_cells(double amplitude);

  struct Cell {
    double weight = 0, residual = 0, position = 0;  // sums
  };
  std::vector<std::uint32_t> phase_32_, picked_;  // scratch: one a photon of the frame
  std::vector<std::size_t> picks_;                // scratch: picked photons of each stretch
  std::vector<Cell> cells_;                       // scratch of gathering
};

}  // namespace splid
