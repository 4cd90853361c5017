#include "estimator/search/line_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "estimator/fold/vector_level.hpp"

namespace splid {
LineSearch::LineSearch(const PulseTrain& train, std::size_t max_photons,
                       std::span<const SearchGrid> grids, VectorLevel level)
    : train_(train),
      kernels_(search_kernels(level)),
      rows_(train, max_photons, kernels_),
      tree_(kernels_, grids) {
  for (const SearchGrid& grid : grids) buffer_cells_ = std::max(buffer_cells_, grid.cells());
  memory_.resize(3 * buffer_cells_);
  best_.reserve(max_cells + 1);
  delays_.reserve(max_delays + 1);
}

template <class Count>
Count* LineSearch::buffer(std::size_t which) {
  static_assert(std::is_unsigned_v<Count> && sizeof(Count) <= sizeof(std::uint32_t));
  // All types of count use the same memory; rows are written before they are read.
  return reinterpret_cast<Count*>(memory_.data() + which * buffer_cells_);
}

std::span<const SearchCell> LineSearch::run(const FoldedFrame& frame, const SearchGrid& grid,
                                            double max_travel_ns) {
  best_.clear();
  rows_.load(frame, 0, grid.slices);
  const double most = rows_.most_in_slice(grid.bin_ns);
  if (most <= std::numeric_limits<std::uint8_t>::max()) {
    search<std::uint8_t>(grid, max_travel_ns);
  } else if (most <= std::numeric_limits<std::uint16_t>::max()) {
    search<std::uint16_t>(grid, max_travel_ns);
  } else {
    search<std::uint32_t>(grid, max_travel_ns);
  }
  return best_;
}

template <class Count>
void LineSearch::search(const SearchGrid& grid, double max_travel_ns) {
  auto* rows = buffer<Count>(0);
  const std::uint32_t most_in_cell = rows_.fill(grid, rows, buffer<Count>(1), buffer<Count>(2));
  const auto most = static_cast<std::size_t>(
      std::min<double>(grid.slices - 1, std::ceil(max_travel_ns / grid.bin_ns)));
  const std::size_t step = LineTree::block_bins(grid, most);
  for (const int sign : {1, -1}) {
    for (std::size_t bin = 0; bin < grid.bins; bin += step) {
      const LineTree::Block block = {bin, std::min(step, grid.bins - bin), most, sign,
                                     most_in_cell};
      tree_.add_up(rows, grid, block);
      keep_best(grid, block);
    }
  }
}

void LineSearch::keep_best(const SearchGrid& grid, const LineTree::Block& block) {
  const double per_gap = grid.slices > 1 ? grid.slices / (grid.slices - 1.0) : 0.0;
  const auto next = [&](std::size_t travel, std::size_t from) {
    return tree_.first_above(travel, from, best_.size() < max_cells ? 0 : best_.back().count);
  };
  // Lines without travel come up with both signs, and are looked at with the first.
  for (std::size_t j = block.sign > 0 ? 0 : 1; j <= block.most; ++j) {
    const double travel_bins = block.sign * static_cast<double>(j);
    for (std::size_t d = next(j, 0); d < block.bins; d = next(j, d + 1)) {
      // d is the bin in which the line crosses the middle of the first slice, or of the last slice
      // where the travel is negative. At mid-frame the line is half of the travel further on.
      const double bin =
          static_cast<double>(block.first_bin + d) + 0.5 + static_cast<double>(j) / 2;
      const double delay_ns = bin * grid.bin_ns;
      const double turn = std::floor(delay_ns / train_.circle_ns);
      keep({{delay_ns - turn * train_.circle_ns, travel_bins * per_gap * grid.bin_ns},
            tree_.photons(j, d)},
           grid.bin_ns);
    }
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
  rows_.load(frame, travel_ns, 1);
  delays_.clear();
  if (rows_.most_in_slice(grid.bin_ns) <= std::numeric_limits<std::uint16_t>::max()) {
    look_at_delays<std::uint16_t>(grid);
  } else {
    look_at_delays<std::uint32_t>(grid);
  }
  return delays_;
}

template <class Count>
void LineSearch::look_at_delays(const SearchGrid& grid) {
  auto* row = buffer<Count>(0);
  rows_.fill(grid, row, buffer<Count>(1), buffer<Count>(2));
  std::uint32_t least = 0;
  for (std::uint32_t bin = 0; bin < grid.bins; ++bin) {
    if (row[bin] <= least) continue;
    const std::uint32_t before = row[bin == 0 ? grid.bins - 1 : bin - 1];
    const std::uint32_t after = row[bin + 1 == grid.bins ? 0 : bin + 1];
    keep_delay({(bin + 0.5) * grid.bin_ns, row[bin], row[bin] + std::max(before, after)}, grid);
    if (delays_.size() == max_delays) least = delays_.back().count;
  }
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
