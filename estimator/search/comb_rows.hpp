#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/fold/folded_frame.hpp"
#include "estimator/fold/search_kernels.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid {

// How finely a frame is cut for one search: delay bins by slices of time.
struct SearchGrid {
  std::uint32_t bins = 1;    // delay bins in the train's circle
  std::uint32_t slices = 1;  // a power of two; 1 for a target at rest
  double bin_ns = 0;

  // The grid for a circle of delays. bin_ns: the widest bins wanted. max_walk_ns: the largest
  // |g t_a| over a frame, 0 for a target at rest. multiple_of: a good divisor of `bins`, which is
  // kept to where this costs no more than half as many bins again.
  static SearchGrid cover(double circle_ns, double bin_ns, double max_walk_ns,
                          std::uint32_t multiple_of = 1);
  [[nodiscard]] std::size_t cells() const { return std::size_t{bins} * slices; }
};

// Correlates slices of a frame with the pulse train: bin d of row s counts the photons of slice s
// that a target with the delay of bin d explains. Amplitudes do not count.
//
// Of a comb that is made of periodic parts (interleaved, or a segment of MRR) a photon is counted
// once for each part, in a row of one period of it, copies of which make the whole row. With other
// combs it is counted once for each pulse, or rows are shifted and added, whichever is less work.
class CombRows {
 public:
  CombRows(const PulseTrain& train, std::size_t max_photons, const SearchKernels& kernels);

  // A number of bins in the circle with which, and with its multiples, parts have whole periods.
  [[nodiscard]] std::uint32_t fitting_bins() const;

  // Cuts a frame into slices, and moves its photons back along lines of this range walk.
  void load(const FoldedFrame& frame, double walk_ns, std::uint32_t slices);

  // The most photons that a cell can hold once the rows are filled.
  [[nodiscard]] double most_in_slice(double bin_ns) const;

  // Fills grid.slices rows of grid.bins. histogram and period are scratch of the same size. Count
  // is unsigned, of 8, 16 or 32 bits, and holds most_in_slice().
  template <class Count>
  void fill(const SearchGrid& grid, Count* rows, Count* histogram, Count* period);

  // Of a comb that is made of periodic parts, how many periods of each part the circle has; empty
  // where it is made of less than two.
  [[nodiscard]] std::span<const std::uint32_t> part_copies() const { return part_copies_; }
  // How many bins one period of each part has. Rows of the circle are then the sum of those that
  // fill_period() fills, side by side, but that photons at pulses of two parts count twice.
  // Empty where the comb has no such parts. Valid until the next call.
  [[nodiscard]] std::span<const std::uint32_t> part_bins(const SearchGrid& grid);
  // Fills grid.slices rows of one period of a part that has one pulse, of a single segment.
  template <class Count>
  void fill_period(const SearchGrid& grid, std::size_t part, Count* rows);

 private:
  struct Part {
    std::uint32_t turns = 1;   // periods of the part in the period of its comb
    std::uint32_t copies = 1;  // periods of the part in the circle
    bool taken_off = false;    // subtracted: its pulses are in two other parts, so they count twice
    std::vector<std::uint32_t> pulses_32;  // in 2^-32 of the part's period
    std::vector<std::uint32_t> circle_32;  // every copy of every pulse, in 2^-32 of the circle
  };

  // A photon's phase in its comb's period, times `turns` and over `copies`, is that in its row,
  // which has so many bins: one period of a part, or the circle.
  struct RowScale {
    std::uint32_t turns, copies, bins;
  };
  void count_in_slices(std::uint32_t slices);
  static std::vector<Part> parts_of(const PulseTrain::Segment& segment);
  [[nodiscard]] static bool fits_in_bins(const SearchGrid& grid, std::uint32_t copies);
  template <class Count>
  void fill_period(const SearchGrid& grid, std::size_t group, const Part& part, Count* rows,
                   Count* histogram);
  template <class Count>
  void fill_part(const SearchGrid& grid, std::size_t group, const Part& part, Count* rows,
                 Count* histogram);
  template <class Count>
  void count_photons(std::size_t group, const RowScale& scale,
                     std::span<const std::uint32_t> pulses, Count one, Count* rows) const;
  template <class Count>
  void add_shifted_rows(const Count* histogram, std::span<const std::uint32_t> pulses,
                        std::uint32_t bins, std::size_t slices, Count* rows) const;
  template <class Count>
  void count_between(const SearchGrid& grid, Count* rows);

  const PulseTrain& train_;
  const SearchKernels& kernels_;
  std::vector<std::vector<Part>> parts_;  // of each segment
  const FoldedFrame* frame_ = nullptr;
  double slope_ = 0;  // of the lines that the photons were moved back along
  const std::uint32_t* phase_32_ = nullptr;
  std::vector<std::uint32_t> moved_;  // scratch: the phase of each photon
  std::vector<std::uint32_t> slice_;  // of each photon
  std::vector<std::uint32_t> part_copies_, part_bins_;
  std::vector<std::uint32_t> in_slice_;  // number of photons in each slice
};

}  // namespace splid
