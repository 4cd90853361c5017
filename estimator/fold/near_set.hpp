#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/fold/delay_track.hpp"
#include "estimator/fold/folded_frame.hpp"
#include "estimator/model/comb.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid {

// The photons near the pulses of a line, as the likelihood needs them: one entry for each pair of a
// photon and a pulse whose residual lies in the window. Photons without an entry are too far from
// every pulse, and are background to the likelihood.
struct NearSet {
  DelayTrack track;                  // that the residuals are taken from
  std::vector<double> residual_ns;   // of each entry: emission time less pulse time
  std::vector<double> position;      // time / t_a, in [-1/2, 1/2]
  std::vector<double> amplitude;     // a_p
  std::vector<std::uint32_t> first;  // entries of photon k are [first[k], first[k + 1])
  std::vector<double> weight;        // photons that photon k stands for: 1, unless gathered
  std::size_t likely_near = 0;       // photons that seemed to be near at a first look
  bool gathers = false;              // whether the photons have been gathered
  // Which photon of the frame photon k is, ascending; empty unless the set notes them.
  std::vector<std::uint32_t> index;

  // Makes room for sets of up to max_entries from frames of up to max_photons, for which collect()
  // then allocates nothing. notes_index: whether `index` is filled, for which photons must not be
  // gathered.
  NearSet(std::size_t max_photons, std::size_t max_entries, bool notes_index = false);
  // Takes the photons near the track `about`. windows: how near, for each segment of the train.
  //
  // gather_width_ns: a pulse width, or 0. From gather_from near photons on, where each is near one
  // pulse at most and all pulses have the same amplitude, those in a cell of an eighth of the width
  // and a 32nd of the frame become one photon of their weight, at their mean. The spread inside a
  // cell, (1/8)^2 / 12 of the pulse's variance, costs 0.1 % of the information at most.
  void collect(const FoldedFrame& frame, std::span<const CombWindow> windows,
               const PulseTrain& train, const DelayTrack& about, double gather_width_ns = 0,
               std::size_t gather_from = gathered_from);
  // Design note: one evaluation of the likelihood of 16,384 entries takes a third of a millisecond,
  // which is worth the work of gathering them. On the way to a maximum, where a thousandth of a
  // deviation does not matter, gathering is worth it from a quarter of that on.
  static constexpr double cells_a_width = 8;
  static constexpr std::size_t gathered_from = 16384;
  static constexpr std::size_t gathered_roughly_from = 4096;
  // Moves the photons back by a track's quadratic term.
  void straighten(double quadratic_ns);
  // What has passed at the photons, for HiddenLight: sums over the frame that was collected last.
  struct Passed {
    double amplitude = 0;  // of the pulses whose windows lie before the photon, in the circle
                           // of its comb, less what the comb has on average up to there
    double amplitude_per_ns = 0;  // of the comb
  };
  // The arguments are those of the last collect(). Pulses whose windows hold the photon are not
  // among those that have passed.
  [[nodiscard]] Passed passed(const FoldedFrame& frame, std::span<const CombWindow> windows,
                              const PulseTrain& train) const;
  [[nodiscard]] std::size_t photons() const { return first.size() - 1; }
  [[nodiscard]] std::size_t entries() const { return residual_ns.size(); }

 private:
  struct Curve;
  [[nodiscard]] std::size_t pick_groups(const FoldedFrame& frame,
                                        std::span<const CombWindow> windows,
                                        const PulseTrain& train);
  template <class Add>
  void visit_near(const FoldedFrame& frame, std::span<const CombWindow> windows,
                  const PulseTrain& train, const Add& add) const;
  template <class Add>
  void visit_between(const FoldedFrame& frame, std::span<const CombWindow> windows,
                     const PulseTrain& train, const Add& add) const;
  void take_photons(const FoldedFrame& frame, std::span<const CombWindow> windows,
                    const PulseTrain& train);
  void gather_photons(const FoldedFrame& frame, std::span<const CombWindow> windows,
                      const PulseTrain& train, double width_ns);

  struct Cell {
    double weight = 0, residual = 0, position = 0;  // sums
  };
  bool notes_index_;
  double beyond_ = 0;  // amplitude of the candidates whose windows lie before their photons
  std::vector<std::uint32_t> phase_32_, picked_;  // scratch: one a photon of the frame
  std::vector<std::size_t> picks_;                // scratch: picked photons of each segment
  std::vector<Cell> cells_;                       // scratch of gathering
};

}  // namespace splid
