#include "estimator/model/comb.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "estimator/model/pulse_train.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

TEST(Comb, KeepsThePulsesThatShine) {
  const Comb comb(PatternSegment{100000, {0, 20000, 50000, 90000}, {1, 0, 0.5, 2}, 0});
  EXPECT_EQ(comb.times_ns, (std::vector<double>{0, 50, 90}));
  EXPECT_EQ(comb.amplitudes, (std::vector<double>{1, 0.5, 2}));
  EXPECT_DOUBLE_EQ(comb.total_amplitude, 3.5);
  EXPECT_DOUBLE_EQ(comb.closest_ns, 10);  // from 90 over the end to 100
  EXPECT_FALSE(comb.uniform);
}

TEST(Comb, InterleavedPatternOfThePaperHasFortyPulsesNineNsApart) {
  const Comb comb(test::interleaved_pattern({180000, 189000}, 3780000).segments.front());
  EXPECT_EQ(comb.times_ns.size(), 40U);
  EXPECT_DOUBLE_EQ(comb.closest_ns, 9);
  EXPECT_TRUE(comb.uniform);
}

TEST(Comb, NearlyEvenPulsesHaveNearCopies) {
  // The four pulses of a real source, 3128 ps apart to within 60 ps.
  const Comb even(PatternSegment{12512.6, {1415, 4530, 7692, 10764}, {1, 1, 1, 1}, 0});
  const auto copies = strong_side_lobes_ns(even, 0.3);
  ASSERT_EQ(copies.size(), 3U);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(copies[k], 3.128 * (k + 1), 0.05);
  EXPECT_TRUE(strong_side_lobes_ns(even, 0.005).empty());
}

TEST(Comb, InterleavedAndRandomPulsesHaveNoNearCopies) {
  EXPECT_TRUE(strong_side_lobes_ns(
                  Comb(test::interleaved_pattern({180000, 189000}, 3780000).segments.front()), 0.3)
                  .empty());
  EXPECT_TRUE(
      strong_side_lobes_ns(Comb(test::random_pattern(3780000, 40, 9000, 3).segments.front()), 0.3)
          .empty());
  EXPECT_TRUE(
      strong_side_lobes_ns(Comb(test::periodic_pattern(3780000).segments.front()), 0.3).empty());
}

// Against looking at every pulse and every turn.
void expect_all_pulses_found(const Comb& comb, double first_ns, double last_ns) {
  const CombWindow window(comb, first_ns, last_ns);
  std::mt19937 random(7);
  std::uniform_int_distribution<std::uint32_t> anywhere;
  std::size_t hits = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const std::uint32_t phase_32 = trial == 0 ? 0 : trial == 1 ? 0xffffffffU : anywhere(random);
    const double phase = phase_32 * comb.period_ns * 0x1p-32;
    std::multiset<double> expected, found;
    const int turns = 2 + static_cast<int>((last_ns - first_ns) / comb.period_ns);
    for (int turn = -turns; turn <= turns; ++turn) {
      for (const double time : comb.times_ns) {
        const double residual = phase - time - turn * comb.period_ns;
        if (residual >= first_ns && residual <= last_ns)
          expected.insert(std::round(residual * 1e6));
      }
    }
    for (const auto& pulse : window.candidates(phase_32)) {
      const double residual = phase - pulse.time_ns;
      if (residual >= first_ns && residual <= last_ns) found.insert(std::round(residual * 1e6));
    }
    ASSERT_EQ(found, expected) << phase;
    hits += expected.size();
    if (!expected.empty()) {
      ASSERT_EQ(window.flags()[phase_32 >> window.shift()], 1);
    }
    ASSERT_LE(found.size(), window.max_overlap());
  }
  EXPECT_GT(hits, 0U);
}

TEST(CombWindow, FindsEveryPulseInReach) {
  const Comb interleaved(test::interleaved_pattern({180000, 189000}, 3780000).segments.front());
  expect_all_pulses_found(interleaved, -1, 1);
  expect_all_pulses_found(interleaved, -0.2, 3);  // lopsided, as a pulse with a tail
  expect_all_pulses_found(interleaved, -50, 50);  // wider than the pulses are apart
  const Comb single(test::periodic_pattern(12000).segments.front());
  expect_all_pulses_found(single, -1, 1);
  expect_all_pulses_found(single, -30, 30);  // wider than the period
}

TEST(CombWindow, FlagsLeaveMostOfTheBackgroundOut) {
  const Comb comb(test::interleaved_pattern({180000, 189000}, 3780000).segments.front());
  const CombWindow window(comb, -1, 1);
  int flagged = 0;
  const int buckets = 1 << (32 - window.shift());
  for (int k = 0; k < buckets; ++k) flagged += window.flags()[k];
  // 40 windows of 2 ns, each up to a bucket wider at either end, in 3780 ns.
  EXPECT_LT(flagged, buckets * 40 * 4 / 3780);
}

}  // namespace
}  // namespace splid
