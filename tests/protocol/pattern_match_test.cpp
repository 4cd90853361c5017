#include "protocol/pattern_match.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "protocol/pattern_make.hpp"

namespace splid {
namespace {

const Pattern interleaved_180_189 = make_interleaved(std::array{180e3, 189e3});

TEST(PatternMatch, IsWholeForTheSamePulsesTurnedAndMeasured) {
  EXPECT_EQ(share_of_same_pulses(interleaved_180_189, interleaved_180_189), 1);
  Pattern calibrated = interleaved_180_189;
  PatternSegment& segment = calibrated.segments.front();
  segment.period_ps *= 1 + 30e-6;
  for (double& time_ps : segment.pulse_times_ps) {
    time_ps = std::fmod(time_ps * (1 + 30e-6) + 1'898'123, segment.period_ps);
    time_ps += time_ps > 1e6 ? 40 : -20;
  }
  std::sort(segment.pulse_times_ps.begin(), segment.pulse_times_ps.end());
  EXPECT_EQ(share_of_same_pulses(interleaved_180_189, calibrated), 1);
  EXPECT_EQ(share_of_same_pulses(calibrated, interleaved_180_189), 1);
}

TEST(PatternMatch, IsSmallForOtherPulses) {
  const Pattern random = make_random({3'780'000, 40, 9'000, 1});
  EXPECT_LT(share_of_same_pulses(interleaved_180_189, random), 0.3);
  EXPECT_NEAR(
      share_of_same_pulses(interleaved_180_189, make_periodic(Mode::baseline, 3'780'000, 1)),
      1.0 / 40, 1e-12);
}

TEST(PatternMatch, IsNoneForAnotherPeriodOrOtherSegments) {
  EXPECT_EQ(share_of_same_pulses(make_periodic(Mode::baseline, 1e6, 1),
                                 make_periodic(Mode::baseline, 1.001e6, 1)),
            0);
  const std::array<std::int64_t, 2> repeats{1, 1}, others{2, 2};
  const Pattern in_turn = make_mrr(std::array{90e3, 100e3}, repeats);
  EXPECT_EQ(share_of_same_pulses(in_turn, in_turn), 1);
  EXPECT_EQ(share_of_same_pulses(in_turn, make_mrr(std::array{100e3, 90e3}, repeats)), 0);
  EXPECT_EQ(share_of_same_pulses(in_turn, make_mrr(std::array{90e3, 100e3}, others)), 0);
  EXPECT_EQ(share_of_same_pulses(in_turn, make_periodic(Mode::baseline, 190e3, 1)), 0);
}

}  // namespace
}  // namespace splid
