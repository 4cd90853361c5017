#include "estimator/search/part_lines.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <vector>

#include "estimator/fold/kernel_choice.hpp"
#include "estimator/search/taylor_tree.hpp"
#include "tests/estimator/search/walked.hpp"

namespace splid {
namespace {

// Some parts of a comb, each with rows of one of its periods.
template <class Count>
struct PartsOfAComb {
  SearchGrid grid;  // of the circle
  std::vector<std::uint32_t> bins;
  std::vector<std::vector<Count>> rows;

  PartsOfAComb(std::uint32_t circle, std::uint32_t slices, std::vector<std::uint32_t> parts,
               std::uint32_t most)
      : grid{circle, slices, 1}, bins(std::move(parts)) {
    std::mt19937_64 random(circle + slices + most);
    std::uniform_int_distribution<std::uint32_t> any(0, most);
    for (const std::uint32_t period : bins) {
      rows.emplace_back(std::size_t{period} * slices);
      for (Count& cell : rows.back()) cell = static_cast<Count>(any(random));
    }
  }
  // What a line of the circle holds, slice by slice.
  [[nodiscard]] std::uint32_t line(std::size_t bin, std::size_t walk, int sign) const {
    std::uint32_t all = 0;
    for (std::size_t k = 0; k < bins.size(); ++k) {
      for (std::size_t slice = 0; slice < grid.slices; ++slice) {
        const std::size_t row = sign > 0 ? slice : grid.slices - 1 - slice;
        const std::size_t here = bin + test::walked(walk, grid.slices, slice);
        all += rows[k][row * bins[k] + here % bins[k]];
      }
    }
    return all;
  }
};

// least() goes up by one with each line that is kept.
template <class Count>
void expect_lines_above(const PartsOfAComb<Count>& parts, const SearchKernels& kernels) {
  const std::size_t most = parts.grid.slices - 1;
  std::vector<std::uint32_t> copies;
  for (const std::uint32_t period : parts.bins) copies.push_back(parts.grid.bins / period);
  PartLines lines(kernels, {&parts.grid, 1}, copies);
  for (const int sign : {1, -1}) {
    lines.clear();
    for (std::size_t k = 0; k < parts.bins.size(); ++k) {
      lines.add_up(parts.rows[k].data(), parts.grid, parts.bins[k], most, sign);
    }
    for (std::size_t walk = 0; walk <= most; walk += 3) {
      lines.look_at(walk);
      std::map<std::size_t, std::uint32_t> all, above;
      std::uint32_t largest = 0;
      lines.visit_above(
          parts.grid.bins, [] { return 0U; },
          [&](std::size_t bin, std::uint32_t photons) { all[bin] = photons; });
      for (std::size_t bin = 0; bin < parts.grid.bins; ++bin) {
        const std::uint32_t expected = parts.line(bin, walk, sign);
        ASSERT_EQ(all.contains(bin) ? all[bin] : 0, expected) << bin << ' ' << walk << ' ' << sign;
        largest = std::max(largest, expected);
      }
      // Of those that are above all that came before, the last one is the largest.
      std::uint32_t least = largest / 2;
      lines.visit_above(
          parts.grid.bins, [&] { return least; },
          [&](std::size_t bin, std::uint32_t photons) {
            EXPECT_GT(photons, least);
            EXPECT_EQ(photons, all[bin]);
            least = photons;
          });
      EXPECT_EQ(least, largest);
      lines.visit_above(
          parts.grid.bins, [&] { return largest; },
          [&](std::size_t, std::uint32_t) { ADD_FAILURE() << "none is larger"; });
    }
  }
}

TEST(PartLines, HoldWhatTheCircleHolds) {
  for (const VectorLevel level : runnable_vector_levels()) {
    const SearchKernels& kernels = search_kernels(level);
    expect_lines_above(PartsOfAComb<std::uint8_t>(420, 16, {20, 21}, 2), kernels);
    expect_lines_above(PartsOfAComb<std::uint8_t>(420, 32, {210, 140, 60}, 255), kernels);
    // A line goes around a part's period more than once.
    expect_lines_above(PartsOfAComb<std::uint8_t>(84, 64, {12, 14}, 3), kernels);
    expect_lines_above(PartsOfAComb<std::uint8_t>(84, 1, {12, 14}, 3), kernels);
    expect_lines_above(PartsOfAComb<std::uint16_t>(420, 16, {84, 105}, 60000), kernels);
    expect_lines_above(PartsOfAComb<std::uint32_t>(420, 8, {84, 105}, 1'000'000), kernels);
  }
}

}  // namespace
}  // namespace splid
