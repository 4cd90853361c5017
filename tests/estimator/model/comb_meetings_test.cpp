#include "estimator/model/comb_meetings.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

// The share of the pulses of a target at `place_ns` that come with those of one of the two.
double share_met(const Pattern& pattern, double place_ns, const std::vector<double>& targets_ns) {
  const std::vector<double>& times_ps = pattern.segments.front().pulse_times_ps;
  const double period_ns = static_cast<double>(pattern.segments.front().period_ps) * 1e-3;
  int met = 0;
  for (const double time_ps : times_ps) {
    met += std::any_of(targets_ns.begin(), targets_ns.end(), [&](double target_ns) {
      return std::any_of(times_ps.begin(), times_ps.end(), [&](double other_ps) {
        const double apart_ns = place_ns + (time_ps - other_ps) * 1e-3 - target_ns;
        return std::abs(std::remainder(apart_ns, period_ns)) < 0.4;
      });
    });
  }
  return met / static_cast<double>(times_ps.size());
}

TEST(CombMeetings, OfTwoRatesAreTwoWhereDelaysDifferByAMultipleOfTheirDifference) {
  const Pattern pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  const PulseTrain train(pattern);
  const CombMeetings meetings(train, 0.1);
  const auto find = [&](double one_ns, double other_ns) {
    const CombMeetings::Places places = meetings.find(one_ns, other_ns);
    return std::vector<double>(places.delays_ns().begin(), places.delays_ns().end());
  };
  for (const double apart_ns : {63.0, -252.0, 1044.1, 9.0}) {
    const double one_ns = 1900, other_ns = one_ns + apart_ns;
    std::vector<double> places_ns = find(one_ns, other_ns);
    ASSERT_EQ(places_ns.size(), 2U) << apart_ns;
    for (const double place_ns : places_ns) {
      EXPECT_EQ(share_met(pattern, place_ns, {one_ns, other_ns}), 1) << apart_ns;
      EXPECT_LT(share_met(pattern, place_ns, {one_ns}), 0.6) << apart_ns;
      EXPECT_LT(share_met(pattern, place_ns, {other_ns}), 0.6) << apart_ns;
    }
    // And the two are where the combs of these places meet.
    places_ns = find(places_ns[0], places_ns[1]);
    ASSERT_EQ(places_ns.size(), 2U) << apart_ns;
    std::sort(places_ns.begin(), places_ns.end());
    EXPECT_NEAR(places_ns[0], std::min(one_ns, other_ns), 0.2) << apart_ns;
    EXPECT_NEAR(places_ns[1], std::max(one_ns, other_ns), 0.2) << apart_ns;
  }
  // Delays that differ by a multiple of a period meet at their own places alone.
  for (const double apart_ns : {360.0, 189.0, 100.0, 67.5}) {
    EXPECT_TRUE(find(1900, 1900 + apart_ns).empty()) << apart_ns;
  }
}

// With rates of 99.9 and 104.1 ns there are delays at which the comb is nearly its own copy: off by
// 0.3 ns, three pulse widths, at one of the rates. What is there has nearly all of a target's
// light.
TEST(CombMeetings, NearCopiesOfOneTargetAreNotWhereTwoMeet) {
  const PulseTrain train(test::interleaved_pattern({99900, 104100}, 34665300));
  const CombMeetings meetings(train, 0.1);
  const double place_ns = 1000;
  std::vector<double> copies_ns;
  for (const auto& [period_ns, other_ns] : {std::pair{99.9, 104.1}, std::pair{104.1, 99.9}}) {
    for (double shift_ns = period_ns; shift_ns < 34665; shift_ns += period_ns) {
      const double off_ns = std::abs(std::remainder(shift_ns, other_ns));
      if (std::abs(off_ns - 0.3) < 0.01) copies_ns.push_back(place_ns + shift_ns);
    }
  }
  ASSERT_EQ(copies_ns.size(), 4U);
  for (const double one_ns : copies_ns) {
    for (const double other_ns : copies_ns) {
      EXPECT_FALSE(meetings.do_meet(one_ns, other_ns, place_ns)) << one_ns << ", " << other_ns;
    }
  }
}

// A target at one place and a part of another's light may look like one that is not there: the
// place of the other is where their combs meet.
TEST(CombMeetings, TellWhereTheLightOfAWrongPlaceComesFrom) {
  const Pattern pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  const CombMeetings meetings(PulseTrain(pattern), 0.1);
  const double right_ns = 1900;
  const double wrong_ns = right_ns - 7 * 189, other_ns = right_ns + 2 * 180;
  EXPECT_TRUE(meetings.do_meet(wrong_ns, other_ns, right_ns));
  EXPECT_TRUE(meetings.do_meet(wrong_ns, other_ns, right_ns + 3780.1));
  EXPECT_FALSE(meetings.do_meet(wrong_ns, other_ns, right_ns + 1));
}

TEST(CombMeetings, OfThreeRatesNeedAllOfThem) {
  const PulseTrain train(test::interleaved_pattern({180000, 189000, 200000}, 37800000));
  const CombMeetings meetings(train, 0.1);
  // One rate of the second target, and two of the first, meet where 180 and 189 ns come together.
  const CombMeetings::Places places = meetings.find(1900, 1900 + 3780 + 3 * 200);
  ASSERT_FALSE(places.delays_ns().empty());
  for (const double place_ns : places.delays_ns()) {
    for (const double period_ns : {180.0, 189.0, 200.0}) {
      const double to_one = std::abs(std::remainder(place_ns - 1900, period_ns));
      const double to_other = std::abs(std::remainder(place_ns - 6280, period_ns));
      EXPECT_LT(std::min(to_one, to_other), 0.31);
    }
  }
  // 180 and 189 ns differ by multiples of 9 ns, and 180 and 200 ns by multiples of 20 ns.
  EXPECT_TRUE(meetings.find(1900, 1900 + 7).delays_ns().empty());
}

// 124 periods of the one rate are 119 of the other to within 0.3 ns: a side lobe of a
// target's comb, which is no meeting with another's.
TEST(CombMeetings, SideLobesOfATargetAreNone) {
  const PulseTrain train(test::interleaved_pattern({99900, 104100}, 34665300));
  const CombMeetings meetings(train, 0.11);
  for (const double other_ns : {1900 + 42.0, 1900 + 5000.1}) {
    for (const double target_ns : {1900.0, other_ns}) {
      EXPECT_FALSE(meetings.do_meet(1900, other_ns, target_ns + 12387.75)) << other_ns;
    }
  }
}

TEST(CombMeetings, PatternsOfOneRateHaveNone) {
  Pattern pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  pattern.mode = Mode::random;
  pattern.subperiods_ps.clear();
  const CombMeetings meetings(PulseTrain(pattern), 0.1);
  EXPECT_TRUE(meetings.find(1900, 1963).delays_ns().empty());
}

}  // namespace
}  // namespace splid
