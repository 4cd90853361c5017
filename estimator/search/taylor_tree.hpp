#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/fold/search_kernels.hpp"
#include "estimator/search/comb_rows.hpp"

namespace splid {

// Adds the slices of a frame along all straight lines that start in a block of delay bins and
// range walk 0, 1, ... `most` bins from the first slice to the last, in log2(slices) passes of
// plain additions. Source: Taylor 1974, for the de-dispersion of pulsars.
//
// Design note: memory bounds the additions. Sums are kept in bytes while the largest allows it,
// then in 16 and 32 bits; two passes are made at once where sums of four cells fit; the first reads
// the slices' rows where they are, and the last is compared while it is added: all lines of 3,780
// bins in 64 slices take 0.10 ms (bench/frame_parts, random pattern). Where lines go around the
// circle often, as 3,336 bins around 840 in 15 s at 150 m/s, a row holds the circle twice.
class TaylorTree {
 public:
  // grids: all that add_up() will be given.
  TaylorTree(const SearchKernels& kernels, std::span<const SearchGrid> grids);
  // What a tree for these grids allocates.
  static std::size_t bytes(std::span<const SearchGrid> grids);

  // How many delay bins a block has, for lines of up to `most` bins of range walk.
  static std::size_t block_bins(const SearchGrid& grid, std::size_t most);

  // Some bins of a circle, and how far the lines that start in them range walk.
  struct Block {
    std::size_t first_bin = 0;
    std::size_t bins = 0;  // up to block_bins()
    std::size_t most = 0;  // bins of range walk, below the number of slices
    int sign = 1;          // -1: the slices are taken in the other order
  };
  // rows: grid.slices rows of grid.bins. Count: unsigned, of 8, 16 or 32 bits.
  template <class Count>
  void add_up(const Count* rows, const SearchGrid& grid, const Block& block);

  // The first bin of the block, not before `from`, whose line of this range walk holds more than
  // `least` photons; the number of the block's bins where there is none.
  [[nodiscard]] std::size_t first_above(std::size_t walk, std::size_t from,
                                        std::uint32_t least) const;
  // Writes the photons of the lines of this range walk, one number for each bin of the block.
  void write_line(std::size_t walk, std::uint32_t* line) const;
  // How many photons a line holds.
  [[nodiscard]] std::uint32_t photons(std::size_t walk, std::size_t bin) const;

 private:
  // Two rows whose sum is a line.
  template <class Count>
  struct Halves {
    const Count* first;
    const Count* second;
  };
  template <class Count>
  [[nodiscard]] Halves<Count> halves(std::size_t walk) const;
  template <class Visit>
  auto with_halves(std::size_t walk, const Visit& visit) const;
  // How many sums of a row are made, and where a row is read that a line comes to after so many
  // bins.
  [[nodiscard]] std::size_t sums() const { return circle_ > 0 ? circle_ : stride_; }
  [[nodiscard]] std::size_t further(std::size_t bins) const {
    return circle_ > 0 ? bins % circle_ : bins;
  }
  // The number of different range walks that lines over so many slices have.
  [[nodiscard]] std::size_t lines(std::size_t slices) const;
  // Rows of cells, one after the other.
  struct Rows {
    const void* first;
    std::ptrdiff_t step;  // cells from a row to the next
  };
  template <class Count>
  [[nodiscard]] Rows start_of(const Count* rows, const SearchGrid& grid);
  [[nodiscard]] Rows written() const;
  template <class Count>
  [[nodiscard]] const Count* row(std::size_t number) const;
  template <class Count>
  void copy_rows(const Count* rows, const SearchGrid& grid);
  std::size_t add_next(std::size_t half);
  template <class From, class Wide>
  std::size_t add_next_as(std::size_t half);
  template <class From, class To>
  void add_pairs(std::size_t half);
  template <class Count>
  void add_fours(std::size_t half);
  void take_written(std::size_t cell_bytes, std::uint32_t added);
  void make_room_for_last_sum();
  template <class From, class To>
  void widen();
  template <class Count>
  [[nodiscard]] bool sum_fits(std::uint32_t added, std::size_t half);

  const SearchKernels& kernels_;
  std::size_t buffer_cells_ = 0;
  std::vector<std::uint32_t> memory_;  // two buffers of a block's lines
  std::vector<std::uint32_t> zeros_;   // a row: what the only slice of a frame is added to
  Block block_;
  std::size_t slices_ = 1;
  std::size_t circle_ = 0;          // bins of the circle where rows go around it; else 0
  std::size_t width_ = 0;           // cells of a row that are read
  std::size_t stride_ = 0;          // cells from a row to the next in in_ and out_
  Rows from_ = {};                  // what is added up next
  std::size_t cell_bytes_ = 1;      // of its cells
  std::uint32_t most_in_cell_ = 0;  // that one of them may hold
  std::uint32_t* in_ = nullptr;     // the lines over half of the slices, once all are added up
  std::uint32_t* out_ = nullptr;
};

}  // namespace splid
