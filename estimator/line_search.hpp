#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/comb.hpp"
#include "estimator/folded_frame.hpp"
#include "protocol/vector_level.hpp"

namespace splid {

// A cell of the search plane: photons that lie along one line, one delay bin wide.
struct SearchCell {
  DelayLine line;
  std::uint32_t count = 0;
};

// How finely a frame is cut for one search.
struct SearchGrid {
  std::uint32_t bins = 1;    // delay bins in a pattern period
  std::uint32_t slices = 1;  // power of two; 1: the target does not move
  double bin_ns = 0;

  // bin_ns: the widest wanted; max_drift_ns: largest |g t_a| over a frame, 0 for a target at rest.
  static SearchGrid cover(double period_ns, double bin_ns, double max_drift_ns);
  [[nodiscard]] std::size_t cells() const { return std::size_t{bins} * slices; }
};

// Searches all delays and all drifts up to the grid's limit at once: the frame is cut into slices
// so short that the fastest target moves one bin in each, every slice's photons are correlated with
// the pulse comb, and a Taylor tree adds the slices along all straight lines, log2(slices) passes
// of plain additions (Taylor 1974, for pulsar de-dispersion).
//
// Cost: photons * pulses (or slices * bins * pulses / 16, if less) + 2 bins * slices *
// log2(slices). Threads: one an object. No allocation in run().
class LineSearch {
 public:
  static constexpr std::size_t max_cells = 8;

  // max_grid_cells: of the finest grid that run() will be given.
  LineSearch(const Comb& comb, std::size_t max_photons, std::size_t max_grid_cells,
             VectorLevel level = best_vector_level());

  // The best cells, most photons first, none in the bow tie that a better one's
  // photons make. Lines with |drift|
  // above max_drift_ns (and a bin) are left out. Valid until the next run.
  std::span<const SearchCell> run(const FoldedFrame& frame, const SearchGrid& grid,
                                  double max_drift_ns);

  // The best delay for a known drift, at the grid's bins: a look at all delays at once, for
  // patterns whose combs partly fit themselves at other delays (interleaved ones fit by half).
  SearchCell best_delay(const FoldedFrame& frame, double drift_ns, std::uint32_t bins);

 private:
  template <class Count>
  void search(const FoldedFrame& frame, const SearchGrid& grid, double max_drift_ns);
  template <class Count>
  void fill_by_photon(const FoldedFrame& frame, const SearchGrid& grid, Count* rows);
  template <class Count>
  void fill_by_row(const FoldedFrame& frame, const SearchGrid& grid, Count* rows);
  template <class Count>
  void keep_best(const Count* row, const SearchGrid& grid, int drift_bins);
  void keep(const SearchCell& cell, double bin_ns);
  template <class Count>
  Count* buffer(std::size_t which);

  const Comb& comb_;
  VectorLevel level_;
  std::size_t max_grid_cells_;
  std::vector<std::uint32_t> pulses_32_;  // in 2^-32 of a period
  std::vector<std::uint32_t> cells_;      // scratch: one a pulse
  std::vector<std::uint32_t> phases_;     // scratch: one a photon
  std::vector<std::uint32_t> memory_;     // three buffers of max_grid_cells_
  std::vector<SearchCell> best_;
};

}  // namespace splid
