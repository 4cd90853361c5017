#include "estimator/search/delay_velocity_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/fold/near_set.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "tests/estimator/search/walked.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

// Small enough for brute force: 126 ns of period, five pulses, 0.2 ms.
test::FrameMaker small_maker(const Pattern& pattern, double velocity_mps) {
  test::FrameMaker made;
  made.pattern = pattern;
  made.length_ms = 0.2;
  made.distance_m = 7.3;
  made.velocity_mps = velocity_mps;
  made.signal_per_pulse = 6e-3;
  made.background_per_ns = 1e-3;
  return made;
}

struct Folded {
  test::FrameMaker::Frame photons;
  PulseTrain train;
  FoldedFrame frame;
  Folded(const test::FrameMaker& made, std::uint64_t seed)
      : photons(made.make(seed)), train(made.pattern), frame(train, photons.photons_ps.size()) {
    frame.fold(photons.view(), train);
  }
};

double apart(double a, double b, double period) { return std::abs(std::remainder(a - b, period)); }

// The most that the light on a line gains: over the share f of it in all light, the sum over the
// photons of log(1 + f (r - 1)), with r the density on the line over that of no target.
double gain_on(const NearSet& near, const Folded& folded) {
  const double scale =
      folded.frame.length_ns / (folded.train.amplitude_per_ns * folded.frame.length_ns);
  std::vector<double> excess(near.photons());
  for (std::size_t n = 0; n < near.photons(); ++n) {
    for (std::size_t j = near.first[n]; j < near.first[n + 1]; ++j) {
      const double x = near.residual_ns[j] / 0.1;
      excess[n] += scale * near.amplitude[j] * std::exp(-x * x / 2) / (0.1 * std::sqrt(2 * M_PI));
    }
    excess[n] -= 1;
  }
  const auto far = static_cast<double>(folded.frame.size()) - static_cast<double>(near.photons());
  double low = 0, high = 1;
  for (int round = 0; round < 25; ++round) {
    const double f = (low + high) / 2;
    double slope = -far / (1 - f);
    for (const double e : excess) slope += e / (1 + f * e);
    (slope > 0 ? low : high) = f;
  }
  double gain = far * std::log1p(-low);
  for (const double e : excess) gain += std::log1p(low * e);
  return gain;
}

// The likelihood at every point of a grid of one pulse width: no tree, no bins.
DelayTrack brute_force(const Folded& folded, double max_walk_ns) {
  NearSet near(folded.frame.size(), folded.frame.size() * 2);
  const std::vector<CombWindow> windows = comb_windows(folded.train, -1, 1);
  DelayTrack best;
  double most = -std::numeric_limits<double>::infinity();
  for (double walk = -max_walk_ns; walk <= max_walk_ns; walk += 0.2) {
    for (double delay = 0; delay < folded.train.circle_ns; delay += 0.1) {
      near.collect(folded.frame, windows, folded.train, {delay, walk});
      const double gain = gain_on(near, folded);
      if (gain > most) {
        most = gain;
        best = {delay, walk};
      }
    }
  }
  return best;
}

TEST(DelayVelocitySearch, FindsWhatBruteForceFinds) {
  const Pattern patterns[] = {test::interleaved_pattern({42000, 63000}, 126000),
                              test::random_pattern(126000, 5, 9000, 2)};
  for (const Pattern& pattern : patterns) {
    for (const double velocity : {0.0, 1100.0, -1450.0}) {
      const Folded folded(small_maker(pattern, velocity), 5);
      const double limit = 2 * 1500 / 299792458.0 * folded.frame.length_ns;  // 2 ns
      const DelayTrack expected = brute_force(folded, limit);
      const SearchGrid grid = SearchGrid::cover(folded.train.circle_ns, 0.25, limit);
      DelayVelocitySearch search(folded.train, folded.frame.size(), {&grid, 1});
      const auto cells = search.run(folded.frame, grid, limit);
      ASSERT_FALSE(cells.empty());
      EXPECT_LT(apart(cells[0].line.delay_ns, expected.delay_ns, folded.train.circle_ns), 0.4);
      EXPECT_NEAR(cells[0].line.walk_ns, expected.walk_ns, 0.8);
      // And both are the target.
      EXPECT_LT(apart(expected.delay_ns, 2 * 7.3 / 0.299792458, folded.train.circle_ns), 0.3);
    }
  }
}

TEST(DelayVelocitySearch, CountsEveryPhotonAtItsDelays) {
  const Folded folded(small_maker(test::periodic_pattern(126000), 0), 1);
  // One bin: whatever the line, it holds every photon once.
  const SearchGrid grid = SearchGrid::cover(folded.train.circle_ns, 126, 10);
  ASSERT_EQ(grid.bins, 1U);
  DelayVelocitySearch search(folded.train, folded.frame.size(), {&grid, 1});
  EXPECT_EQ(search.run(folded.frame, grid, 10)[0].count, folded.frame.size());
}

