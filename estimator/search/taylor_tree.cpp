#include "estimator/search/taylor_tree.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <memory>
#include <type_traits>
#include <utility>

#include "estimator/fold/kernel_choice.hpp"

namespace splid {
namespace {

// Design note: the tree works on blocks of delay bins that are so small that all lines of a block
// stay in the second-level cache (two times 256 KiB of bytes, or 512 KiB of 16-bit sums). Each
// block looks at as many bins more as the delay of the fastest target walks. Over the whole
// circle at once, a search of 15,120 bins in 256 slices takes three times as long.
constexpr std::size_t block_lines_cells = std::size_t{1} << 18;
constexpr std::size_t least_block_bins = 256;

// Rows are so many cells long, or a multiple, so that no vector is cut off. What is added beyond a
// row's bins is never looked at. They begin at a multiple of so many bytes, so that a vector of a
// row is in one line of the cache: each pass then takes two thirds of the time.
constexpr std::size_t row_cells = 64;

std::size_t stride_of(std::size_t bins) { return (bins + row_cells - 1) / row_cells * row_cells; }

// The first pass reads a row of one slice up to so many bins further on.
constexpr std::size_t longest_shift = 3;

// Rows that hold the circle twice, and so many bins more, have all that a sum reads, however often
// a line goes around.
std::size_t cells_around(const SearchGrid& grid) {
  return 2 * std::size_t{grid.bins} + longest_shift;
}

template <class From, class To>
auto add_of(const SearchKernels& kernels) {
  if constexpr (std::is_same_v<From, To>) {
    return of<From>(kernels).add;
  } else if constexpr (sizeof(From) == 1) {
    return kernels.add_8_to_16;
  } else {
    return kernels.add_16_to_32;
  }
}

// Goes on around the circle, from its first `bins` cells up to `width` of them.
template <class Count>
void go_around(Count* row, std::size_t bins, std::size_t width) {
  for (std::size_t filled = bins; filled < width;) {
    const std::size_t count = std::min(filled, width - filled);
    std::memcpy(row + filled, row, count * sizeof(Count));
    filled += count;
  }
}

// Copies `width` bins of a row from first_bin on, going around the circle as often as that takes.
template <class Count>
void copy_around(Count* to, const Count* row, std::size_t first_bin, std::size_t width,
                 std::size_t bins) {
  std::size_t from = first_bin % bins;
  while (width > 0) {
    const std::size_t count = std::min(width, bins - from);
    std::memcpy(to, row + from, count * sizeof(Count));
    to += count;
    width -= count;
    from = 0;
  }
}

// Rows are longest for the largest limit of range walk: a block of fewer lines has at most as many
// bins more.
std::size_t longest_row(const SearchGrid& grid) {
  const std::size_t most = grid.slices - 1;
  return stride_of(std::min(TaylorTree::block_bins(grid, most) + most, cells_around(grid)));
}

std::size_t widest_row(std::span<const SearchGrid> grids) {
  std::size_t widest = 0;
  for (const SearchGrid& grid : grids) widest = std::max(widest, longest_row(grid));
  return widest;
}

std::size_t buffer_cells(std::span<const SearchGrid> grids) {
  std::size_t cells = 0;
  for (const SearchGrid& grid : grids) {
    // The last row is read beyond its end, by as much as a line walks.
    cells = std::max(cells, longest_row(grid) * grid.slices + grid.slices);
  }
  return stride_of(cells);
}

}  // namespace

std::size_t TaylorTree::block_bins(const SearchGrid& grid, std::size_t most) {
  const std::size_t fit = block_lines_cells / grid.slices;
  const std::size_t wanted =
      std::max(least_block_bins, std::max(most, fit > most ? fit - most : 0));
  return std::min<std::size_t>(wanted, grid.bins);
}

TaylorTree::TaylorTree(const SearchKernels& kernels, std::span<const SearchGrid> grids)
    : kernels_(kernels),
      buffer_cells_(buffer_cells(grids)),
      memory_(2 * buffer_cells_ + row_cells),
      zeros_(widest_row(grids)) {}

std::size_t TaylorTree::bytes(std::span<const SearchGrid> grids) {
  return (2 * buffer_cells(grids) + row_cells + widest_row(grids)) * sizeof(std::uint32_t);
}

std::size_t TaylorTree::lines(std::size_t slices) const {
  return std::min(slices, block_.most * slices / slices_ + 1);
}

template <class Count>
void TaylorTree::add_up(const Count* rows, const SearchGrid& grid, const Block& block) {
  block_ = block;
  slices_ = grid.slices;
  circle_ = block.bins + block.most > cells_around(grid) ? grid.bins : 0;
  width_ = circle_ > 0 ? cells_around(grid) : block.bins + block.most;
  stride_ = stride_of(width_);
  void* first = memory_.data();
  std::size_t bytes = memory_.size() * sizeof(std::uint32_t);
  in_ = static_cast<std::uint32_t*>(std::align(row_cells, 1, first, bytes));
  out_ = in_ + buffer_cells_;
  cell_bytes_ = sizeof(Count);
  most_in_cell_ = std::numeric_limits<Count>::max();
  from_ = start_of(rows, grid);
  std::size_t half = 1;
  while (2 * half < slices_) half *= add_next(half);
  if (slices_ > 1) make_room_for_last_sum();
}

template void TaylorTree::add_up(const std::uint8_t*, const SearchGrid&, const Block&);
template void TaylorTree::add_up(const std::uint16_t*, const SearchGrid&, const Block&);
template void TaylorTree::add_up(const std::uint32_t*, const SearchGrid&, const Block&);

// Where the first sums read the slices: in the rows themselves, unless the block goes around the
// end of the circle or nothing is added up at all.
template <class Count>
TaylorTree::Rows TaylorTree::start_of(const Count* rows, const SearchGrid& grid) {
  if (slices_ < 4 || circle_ > 0 || block_.first_bin + stride_ + longest_shift > grid.bins) {
    copy_rows(rows, grid);
    return written();
  }
  const auto bins = static_cast<std::ptrdiff_t>(grid.bins);
  const Count* first = rows + block_.first_bin;
  if (block_.sign > 0) return {first, bins};
  return {first + (static_cast<std::ptrdiff_t>(slices_) - 1) * bins, -bins};
}

TaylorTree::Rows TaylorTree::written() const { return {in_, static_cast<std::ptrdiff_t>(stride_)}; }

template <class Count>
const Count* TaylorTree::row(std::size_t number) const {
  return static_cast<const Count*>(from_.first) + static_cast<std::ptrdiff_t>(number) * from_.step;
}

template <class Count>
void TaylorTree::copy_rows(const Count* rows, const SearchGrid& grid) {
  auto* to = reinterpret_cast<Count*>(in_);
  for (std::size_t slice = 0; slice < slices_; ++slice) {
    const std::size_t from = block_.sign > 0 ? slice : slices_ - 1 - slice;
    copy_around(to + slice * stride_, rows + from * grid.bins, block_.first_bin, width_, grid.bins);
    std::fill_n(to + slice * stride_ + width_, stride_ - width_, Count{0});
  }
}

// Adds lines over `half` slices each to lines over twice or four times as many; returns which.
std::size_t TaylorTree::add_next(std::size_t half) {
  if (cell_bytes_ == 1) return add_next_as<std::uint8_t, std::uint16_t>(half);
  if (cell_bytes_ == 2) return add_next_as<std::uint16_t, std::uint32_t>(half);
  return add_next_as<std::uint32_t, std::uint32_t>(half);
}

template <class From, class Wide>
std::size_t TaylorTree::add_next_as(std::size_t half) {
  if (8 * half <= slices_ && sum_fits<From>(4, half)) {
    add_fours<From>(half);
    return 4;
  }
  if constexpr (!std::is_same_v<From, Wide>) {
    if (!sum_fits<From>(2, half)) {
      add_pairs<From, Wide>(half);
      return 2;
    }
  }
  add_pairs<From, From>(half);
  return 2;
}

// A line that walks j bins over 2n slices is made of two lines that range walk floor(j/2) bins: one
// over the first n slices, and one over the last n slices that starts ceil(j/2) bins further on.
template <class From, class To>
void TaylorTree::add_pairs(std::size_t half) {
  const auto add = add_of<From, To>(kernels_);
  auto* out = reinterpret_cast<To*>(out_);
  const std::size_t all = lines(2 * half);
  for (std::size_t group = 0; group < slices_; group += 2 * half) {
    for (std::size_t j = 0; j < all; ++j) {
      To* sum = out + (group + j) * stride_;
      add(sum, row<From>(group + j / 2), row<From>(group + half + j / 2) + further((j + 1) / 2),
          sums());
      if (circle_ > 0) go_around(sum, circle_, width_);
    }
  }
  take_written(sizeof(To), 2);
}

// The same for two passes at once. A row that the lines share is read for four of them: up to three
// of those may not be asked for, and have room.
template <class Count>
void TaylorTree::add_fours(std::size_t half) {
  const auto add = of<Count>(kernels_).add_four;
  auto* out = reinterpret_cast<Count*>(out_);
  const std::size_t all = lines(4 * half);
  for (std::size_t group = 0; group < slices_; group += 4 * half) {
    for (std::size_t j = 0; j < all; j += 4) {
      const std::size_t n = j / 4;  // the bins that each quarter of the lines walks
      const std::size_t first = group + n;
      Count* four = out + (group + j) * stride_;
      add(four, stride_, row<Count>(first), row<Count>(first + half) + further(n),
          row<Count>(first + 2 * half) + further(2 * n),
          row<Count>(first + 3 * half) + further(3 * n), sums());
      if (circle_ == 0) continue;
      for (int line = 0; line < 4; ++line, four += stride_) go_around(four, circle_, width_);
    }
  }
  take_written(sizeof(Count), 4);
}

// The sums that have been written, of so many cells each, are what is added up next.
void TaylorTree::take_written(std::size_t cell_bytes, std::uint32_t added) {
  std::swap(in_, out_);
  from_ = written();
  cell_bytes_ = cell_bytes;
  most_in_cell_ *= added;
}

// Whether the sum of any `added` cells fits into the type of the cells, which are lines over `half`
// slices.
template <class Count>
bool TaylorTree::sum_fits(std::uint32_t added, std::size_t half) {
  if constexpr (sizeof(Count) == sizeof(std::uint32_t)) {
    return true;
  } else {
    const std::uint32_t most = std::numeric_limits<Count>::max() / added;
    if (most_in_cell_ <= most) return true;
    most_in_cell_ = 0;
    const std::size_t all = lines(half);
    for (std::size_t group = 0; group < slices_; group += half) {
      for (std::size_t j = 0; j < all; ++j) {
        const std::uint32_t here = of<Count>(kernels_).largest(row<Count>(group + j), sums());
        most_in_cell_ = std::max(most_in_cell_, here);
      }
    }
    return most_in_cell_ <= most;
  }
}

void TaylorTree::make_room_for_last_sum() {
  const std::size_t half = slices_ / 2;
  if (cell_bytes_ == 1 && !sum_fits<std::uint8_t>(2, half)) {
    widen<std::uint8_t, std::uint16_t>();
  }
  if (cell_bytes_ == 2 && !sum_fits<std::uint16_t>(2, half)) {
    widen<std::uint16_t, std::uint32_t>();
  }
}

template <class From, class To>
void TaylorTree::widen() {
  const auto add = add_of<From, To>(kernels_);
  const auto* in = reinterpret_cast<const From*>(in_);
  auto* out = reinterpret_cast<To*>(out_);
  const auto* zeros = reinterpret_cast<const From*>(zeros_.data());
  for (const std::size_t group : {std::size_t{0}, slices_ / 2}) {
    for (std::size_t row = group; row < group + lines(slices_ / 2); ++row) {
      add(out + row * stride_, in + row * stride_, zeros, stride_);
    }
  }
  take_written(sizeof(To), 1);
}

template <class Count>
TaylorTree::Halves<Count> TaylorTree::halves(std::size_t walk) const {
  const auto* in = reinterpret_cast<const Count*>(in_);
  if (slices_ == 1) return {in, reinterpret_cast<const Count*>(zeros_.data())};
  return {in + walk / 2 * stride_,
          in + (slices_ / 2 + walk / 2) * stride_ + further((walk + 1) / 2)};
}

// Calls visit with the halves of lines, in the type of their cells.
template <class Visit>
auto TaylorTree::with_halves(std::size_t walk, const Visit& visit) const {
  if (cell_bytes_ == 1) return visit(halves<std::uint8_t>(walk));
  if (cell_bytes_ == 2) return visit(halves<std::uint16_t>(walk));
  return visit(halves<std::uint32_t>(walk));
}

std::size_t TaylorTree::first_above(std::size_t walk, std::size_t from, std::uint32_t least) const {
  return with_halves(walk, [&]<class Count>(const Halves<Count>& at) {
    if (least >= std::numeric_limits<Count>::max()) return block_.bins;
    return of<Count>(kernels_).first_above(at.first, at.second, from, block_.bins,
                                           static_cast<Count>(least));
  });
}

std::uint32_t TaylorTree::photons(std::size_t walk, std::size_t bin) const {
  return with_halves(
      walk, [bin](const auto& at) { return std::uint32_t{at.first[bin]} + at.second[bin]; });
}

void TaylorTree::write_line(std::size_t walk, std::uint32_t* line) const {
  with_halves(walk, [&](const auto& at) {
    for (std::size_t bin = 0; bin < block_.bins; ++bin) {
      line[bin] = std::uint32_t{at.first[bin]} + at.second[bin];
    }
  });
}

}  // namespace splid
