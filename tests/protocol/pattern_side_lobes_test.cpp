#include "protocol/pattern_side_lobes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "protocol/pattern_make.hpp"
#include "tests/support/sanitized.hpp"

namespace splid {
namespace {

Pattern of_times(double period_ps, const std::vector<double>& times_ps) {
  Pattern pattern = make_periodic(Mode::baseline, period_ps);
  pattern.segments[0].pulse_times_ps = times_ps;
  pattern.segments[0].amplitudes.assign(times_ps.size(), 1);
  return pattern;
}

// By the definition alone: pulses turned on by each shift, and how many then lie on another.
std::size_t pairs_by_hand(const Pattern& pattern, double window_ps) {
  const PatternSegment& segment = pattern.segments.front();
  std::size_t most = 0;
  // In half picoseconds, from beyond the main lobe's own window.
  for (double shift = window_ps / 2 + 0.5; shift < segment.period_ps - window_ps / 2;
       shift += 0.5) {
    std::size_t pairs = 0;
    for (const double a : segment.pulse_times_ps) {
      for (const double b : segment.pulse_times_ps) {
        const double turned = std::fmod(a + shift, segment.period_ps);
        const double apart = std::abs(turned - b);
        pairs += std::min(apart, segment.period_ps - apart) <= window_ps / 2 ? 1 : 0;
      }
    }
    most = std::max(most, pairs);
  }
  return most;
}

TEST(SideLobes, OfTheInterleavedPatternIsItsDenserTrain) {
  const auto lobe = highest_side_lobe(make_interleaved(std::array{180e3, 189e3}));
  ASSERT_TRUE(lobe);
  EXPECT_EQ(lobe->pairs, 21U);  // 180 ns on, all 21 of the 180 ns train
  EXPECT_EQ(lobe->relative, 21.0 / 40);
  EXPECT_EQ(lobe->shift_ps, 180'000);
}

TEST(SideLobes, OfEvenPulsesAreAsHighAsTheMainLobe) {
  const auto lobe = highest_side_lobe(make_periodic(Mode::ambiguous, 3'780'000, 40));
  ASSERT_TRUE(lobe);
  EXPECT_EQ(lobe->pairs, 40U);
  EXPECT_EQ(lobe->shift_ps, 94'500);
}

TEST(SideLobes, AreThoseCountedByHand) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Pattern pattern = make_random({2'000, 12, 60, seed});
    const auto lobe = highest_side_lobe(pattern, 20);
    ASSERT_TRUE(lobe);
    EXPECT_EQ(lobe->pairs, pairs_by_hand(pattern, 20)) << seed;
    EXPECT_GT(lobe->pairs, 1U);
  }
}

TEST(SideLobes, CountPulsesWithinTheWindow) {
  // Gaps of 300 and 330 of 1000: 30 apart.
  const Pattern pattern = of_times(1'000, {0, 300, 630});
  EXPECT_EQ(highest_side_lobe(pattern, 29)->pairs, 1U);
  const auto lobe = highest_side_lobe(pattern, 30);
  EXPECT_EQ(lobe->pairs, 2U);
  EXPECT_EQ(lobe->shift_ps, 315);
}

TEST(SideLobes, AreNotSaidWhereThereAreNone) {
  EXPECT_FALSE(highest_side_lobe(make_periodic(Mode::baseline, 1'000)));
  EXPECT_FALSE(
      highest_side_lobe(make_mrr(std::array{90.0, 100.0}, std::array<std::int64_t, 2>{1, 1})));
#ifndef SPLID_SANITIZED  // sorts four million differences; before a release
  EXPECT_TRUE(highest_side_lobe(make_periodic(Mode::ambiguous, 1e6, 2'000)));
#endif
  EXPECT_FALSE(highest_side_lobe(make_periodic(Mode::ambiguous, 1e6, 2'001)));
}

}  // namespace
}  // namespace splid