TEST(DelayVelocitySearch, EveryVectorLevelGivesTheSameCells) {
  test::FrameMaker made = small_maker(test::random_pattern(126000, 5, 9000, 2), 300);
  for (const double background : {1e-4, 3e-2, 1.0}) {  // by photon, by row, by row in 32 bits
    made.background_per_ns = background;
    const Folded folded(made, 3);
    const SearchGrid grid = SearchGrid::cover(folded.train.circle_ns, 0.5, 2);
    DelayVelocitySearch generic(folded.train, folded.frame.size(), {&grid, 1},
                                VectorLevel::generic);
    const auto expected = generic.run(folded.frame, grid, 2);
    const SearchGrid row = SearchGrid::cover(folded.train.circle_ns, 0.5, 0);
    const auto delays = generic.best_delays(folded.frame, 0.4, row);
    ASSERT_EQ(delays.size(), DelayVelocitySearch::max_delays);
    for (const VectorLevel level : runnable_vector_levels()) {
      DelayVelocitySearch search(folded.train, folded.frame.size(), {&grid, 1}, level);
      const auto cells = search.run(folded.frame, grid, 2);
      ASSERT_EQ(cells.size(), expected.size());
      for (std::size_t k = 0; k < cells.size(); ++k) {
        EXPECT_EQ(cells[k].count, expected[k].count);
        EXPECT_EQ(cells[k].line.delay_ns, expected[k].line.delay_ns);
        EXPECT_EQ(cells[k].line.walk_ns, expected[k].line.walk_ns);
      }
      const auto same = search.best_delays(folded.frame, 0.4, row);
      ASSERT_EQ(same.size(), delays.size());
      for (std::size_t k = 0; k < same.size(); ++k) {
        EXPECT_EQ(same[k].delay_ns, delays[k].delay_ns);
        EXPECT_EQ(same[k].count, delays[k].count);
        EXPECT_EQ(same[k].with_neighbour, delays[k].with_neighbour);
      }
    }
  }
}

// With two rates, which are searched by their own periods, a cell holds each photon that a pulse of
// either rate has on its line: twice where the pulse is in both.
TEST(DelayVelocitySearch, CountsPhotonsOfEachRate) {
  for (const double background_per_ns : {1e-3, 1.0}) {
    test::FrameMaker made = small_maker(test::interleaved_pattern({42000, 63000}, 126000), 300);
    made.background_per_ns = background_per_ns;
    const Folded folded(made, 4);
    const SearchGrid grid = SearchGrid::cover(folded.train.circle_ns, 0.5, 2, 6);
    ASSERT_EQ(grid.bins % 6, 0U);
    DelayVelocitySearch search(folded.train, folded.frame.size(), {&grid, 1});
    const auto cells = search.run(folded.frame, grid, 2);
    ASSERT_EQ(cells.size(), DelayVelocitySearch::max_cells);
    const double gap = (grid.slices - 1.0) / grid.slices;
    for (const SearchCell& cell : cells) {
      const auto walk = std::llround(std::abs(cell.line.walk_ns) * gap / grid.bin_ns);
      const int sign = cell.line.walk_ns < 0 ? -1 : 1;
      const double begin = cell.line.delay_ns / grid.bin_ns - 0.5 - static_cast<double>(walk) / 2;
      std::uint32_t held = 0;
      for (std::size_t i = 0; i < folded.frame.size(); ++i) {
        const auto slice = static_cast<std::size_t>(
            std::clamp((folded.frame.time_ns[i] / folded.frame.length_ns + 0.5) * grid.slices, 0.0,
                       grid.slices - 1.0));
        const std::size_t on_way = sign > 0 ? slice : grid.slices - 1 - slice;
        const double bin = begin + static_cast<double>(test::walked(static_cast<std::size_t>(walk),
                                                                    grid.slices, on_way));
        for (const double pulse_ns : {0.0, 42.0, 84.0, 0.0, 63.0}) {
          const double delay_ns = folded.frame.phase_ns[i] - pulse_ns;
          const double off = delay_ns / grid.bin_ns - bin;
          held += std::lround(std::floor(off)) % grid.bins == 0 ? 1 : 0;
        }
      }
      EXPECT_NEAR(cell.count, held, background_per_ns < 1e-2 ? 1 : 5);
    }
  }
}

TEST(DelayVelocitySearch, ManyPhotonsDoNotOverflow) {
  test::FrameMaker made = small_maker(test::periodic_pattern(126000), 0);
  made.signal_per_pulse = 100;  // 160,000 photons in one cell: more than 16 bits hold
  const Folded folded(made, 3);
  const SearchGrid grid = SearchGrid::cover(folded.train.circle_ns, 1, 2);
  DelayVelocitySearch search(folded.train, folded.frame.size(), {&grid, 1});
  const SearchCell cell = search.run(folded.frame, grid, 2)[0];
  EXPECT_GT(cell.count, 65536U);
  EXPECT_LT(apart(cell.line.delay_ns, 2 * 7.3 / 0.299792458, 126), 1);
}

TEST(DelayVelocitySearch, CellsAreDistinctAndInOrder) {
  const Folded folded(small_maker(test::interleaved_pattern({42000, 63000}, 126000), 500), 8);
  const SearchGrid grid = SearchGrid::cover(folded.train.circle_ns, 0.5, 2);
  DelayVelocitySearch search(folded.train, folded.frame.size(), {&grid, 1});
  const auto cells = search.run(folded.frame, grid, 2);
  ASSERT_EQ(cells.size(), DelayVelocitySearch::max_cells);
  for (std::size_t k = 1; k < cells.size(); ++k) {
    EXPECT_LE(cells[k].count, cells[k - 1].count);
    for (std::size_t m = 0; m < k; ++m) {
      const bool same = apart(cells[k].line.delay_ns, cells[m].line.delay_ns, 126) < 1.1 &&
                        std::abs(cells[k].line.walk_ns - cells[m].line.walk_ns) < 1.1;
      EXPECT_FALSE(same);
    }
  }
}

TEST(SearchGrid, IsNoCoarserThanAsked) {
  const SearchGrid grid = SearchGrid::cover(3780, 1, 50.03);
  EXPECT_EQ(grid.bins, 3780U);
  EXPECT_EQ(grid.slices, 64U);
  EXPECT_EQ(SearchGrid::cover(3780, 0.7, 0).slices, 1U);
  EXPECT_EQ(SearchGrid::cover(3780, 0.7, 0).bins, 5400U);
  EXPECT_EQ(SearchGrid::cover(10, 100, 0).bins, 1U);
}

}  // namespace
}  // namespace splid
