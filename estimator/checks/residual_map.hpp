#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/fold/folded_frame.hpp"
#include "estimator/likelihood/model.hpp"
#include "estimator/model/comb.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"

// Residual maps, and the findings that they show. Open finding.hpp first: its table has one row for
// each finding. Then:
//   residual_map.hpp  the photons of a frame about a fitted track
//   seen_light.hpp    how much of them the detector could see
//   pulse_table.hpp   the configured pulse, to expect them by
//   map_fit.hpp       the richer models of the table, fitted to a map
//   findings.hpp      which findings are sure in a frame, and what follows from them
//   finding_sums.hpp  the same over many frames

namespace splid::checks {

inline constexpr std::size_t map_parts = 32;  // of the frame
inline constexpr std::size_t most_cells = 32;
// A pattern of fewer pulses may find other light for each of them.
inline constexpr std::size_t fewest_pulses = 8;

// Counts of a frame's photons about the pulses of a fitted track: by offset and part of the frame,
// by pulse, and by phase of the pattern period outside of the pulses.
//
// The offsets reach to 16 widths on both sides of the pulse's peak, or to where the next pulse is
// nearer. Cells are half a width long up to 4.5 widths from the peak, then one width up to 8.5,
// then 2.5 widths: there is nothing but flat light and tails. A photon is in one cell at most.
class ResidualMap {
 public:
  ResidualMap(const PulseTrain& train, const PulseShape& shape, std::size_t max_photons);
  void fill(const FoldedFrame& frame, const DelayTrack& track);

  // False where pulses are too close to each other for a map.
  [[nodiscard]] bool looks() const { return cells_ > 0; }
  [[nodiscard]] std::size_t cells() const { return cells_; }
  [[nodiscard]] double edge_ns(std::size_t cell) const {  // where it begins; cell <= cells()
    return edges_ns_[cell];
  }
  [[nodiscard]] double cell_ns(std::size_t cell) const {
    return edges_ns_[cell + 1] - edges_ns_[cell];
  }
  [[nodiscard]] double reach_ns() const { return static_cast<double>(steps_) * step_ns_ / 2; }
  // Photons by cell; the cells of one part of the frame.
  [[nodiscard]] std::span<const double> part(std::size_t part) const {
    return std::span(counts_).subspan(part * most_cells, cells_);
  }
  [[nodiscard]] double elsewhere() const { return elsewhere_; }  // photons outside of the map
  // Photons within two widths of each pulse's peak, of a train of a single segment; else empty.
  [[nodiscard]] std::span<const double> by_pulse() const { return by_pulse_; }
  [[nodiscard]] double peak_ns() const { return peak_ns_; }
  // After which offset a pulse's first photons come.
  [[nodiscard]] double first_light_ns() const { return peak_ns_ - 2 * half_pulse_ns_; }
  // Of each photon of the segments: when it left, in 2^-32 of the comb's period, were the target at
  // delay 0 and at rest.
  [[nodiscard]] std::span<const std::uint32_t> phases_32() const { return phases_32_; }
  // Photons by phase, in bins of some eight widths, and which bins no pulse reaches (1). Empty for
  // trains of several segments.
  [[nodiscard]] std::span<const std::uint32_t> by_phase() const { return by_phase_; }
  [[nodiscard]] std::span<const std::uint8_t> is_free() const { return is_free_; }

 private:
  void add_cells();
  void add_phases(const PulseShape& shape);
  void fill_segment(const FoldedFrame& frame, const DelayTrack& track, std::size_t s);
  void fill_between(const FoldedFrame& frame, const DelayTrack& track);
  void count(double phase_ns, double share, const CombWindow& window, std::uint32_t phase_32);

  const PulseTrain& train_;
  double step_ns_, first_ns_ = 0, peak_ns_, half_pulse_ns_;  // steps of half a width
  std::size_t cells_ = 0, steps_ = 0;
  std::vector<double> edges_ns_;
  std::array<std::uint8_t, 64> cell_of_step_{};
  std::vector<CombWindow> windows_;
  std::vector<double> counts_, by_pulse_;
  std::vector<std::uint32_t> by_phase_;
  std::vector<std::uint8_t> is_free_;
  std::vector<std::uint32_t> phases_32_, picked_;  // one a photon; picked_ is scratch
  int phase_shift_ = 0;
  double elsewhere_ = 0, near_ = 0;
};

}  // namespace splid::checks
