#include "estimator/search/part_lines.hpp"

#include <algorithm>

namespace splid {
namespace {

// The grids of one period of a part, of which the circle has so many.
std::vector<SearchGrid> period_grids(std::span<const SearchGrid> grids, std::uint32_t periods) {
  std::vector<SearchGrid> own(grids.begin(), grids.end());
  for (SearchGrid& grid : own) grid.bins = std::max(1U, grid.bins / periods);
  return own;
}

// The cells of the longest line: those of the part with the longest period.
std::size_t longest_line(std::span<const SearchGrid> grids, std::span<const std::uint32_t> copies) {
  std::size_t longest = 0;
  for (const std::uint32_t periods : copies) {
    for (const SearchGrid& own : period_grids(grids, periods)) {
      longest = std::max<std::size_t>(longest, own.bins);
    }
  }
  return longest;
}

}  // namespace

PartLines::PartLines(const SearchKernels& kernels, std::span<const SearchGrid> grids,
                     std::span<const std::uint32_t> copies)
    : kernels_(kernels),
      longest_(longest_line(grids, copies)),
      memory_((copies.size() + 1) * longest_),
      places_(copies.size()) {
  trees_.reserve(copies.size());
  for (const std::uint32_t periods : copies) {
    trees_.emplace_back(kernels, period_grids(grids, periods));
  }
  parts_.reserve(copies.size());
}

std::size_t PartLines::bytes(std::span<const SearchGrid> grids,
                             std::span<const std::uint32_t> copies) {
  std::size_t all = (copies.size() + 1) * longest_line(grids, copies) * sizeof(std::uint32_t);
  for (const std::uint32_t periods : copies) all += TaylorTree::bytes(period_grids(grids, periods));
  return all;
}

template <class Count>
void PartLines::add_up(const Count* rows, const SearchGrid& grid, std::uint32_t bins,
                       std::size_t most, int sign) {
  const std::size_t number = parts_.size();
  SearchGrid period = grid;
  period.bins = bins;
  trees_[number].add_up(rows, period, {0, bins, most, sign});
  const std::size_t first = number > 0 ? parts_.front().bins : bins;
  parts_.push_back({bins, first % bins, memory_.data() + number * longest_});
}

template void PartLines::add_up(const std::uint8_t*, const SearchGrid&, std::uint32_t, std::size_t,
                                int);
template void PartLines::add_up(const std::uint16_t*, const SearchGrid&, std::uint32_t, std::size_t,
                                int);
template void PartLines::add_up(const std::uint32_t*, const SearchGrid&, std::uint32_t, std::size_t,
                                int);

void PartLines::look_at(std::size_t walk) {
  for (std::size_t k = 0; k < parts_.size(); ++k) {
    trees_[k].write_line(walk, parts_[k].line);
    parts_[k].largest = kernels_.longs.largest(parts_[k].line, parts_[k].bins);
  }
}

// The first bin of the first part, not before `from`, whose lines in the circle may hold more than
// `least`; the number of its bins where there is none.
std::size_t PartLines::next(std::size_t from, std::uint32_t least) const {
  const Part& first = parts_.front();
  std::uint32_t others = 0;
  for (const Part& part : std::span(parts_).subspan(1)) others += part.largest;
  if (first.largest + others <= least) return first.bins;
  if (others > least) return from;
  const std::uint32_t* zeros = memory_.data() + trees_.size() * longest_;
  return kernels_.longs.first_above(first.line, zeros, from, first.bins, least - others);
}

}  // namespace splid
