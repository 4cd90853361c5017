#include "estimator/search/delay_velocity_search.hpp"

#include <cmath>
#include <limits>
#include <type_traits>

#include "estimator/fold/kernel_choice.hpp"

namespace splid {
// A grid with a period of each part has rows of these alone, and no need of the tree of the circle.
// A grid of one slice is also looked at as a whole, by best_delays().
DelayVelocitySearch::Room DelayVelocitySearch::room_for(CombRows& rows,
                                                        std::span<const SearchGrid> grids) {
  Room room;
  for (const SearchGrid& grid : grids) {
    std::size_t part_cells = 0;
    for (const std::uint32_t bins : rows.part_bins(grid)) {
      part_cells += std::size_t{bins} * grid.slices;
    }
    (part_cells > 0 ? room.in_parts : room.whole).push_back(grid);
    if (part_cells == 0 || grid.slices == 1) {
      room.buffer_cells = std::max(room.buffer_cells, grid.cells());
    }
    room.part_cells = std::max(room.part_cells, part_cells);
  }
  return room;
}

DelayVelocitySearch::DelayVelocitySearch(const PulseTrain& train, std::size_t max_photons,
                                         std::span<const SearchGrid> grids, VectorLevel level)
    : train_(train),
      kernels_(search_kernels(level)),
      rows_(train, max_photons, kernels_),
      room_(room_for(rows_, grids)),
      tree_(kernels_, room_.whole),
      part_lines_(kernels_, room_.in_parts, rows_.part_copies()) {
  memory_.resize(room_.cells());
  best_.reserve(max_cells + 1);
  delays_.reserve(max_delays + 1);
}

std::size_t DelayVelocitySearch::bytes(const PulseTrain& train, std::span<const SearchGrid> grids) {
  CombRows rows(train, 0, best_search_kernels());
  const Room room = room_for(rows, grids);
  return room.cells() * sizeof(std::uint32_t) + TaylorTree::bytes(room.whole) +
         PartLines::bytes(room.in_parts, rows.part_copies());
}

template <class Count>
Count* DelayVelocitySearch::buffer(std::size_t which) {
  static_assert(std::is_unsigned_v<Count> && sizeof(Count) <= sizeof(std::uint32_t));
  // All types of count use the same memory; rows are written before they are read.
  return reinterpret_cast<Count*>(memory_.data() + which * room_.buffer_cells);
}

std::span<const SearchCell> DelayVelocitySearch::run(const FoldedFrame& frame,
                                                     const SearchGrid& grid, double max_walk_ns) {
  best_.clear();
  rows_.load(frame, 0, grid.slices);
  const double most = rows_.most_in_slice(grid.bin_ns);
  if (most <= std::numeric_limits<std::uint8_t>::max()) {
    search<std::uint8_t>(grid, max_walk_ns);
  } else if (most <= std::numeric_limits<std::uint16_t>::max()) {
    search<std::uint16_t>(grid, max_walk_ns);
  } else {
    search<std::uint32_t>(grid, max_walk_ns);
  }
  return best_;
}

template <class Count>
void DelayVelocitySearch::search(const SearchGrid& grid, double max_walk_ns) {
  const auto most = static_cast<std::size_t>(
      std::min<double>(grid.slices - 1, std::ceil(max_walk_ns / grid.bin_ns)));
  if (!rows_.part_bins(grid).empty()) {
    search_parts<Count>(grid, most);
    return;
  }
  auto* rows = buffer<Count>(0);
  rows_.fill(grid, rows, buffer<Count>(1), buffer<Count>(2));
  const std::size_t step = TaylorTree::block_bins(grid, most);
  for (const int sign : {1, -1}) {
    for (std::size_t bin = 0; bin < grid.bins; bin += step) {
      const TaylorTree::Block block = {bin, std::min(step, grid.bins - bin), most, sign};
      tree_.add_up(rows, grid, block);
      keep_best(grid, block);
    }
  }
}

// Lines without range walk come up with both signs, and are looked at with the first.
void DelayVelocitySearch::keep_best(const SearchGrid& grid, const TaylorTree::Block& block) {
  for (std::size_t j = block.sign > 0 ? 0 : 1; j <= block.most; ++j) {
    const auto next = [&](std::size_t from) { return tree_.first_above(j, from, least_kept()); };
    for (std::size_t d = next(0); d < block.bins; d = next(d + 1)) {
      keep({block.first_bin + d, j, block.sign}, tree_.photons(j, d), grid);
    }
  }
}

template <class Count>
void DelayVelocitySearch::search_parts(const SearchGrid& grid, std::size_t most) {
  const std::span<const std::uint32_t> part_bins = rows_.part_bins(grid);
  Count* next = buffer<Count>(0);  // the rows of one part after the other
  for (std::size_t k = 0; k < part_bins.size(); ++k) {
    rows_.fill_period(grid, k, next);
    next += std::size_t{part_bins[k]} * grid.slices;
  }
  for (const int sign : {1, -1}) {
    part_lines_.clear();
    const Count* rows = buffer<Count>(0);
    for (const std::uint32_t bins : part_bins) {
      part_lines_.add_up(rows, grid, bins, most, sign);
      rows += std::size_t{bins} * grid.slices;
    }
    for (std::size_t j = sign > 0 ? 0 : 1; j <= most; ++j) {
      part_lines_.look_at(j);
      part_lines_.visit_above(
          grid.bins, [&] { return least_kept(); },
          [&](std::size_t bin, std::uint32_t photons) {
            keep({bin, j, sign}, photons, grid);
          });
    }
  }
}

void DelayVelocitySearch::keep(const GridLine& line, std::uint32_t photons,
                               const SearchGrid& grid) {
  // At mid-frame the line is half of the range walk further on than where it begins.
  const double per_gap = grid.slices > 1 ? grid.slices / (grid.slices - 1.0) : 0.0;
  const auto walk = static_cast<double>(line.walk);
  const double delay_ns = (static_cast<double>(line.bin) + 0.5 + walk / 2) * grid.bin_ns;
  const double turn = std::floor(delay_ns / train_.circle_ns);
  const double walk_ns = line.sign * walk * per_gap * grid.bin_ns;
  const SearchCell cell = {{delay_ns - turn * train_.circle_ns, walk_ns}, photons};
  keep_among(best_, max_cells, cell, [&](const SearchCell& other) {
    double apart = std::abs(cell.line.delay_ns - other.line.delay_ns);
    apart = std::min(apart, train_.circle_ns - apart);
    // A line with a wrong range walk still crosses a target's photons and counts some of them. In
    // the plane the target shows as a bow tie, which is as wide in delay as half the range walk's
    // error.
    const double off = std::abs(cell.line.walk_ns - other.line.walk_ns);
    return off < 16.2 * grid.bin_ns && apart < 2.2 * grid.bin_ns + off / 2;
  });
}

std::span<const DelayCell> DelayVelocitySearch::best_delays(const FoldedFrame& frame,
                                                            double walk_ns,
                                                            const SearchGrid& grid) {
  rows_.load(frame, walk_ns, 1);
  delays_.clear();
  if (rows_.most_in_slice(grid.bin_ns) <= std::numeric_limits<std::uint16_t>::max()) {
    look_at_delays<std::uint16_t>(grid);
  } else {
    look_at_delays<std::uint32_t>(grid);
  }
  return delays_;
}

template <class Count>
void DelayVelocitySearch::look_at_delays(const SearchGrid& grid) {
  auto* row = buffer<Count>(0);
  rows_.fill(grid, row, buffer<Count>(1), buffer<Count>(2));
  std::uint32_t least = 0;
  for (std::uint32_t bin = 0; bin < grid.bins; ++bin) {
    if (row[bin] <= least) continue;
    const std::uint32_t before = row[bin == 0 ? grid.bins - 1 : bin - 1];
    const std::uint32_t after = row[bin + 1 == grid.bins ? 0 : bin + 1];
    const DelayCell cell = {(bin + 0.5) * grid.bin_ns, row[bin],
                            row[bin] + std::max(before, after)};
    keep_among(delays_, max_delays, cell, [&](const DelayCell& other) {
      const double apart = std::abs(cell.delay_ns - other.delay_ns);
      return std::min(apart, train_.circle_ns - apart) < 3.5 * grid.bin_ns;
    });
    if (delays_.size() == max_delays) least = delays_.back().count;
  }
}

}  // namespace splid
