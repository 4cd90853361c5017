#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/fold/folded_frame.hpp"
#include "estimator/model/vector_level.hpp"
#include "estimator/search/comb_rows.hpp"
#include "estimator/search/part_lines.hpp"
#include "estimator/search/taylor_tree.hpp"

namespace splid {

// A cell of the plane of delay and range walk: the number of photons along a line that is one delay
// bin wide.
struct SearchCell {
  DelayTrack line;
  std::uint32_t count = 0;
};

// A delay for a known range walk: the number of photons in its bin, and that number together with
// the fuller of the two neighbouring bins.
struct DelayCell {
  double delay_ns = 0;
  std::uint32_t count = 0;
  std::uint32_t with_neighbour = 0;
};

// Keeps so many cells with the most photons, of those that are the same the best. They are in
// descending order.
template <class Cell, class Same>
void keep_among(std::vector<Cell>& cells, std::size_t most, const Cell& cell, const Same& is_same) {
  const auto is_better = [&](const Cell& other) { return other.count >= cell.count; };
  const auto stays = [&](const Cell& other) { return is_better(other) && is_same(other); };
  if (std::any_of(cells.begin(), cells.end(), stays)) return;
  std::erase_if(cells, is_same);
  cells.insert(std::find_if_not(cells.begin(), cells.end(), is_better), cell);
  if (cells.size() > most) cells.pop_back();
}

// Searches all delays, and all range walks up to a limit, at once. The frame is cut into slices so
// short that the delay of the fastest target walks one bin in each. CombRows correlates each slice
// with the pulse train, and TaylorTree (PartLines: of periodic parts) adds them along all lines.
//
// Cost: that of CombRows, and 2 bins * slices * log2(slices) additions.
class DelayVelocitySearch {
 public:
  static constexpr std::size_t max_cells = 16;

  // grids: all grids that run() and best_delays() will be given.
  DelayVelocitySearch(const PulseTrain& train, std::size_t max_photons,
                      std::span<const SearchGrid> grids, VectorLevel level = best_vector_level());
  // What a search of these grids allocates, but for what grows with max_photons.
  static std::size_t bytes(const PulseTrain& train, std::span<const SearchGrid> grids);

  // The best cells, those with the most photons first. Of a comb that is made of periodic parts, a
  // photon at a pulse of two parts counts twice. Lines whose range walk is larger than max_walk_ns
  // (and a bin) are left out, and so are cells in the bow tie that the photons of a better cell
  // make (see keep()). Valid until the next run.
  std::span<const SearchCell> run(const FoldedFrame& frame, const SearchGrid& grid,
                                  double max_walk_ns);

  // Of two targets whose combs meet: theirs, those that both make, and how far these stand out.
  static constexpr std::size_t max_delays = 5;
  // The best delays for a known range walk, those with the most photons first and at least four
  // bins apart, in a grid of one slice: for patterns that partly fall on themselves elsewhere.
  // Valid until the next call.
  std::span<const DelayCell> best_delays(const FoldedFrame& frame, double walk_ns,
                                         const SearchGrid& grid);

 private:
  // A line in the rows of a grid.
  struct GridLine {
    std::size_t bin;   // where it begins: in the first slice, or in the last where sign < 0
    std::size_t walk;  // bins on its way through all slices
    int sign;          // of the range walk
  };
  // Which grids are searched by the periods of parts, and the cells of their rows.
  struct Room {
    std::vector<SearchGrid> whole, in_parts;
    std::size_t buffer_cells = 0;  // of each of three buffers
    std::size_t part_cells = 0;    // rows of all parts, one after the other
    [[nodiscard]] std::size_t cells() const { return std::max(3 * buffer_cells, part_cells); }
  };
  static Room room_for(CombRows& rows, std::span<const SearchGrid> grids);
  template <class Count>
  void search(const SearchGrid& grid, double max_walk_ns);
  void keep_best(const SearchGrid& grid, const TaylorTree::Block& block);
  template <class Count>
  void search_parts(const SearchGrid& grid, std::size_t most);
  [[nodiscard]] std::uint32_t least_kept() const {
    return best_.size() < max_cells ? 0 : best_.back().count;
  }
  void keep(const GridLine& line, std::uint32_t photons, const SearchGrid& grid);
  template <class Count>
  void look_at_delays(const SearchGrid& grid);
  template <class Count>
  Count* buffer(std::size_t which);

  const PulseTrain& train_;
  const SearchKernels& kernels_;
  CombRows rows_;
  Room room_;
  TaylorTree tree_;
  PartLines part_lines_;
  std::vector<std::uint32_t> memory_;  // three buffers of rows, or the rows of all parts
  std::vector<SearchCell> best_;
  std::vector<DelayCell> delays_;
};

}  // namespace splid
