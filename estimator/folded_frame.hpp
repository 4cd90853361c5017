#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/comb.hpp"
#include "estimator/frame.hpp"

namespace splid {

// A frame's photons in the pattern's own clock: relative to mid-frame, and folded on the pattern
// period. All times here are ns of the calibrated pattern; `scale` turns them into the tagger's.
//
// A target that moves at v = c g / (2 - g) with delay D = tau / (1 + v/c) at mid-frame has its
// photons at phase = D + g time (+ pulse time), a straight line: [P] Eq. 1 solved for the emission
// time, (t - tau / (1 - beta)) (1 - beta) / (1 + beta) = t - D - g t, g = 2 beta / (1 + beta).
//
// Design note: g is kept, never 1 - g: at v = 10 nm/s g is 6.7e-17, which 1 - g would lose.
struct FoldedFrame {
  std::vector<double> phase_ns;                    // in [0, period)
  std::vector<double> time_ns;                     // from mid-frame, in [-length / 2, length / 2]
  std::vector<std::uint32_t> phase_32;             // phase in 2^-32 of a period: wraps by itself
  double length_ns = 0;                            // t_a
  double seen_ns = 0;                              // t_a less losses, in the tagger's clock
  double scale = 1;                                // measured over calibrated period
  std::vector<double> lost_begin_ns, lost_end_ns;  // losses, from mid-frame

  // Room for max_photons without allocation.
  explicit FoldedFrame(std::size_t max_photons);
  // The frame must be locked to its syncs.
  void fold(const FrameView& frame, double period_ns);
  [[nodiscard]] std::size_t size() const { return phase_ns.size(); }
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
  std::size_t far_photons = 0;       // those with no entry

  // Room for sets of up to max_entries from frames of up to max_photons without allocation.
  NearSet(std::size_t max_photons, std::size_t max_entries);
  void collect(const FoldedFrame& frame, const CombWindow& window, double period_ns,
               DelayLine about);
  [[nodiscard]] std::size_t photons() const { return first.size() - 1; }
  [[nodiscard]] std::size_t entries() const { return residual_ns.size(); }

 private:
  void add_photon(const FoldedFrame& frame, std::size_t photon, double phase_ns,
                  std::span<const CombWindow::Pulse> pulses, const CombWindow& window);

  std::vector<std::uint32_t> phase_32_, picked_;  // scratch: one a photon of the frame
};

}  // namespace splid
