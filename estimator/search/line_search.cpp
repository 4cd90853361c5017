#include "estimator/search/line_search.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <type_traits>
#include <utility>

#include "estimator/fold/vector_level.hpp"

namespace splid {
namespace {

// Design note: the tree works on blocks of delay bins that are so small that all lines of a block
// stay in the second-level cache (two times 512 KiB of 16-bit counts). Each block looks at as many
// bins more as the delay of the fastest target travels. Over the whole circle at once, a search of
// 15,120 bins in 256 slices takes three times as long.
constexpr std::size_t block_lines_cells = std::size_t{1} << 18;
constexpr std::size_t least_block_bins = 256;

std::size_t block_bins(const SearchGrid& grid, std::size_t most) {
  const std::size_t fit = block_lines_cells / grid.slices;
  const std::size_t wanted =
      std::max(least_block_bins, std::max(most, fit > most ? fit - most : 0));
  return std::min<std::size_t>(wanted, grid.bins);
}

template <class Count>
struct Kernels;
template <>
struct Kernels<std::uint16_t> {
  static auto add(const SearchKernels& k) { return k.add; }
  static auto largest(const SearchKernels& k) { return k.largest; }
};
template <>
struct Kernels<std::uint32_t> {
  static auto add(const SearchKernels& k) { return k.add_32; }
  static auto largest(const SearchKernels& k) { return k.largest_32; }
};

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

}  // namespace

LineSearch::LineSearch(const PulseTrain& train, std::size_t max_photons,
                       std::span<const SearchGrid> grids, VectorLevel level)
    : train_(train), kernels_(search_kernels(level)), rows_(train, max_photons, kernels_) {
  for (const SearchGrid& grid : grids) {
    buffer_cells_ = std::max(buffer_cells_, grid.cells());
    // The number of lines that the largest limit of travel asks for.
    const std::size_t most = grid.slices - 1;
    for (const std::size_t lines : {most, std::size_t{0}}) {
      const std::size_t width = block_bins(grid, lines) + most;
      block_cells_ = std::max(block_cells_, width * grid.slices);
    }
  }
  memory_.resize(3 * buffer_cells_);
  block_.resize(2 * block_cells_);
  best_.reserve(max_cells + 1);
  delays_.reserve(max_delays + 1);
}

template <class Count>
Count* LineSearch::buffer(std::size_t which) {
  static_assert(std::is_same_v<Count, std::uint32_t> || std::is_same_v<Count, std::uint16_t>);
  // Both types of count use the same memory; rows are written before they are read.
  return reinterpret_cast<Count*>(memory_.data() + which * buffer_cells_);
}

std::span<const SearchCell> LineSearch::run(const FoldedFrame& frame, const SearchGrid& grid,
                                            double max_travel_ns) {
  constexpr double too_many = 65536;
  best_.clear();
  rows_.load(frame, 0, grid.slices);
  if (rows_.most_in_slice(grid.bin_ns) >= too_many) {
    rows_.fill(grid, buffer<std::uint32_t>(0), buffer<std::uint32_t>(1), buffer<std::uint32_t>(2));
    search(buffer<std::uint32_t>(0), grid, max_travel_ns);
    return best_;
  }
  auto* rows = buffer<std::uint16_t>(0);
  rows_.fill(grid, rows, buffer<std::uint16_t>(1), buffer<std::uint16_t>(2));
  double most_in_line = rows_.most_in_frame(grid.bin_ns);
  if (most_in_line >= too_many) {
    most_in_line = 0;
    for (std::size_t slice = 0; slice < grid.slices; ++slice) {
      most_in_line += kernels_.largest(rows + slice * grid.bins, grid.bins);
    }
  }
  if (most_in_line < too_many) {
    search(rows, grid, max_travel_ns);
  } else {
    auto* wide = buffer<std::uint32_t>(1);
    std::copy_n(rows, grid.cells(), wide);
    search(wide, grid, max_travel_ns);
  }
  return best_;
}

template <class Count>
void LineSearch::search(const Count* rows, const SearchGrid& grid, double max_travel_ns) {
  const auto most = static_cast<std::size_t>(
      std::min<double>(grid.slices - 1, std::ceil(max_travel_ns / grid.bin_ns)));
  const std::size_t step = block_bins(grid, most);
  for (const int sign : {1, -1}) {
    for (std::size_t bin = 0; bin < grid.bins; bin += step) {
      search_block(rows, grid, most, bin, sign);
    }
  }
}

// Adds the slices along all lines that start in the block's bins and travel 0, 1, ... `most` bins
// from the first slice to the last. For a negative sign the slices are taken in the other order.
//
// A line that travels j bins over 2n slices is made of two lines that travel floor(j/2) bins: one
// over the first n slices, and one over the last n slices that starts ceil(j/2) bins further on.
template <class Count>
void LineSearch::search_block(const Count* rows, const SearchGrid& grid, std::size_t most,
                              std::size_t first_bin, int sign) {
  const auto add = Kernels<Count>::add(kernels_);
  const std::size_t count = std::min(block_bins(grid, most), grid.bins - first_bin);
  const std::size_t width = count + most;
  auto* in = reinterpret_cast<Count*>(block_.data());
  auto* out = reinterpret_cast<Count*>(block_.data() + block_cells_);
  for (std::size_t slice = 0; slice < grid.slices; ++slice) {
    const std::size_t from = sign > 0 ? slice : grid.slices - 1 - slice;
    copy_around(in + slice * width, rows + from * grid.bins, first_bin, width, grid.bins);
  }
  auto levels = static_cast<std::size_t>(std::countr_zero(grid.slices));
  std::size_t lines = 1;
  for (std::size_t half = 1; half < grid.slices; half *= 2) {
    --levels;
    lines = std::min(2 * half, (most >> levels) + 1);
    for (std::size_t group = 0; group < grid.slices; group += 2 * half) {
      for (std::size_t j = 0; j < lines; ++j) {
        const std::size_t ahead = (j + 1) / 2;
        add(out + (group + j) * width, in + (group + j / 2) * width,
            in + (group + half + j / 2) * width + ahead, width - ahead);
      }
    }
    std::swap(in, out);
  }
  const auto largest = Kernels<Count>::largest(kernels_);
  // Lines without travel come up with both signs, and are looked at with the first.
  for (std::size_t j = sign > 0 ? 0 : 1; j <= most; ++j) {
    const Count* row = in + j * width;
    if (best_.size() < max_cells || largest(row, count) > best_.back().count) {
      keep_best(row, count, grid, first_bin, sign * static_cast<int>(j));
    }
  }
}

template <class Count>
void LineSearch::keep_best(const Count* row, std::size_t count, const SearchGrid& grid,
                           std::size_t first_bin, int travel_bins) {
  const double per_gap = grid.slices > 1 ? grid.slices / (grid.slices - 1.0) : 0.0;
  for (std::size_t d = 0; d < count; ++d) {
    const std::uint32_t least = best_.size() < max_cells ? 0 : best_.back().count;
    if (row[d] <= least) continue;
    // d is the bin in which the line crosses the middle of the first slice, or of the last slice
    // where the travel is negative. At mid-frame the line is half of travel_bins further on.
    const double bin = static_cast<double>(first_bin + d) + 0.5 + std::abs(travel_bins) / 2.0;
    const double delay_ns = bin * grid.bin_ns;
    const double turn = std::floor(delay_ns / train_.circle_ns);
    keep({{delay_ns - turn * train_.circle_ns, travel_bins * per_gap * grid.bin_ns}, row[d]},
         grid.bin_ns);
  }
}

void LineSearch::keep(const SearchCell& cell, double bin_ns) {
  const auto same_target = [&](const SearchCell& other) {
    double apart = std::abs(cell.line.delay_ns - other.line.delay_ns);
    apart = std::min(apart, train_.circle_ns - apart);
    // A line with a wrong travel still crosses a target's photons and counts some of them. In the
    // plane the target shows as a bow tie, which is as wide in delay as half the travel's error.
    const double off = std::abs(cell.line.travel_ns - other.line.travel_ns);
    return off < 16.2 * bin_ns && apart < 2.2 * bin_ns + off / 2;
  };
  for (const SearchCell& other : best_) {
    if (other.count >= cell.count && same_target(other)) return;
  }
  std::erase_if(best_, same_target);
  const auto place = std::find_if(best_.begin(), best_.end(), [&](const SearchCell& other) {
    return other.count < cell.count;
  });
  best_.insert(place, cell);
  if (best_.size() > max_cells) best_.pop_back();
}

std::span<const DelayCell> LineSearch::best_delays(const FoldedFrame& frame, double travel_ns,
                                                   const SearchGrid& grid) {
  auto* row = buffer<std::uint32_t>(0);
  rows_.load(frame, travel_ns, 1);
  rows_.fill(grid, row, buffer<std::uint32_t>(1), buffer<std::uint32_t>(2));
  delays_.clear();
  std::uint32_t least = 0;
  for (std::uint32_t bin = 0; bin < grid.bins; ++bin) {
    if (row[bin] <= least) continue;
    const std::uint32_t before = row[bin == 0 ? grid.bins - 1 : bin - 1];
    const std::uint32_t after = row[bin + 1 == grid.bins ? 0 : bin + 1];
    keep_delay({(bin + 0.5) * grid.bin_ns, row[bin], row[bin] + std::max(before, after)}, grid);
    if (delays_.size() == max_delays) least = delays_.back().count;
  }
  return delays_;
}

void LineSearch::keep_delay(const DelayCell& cell, const SearchGrid& grid) {
  const auto same_pulse = [&](const DelayCell& other) {
    const double apart = std::abs(cell.delay_ns - other.delay_ns);
    return std::min(apart, train_.circle_ns - apart) < 3.5 * grid.bin_ns;
  };
  for (const DelayCell& other : delays_) {
    if (other.count >= cell.count && same_pulse(other)) return;
  }
  std::erase_if(delays_, same_pulse);
  const auto place = std::find_if(delays_.begin(), delays_.end(),
                                  [&](const DelayCell& other) { return other.count < cell.count; });
  delays_.insert(place, cell);
  if (delays_.size() > max_delays) delays_.pop_back();
}

}  // namespace splid
