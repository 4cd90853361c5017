#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/fold/folded_frame.hpp"
#include "estimator/fold/search_kernels.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid {

// How finely a frame is cut for one search.
struct SearchGrid {
  std::uint32_t bins = 1;    // delay bins in the train's circle
  std::uint32_t slices = 1;  // power of two; 1: the target does not move
  double bin_ns = 0;

  // bin_ns: the widest wanted; max_travel_ns: largest |g t_a| over a frame, 0 for a target at rest;
  // multiple_of: what would be a good divisor of `bins`, kept where it costs no more than half as
  // many bins again.
  static SearchGrid cover(double circle_ns, double bin_ns, double max_travel_ns,
                          std::uint32_t multiple_of = 1);
  [[nodiscard]] std::size_t cells() const { return std::size_t{bins} * slices; }
};

// Correlates slices of a frame with the pulse train: row s, bin d counts the photons of slice s
// that a target with the delay of bin d explains. Amplitudes are not looked at.
//
// A comb is taken apart into periodic parts where it is made of such (interleaved ones are, and
// each stretch of MRR trains): a photon is then counted once a part, in a row of one of the part's
// periods, which is laid side by side afterwards. Other combs count it at each pulse, or their rows
// are shifted and added, whichever is less work.
//
// Threads: one an object (scratch). No allocation after construction.
class CombRows {
 public:
  CombRows(const PulseTrain& train, std::size_t max_photons, const SearchKernels& kernels);

  // Bins in the circle of which this many, or a multiple, fit all periodic parts.
  [[nodiscard]] std::uint32_t fitting_bins() const;

  // Takes a frame cut into slices, its photons moved back along lines of this travel.
  void load(const FoldedFrame& frame, double travel_ns, std::uint32_t slices);

  // The most photons that a cell can hold once filled, in one slice and in all together.
  [[nodiscard]] double most_in_slice(double bin_ns) const;
  [[nodiscard]] double most_in_frame(double bin_ns) const;

  // Fills grid.slices rows of grid.bins; histogram and parts are scratch of the same size. Count:
  // std::uint16_t, if most_in_slice() is below 65536, or std::uint32_t.
  template <class Count>
  void fill(const SearchGrid& grid, Count* rows, Count* histogram, Count* parts);

 private:
  struct Part {
    std::uint32_t turns = 1;               // of the part in its comb's period
    std::uint32_t copies = 1;              // of the part in the circle
    bool taken_off = false;                // pulses that two other parts have both counted
    std::vector<std::uint32_t> pulses_32;  // in 2^-32 of the part's period
    std::vector<std::uint32_t> circle_32;  // every copy of every pulse, in 2^-32 of the circle
  };

  static Part whole_part(const PulseTrain::Stretch& stretch);
  static std::vector<Part> parts_of(const PulseTrain::Stretch& stretch);
  template <class Count>
  void fill_part(const SearchGrid& grid, std::size_t group, const Part& part, Count* rows,
                 Count* histogram, Count* parts);
  template <class Count>
  void count_at_pulses(std::size_t group, const Part& part, bool fits, std::uint32_t bins,
                       Count* rows);
  template <class Count>
  void add_shifted_rows(const SearchGrid& grid, std::size_t group, const Part& part, bool fits,
                        std::uint32_t bins, Count* rows, Count* histogram);
  template <class Count>
  void count_between(const SearchGrid& grid, Count* rows);

  const PulseTrain& train_;
  const SearchKernels& kernels_;
  std::vector<std::vector<Part>> parts_;  // of each stretch
  const FoldedFrame* frame_ = nullptr;
  double slope_ = 0;  // of the lines that photons were moved back along
  const std::uint32_t* phase_32_ = nullptr;
  std::vector<std::uint32_t> moved_;     // scratch: phases, one a photon
  std::vector<std::uint32_t> slice_;     // one a photon
  std::vector<std::uint32_t> in_slice_;  // photons
  std::vector<std::uint32_t> cells_;     // scratch: one a pulse
};

}  // namespace splid
