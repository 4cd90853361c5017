#include "estimator/search/part_lines.hpp"

#include <algorithm>

#include "estimator/fold/kernel_choice.hpp"

namespace splid {

PartLines::PartLines(const SearchKernels& kernels, std::span<const SearchGrid> grids,
                     std::span<const std::uint32_t> copies)
    : kernels_(kernels), longest_(longest_line(grids, copies)) {
  trees_.reserve(copies.size());
  for (const std::uint32_t periods : copies) {
    trees_.emplace_back(kernels, period_grids(grids, periods));
  }
  memory_.resize((trees_.size() + 1) * longest_);
  parts_.reserve(trees_.size());
  places_.resize(trees_.size());
}

std::vector<SearchGrid> PartLines::period_grids(std::span<const SearchGrid> grids,
                                                std::uint32_t periods) {
  std::vector<SearchGrid> own(grids.begin(), grids.end());
  for (SearchGrid& grid : own) grid.bins = std::max(1U, grid.bins / periods);
  return own;
}

std::size_t PartLines::longest_line(std::span<const SearchGrid> grids,
                                    std::span<const std::uint32_t> copies) {
  std::size_t longest = 0;
  for (const std::uint32_t periods : copies) {
    for (const SearchGrid& own : period_grids(grids, periods)) {
      longest = std::max<std::size_t>(longest, own.bins);
    }
  }
  return longest;
}

std::size_t PartLines::bytes(std::span<const SearchGrid> grids,
                             std::span<const std::uint32_t> copies) {
  std::size_t all = (copies.size() + 1) * longest_line(grids, copies) * sizeof(std::uint32_t);
  for (const std::uint32_t periods : copies) all += TaylorTree::bytes(period_grids(grids, periods));
  return all;
}

template <class Count>
void PartLines::add_up(const Count* rows, const SearchGrid& grid, std::uint32_t bins,
                       std::size_t most, int sign, std::uint32_t most_in_cell) {
  const std::size_t number = parts_.size();
  SearchGrid period = grid;
  period.bins = bins;
  TaylorTree& tree = trees_[number];
  tree.add_up(rows, period, {0, bins, most, sign, most_in_cell});
  is_wide_ = (number > 0 && is_wide_) || tree.has_wide_sums();
  const std::size_t first = number > 0 ? parts_.front().bins : bins;
  parts_.push_back({bins, first % bins, memory_.data() + number * longest_});
}

template void PartLines::add_up(const std::uint8_t*, const SearchGrid&, std::uint32_t, std::size_t,
                                int, std::uint32_t);
template void PartLines::add_up(const std::uint16_t*, const SearchGrid&, std::uint32_t, std::size_t,
                                int, std::uint32_t);
template void PartLines::add_up(const std::uint32_t*, const SearchGrid&, std::uint32_t, std::size_t,
                                int, std::uint32_t);

void PartLines::look_at(std::size_t walk) {
  if (is_wide_) {
    look_at_as<std::uint32_t>(walk);
  } else {
    look_at_as<std::uint16_t>(walk);
  }
}

template <class Wide>
void PartLines::look_at_as(std::size_t walk) {
  for (std::size_t k = 0; k < parts_.size(); ++k) {
    auto* line = reinterpret_cast<Wide*>(parts_[k].line);
    trees_[k].write_line(walk, line);
    parts_[k].largest = of<Wide>(kernels_).largest(line, parts_[k].bins);
  }
}

// The first bin of the first part, not before `from`, whose lines in the circle may hold more than
// `least`; the number of its bins where there is none.
template <class Wide>
std::size_t PartLines::next(std::size_t from, std::uint32_t least) const {
  const Part& first = parts_.front();
  std::uint32_t others = 0;
  for (const Part& part : std::span(parts_).subspan(1)) others += part.largest;
  if (first.largest + others <= least) return first.bins;
  if (others > least) return from;
  const auto* zeros = reinterpret_cast<const Wide*>(memory_.data() + trees_.size() * longest_);
  return of<Wide>(kernels_).first_above(line_of<Wide>(first), zeros, from, first.bins,
                                        static_cast<Wide>(least - others));
}

template std::size_t PartLines::next<std::uint16_t>(std::size_t, std::uint32_t) const;
template std::size_t PartLines::next<std::uint32_t>(std::size_t, std::uint32_t) const;

}  // namespace splid
