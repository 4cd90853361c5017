#include "estimator/search/taylor_tree.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "estimator/fold/kernel_choice.hpp"

namespace splid {
namespace {

template <class Count>
struct Plane {
  SearchGrid grid;
  std::vector<Count> rows;

  Plane(std::uint32_t bins, std::uint32_t slices, std::uint32_t most, std::uint64_t seed)
      : grid{bins, slices, 1}, rows(grid.cells()) {
    std::mt19937_64 random(seed);
    std::uniform_int_distribution<std::uint32_t> any(0, most);
    for (Count& cell : rows) cell = static_cast<Count>(any(random));
  }
  // A line by its definition: over the first half of the slices it walks half of its bins,
  // rounded down, and over the last half as many, from where it would be after half of its range
  // walk, rounded up.
  [[nodiscard]] std::uint64_t line(std::size_t first, std::size_t slices, std::size_t walk,
                                   std::size_t bin, int sign) const {
    if (slices == 1) {
      const std::size_t row = sign > 0 ? first : grid.slices - 1 - first;
      return rows[row * grid.bins + bin % grid.bins];
    }
    return line(first, slices / 2, walk / 2, bin, sign) +
           line(first + slices / 2, slices / 2, walk / 2, bin + (walk + 1) / 2, sign);
  }
};

template <class Count>
void expect_all_lines(const Plane<Count>& plane, std::size_t most, const SearchKernels& kernels) {
  TaylorTree tree(kernels, {&plane.grid, 1});
  for (const int sign : {1, -1}) {
    const TaylorTree::Block block = {plane.grid.bins / 2, plane.grid.bins / 3 + 1, most, sign};
    tree.add_up(plane.rows.data(), plane.grid, block);
    for (std::size_t walk = 0; walk <= most; ++walk) {
      std::uint64_t largest = 0;
      for (std::size_t bin = 0; bin < block.bins; ++bin) {
        const std::uint64_t expected =
            plane.line(0, plane.grid.slices, walk, block.first_bin + bin, sign);
        ASSERT_EQ(tree.photons(walk, bin), expected) << walk << ' ' << bin << ' ' << sign;
        largest = std::max(largest, expected);
      }
      const auto least = static_cast<std::uint32_t>(largest);
      EXPECT_EQ(tree.first_above(walk, 0, least), block.bins);
      if (largest == 0) continue;
      const std::size_t at = tree.first_above(walk, 0, least - 1);
      ASSERT_LT(at, block.bins);
      EXPECT_EQ(tree.photons(walk, at), largest);
      for (std::size_t bin = 0; bin < at; ++bin) EXPECT_LT(tree.photons(walk, bin), largest);
    }
  }
}

// With the largest number of a type in the rows, sums leave the type at the first level; with small
// numbers at later levels, at the very last, or never.
TEST(TaylorTree, EveryLineIsTheSumOfItsCells) {
  for (const VectorLevel level : runnable_vector_levels()) {
    const SearchKernels& kernels = search_kernels(level);
    for (const std::uint32_t slices : {1U, 2U, 4U, 8U, 16U, 32U, 64U}) {
      const std::size_t all = slices - 1;
      for (const std::size_t most : {std::size_t{0}, all / 3, all}) {
        for (const std::uint32_t largest : {0U, 2U, 5U, 40U, 255U}) {
          expect_all_lines(Plane<std::uint8_t>(330, slices, largest, 1), most, kernels);
        }
        for (const std::uint32_t largest : {700U, 3000U, 65535U}) {
          expect_all_lines(Plane<std::uint16_t>(330, slices, largest, 2), most, kernels);
        }
        expect_all_lines(Plane<std::uint32_t>(330, slices, 1 << 24, 3), most, kernels);
        expect_all_lines(Plane<std::uint8_t>(7, slices, 255, 4), most, kernels);
        // Lines that go around the circle often.
        for (const std::uint32_t bins : {1U, 2U, 3U, 20U, 31U}) {
          expect_all_lines(Plane<std::uint8_t>(bins, slices, 2, 5), most, kernels);
          expect_all_lines(Plane<std::uint16_t>(bins, slices, 65535, 6), most, kernels);
        }
      }
    }
  }
}

}  // namespace
}  // namespace splid
