#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/fold/search_kernels.hpp"
#include "estimator/search/comb_rows.hpp"
#include "estimator/search/taylor_tree.hpp"

namespace splid {

// The lines of a comb that is made of periodic parts, as interleaved combs are. A line of the
// circle holds the sum of what the lines of all parts hold at its delay, modulo the period of each
// part. So the slices of each part are added up over one of its periods, which is a twentieth of
// the circle for [P]'s pattern. A line of the circle is only looked at where the largest sums of
// the other parts would let it hold enough.
class PartLines {
 public:
  // grids: all that add_up() will be given. copies: how many periods of each part the circle has.
  PartLines(const SearchKernels& kernels, std::span<const SearchGrid> grids,
            std::span<const std::uint32_t> copies);
  // What lines for these grids allocate.
  static std::size_t bytes(std::span<const SearchGrid> grids,
                           std::span<const std::uint32_t> copies);

  void clear() { parts_.clear(); }
  // Adds up the slices of one more part: rows of one of its periods, of so many bins. The other
  // arguments are those of TaylorTree.
  template <class Count>
  void add_up(const Count* rows, const SearchGrid& grid, std::uint32_t bins, std::size_t most,
              int sign);

  // Looks at all lines of this range walk.
  void look_at(std::size_t walk);
  // Calls keep(bin, photons) for each line that holds more than least() photons. least() may grow
  // from call to call. bins: of the circle.
  //
  // For each bin of the first part's period that may do, all its copies around the circle. Where
  // these are in the periods of the other parts is counted on, since a division takes longer than
  // all else.
  template <class Least, class Keep>
  void visit_above(std::size_t bins, const Least& least, const Keep& keep) const {
    const Part& first = parts_.front();
    const std::span<const Part> others = std::span(parts_).subspan(1);
    for (std::size_t bin = next(0, least()); bin < first.bins; bin = next(bin + 1, least())) {
      for (std::size_t k = 0; k < others.size(); ++k) places_[k] = bin % others[k].bins;
      for (std::size_t copy = bin; copy < bins; copy += first.bins) {
        std::uint32_t held = first.line[bin];
        for (std::size_t k = 0; k < others.size(); ++k) {
          held += others[k].line[places_[k]];
          places_[k] += others[k].step;
          if (places_[k] >= others[k].bins) places_[k] -= others[k].bins;
        }
        if (held > least()) keep(copy, held);
      }
    }
  }

 private:
  struct Part {
    std::size_t bins;           // of its period
    std::size_t step;           // of these, that a period of the first part is longer than its own
    std::uint32_t* line;        // sums of the range walk that is looked at
    std::uint32_t largest = 0;  // of these
  };
  [[nodiscard]] std::size_t next(std::size_t from, std::uint32_t least) const;

  const SearchKernels& kernels_;
  std::size_t longest_ = 0;  // cells of a part's line
  std::vector<TaylorTree> trees_;
  std::vector<std::uint32_t> memory_;  // a line of each part, and one of zeros
  std::vector<Part> parts_;
  mutable std::vector<std::size_t> places_;  // scratch: a bin of each other part
};

}  // namespace splid
