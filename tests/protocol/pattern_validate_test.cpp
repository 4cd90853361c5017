#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "protocol/pattern.hpp"
#include "protocol/pattern_make.hpp"

namespace splid {
namespace {

Pattern good_pattern() {
  Pattern pattern;
  pattern.mode = Mode::interleaved;
  pattern.unambiguous_delay_ps = 1'000;
  pattern.subperiods_ps = {500, 250};
  pattern.segments = {{1'000, {0, 250, 500, 999.5}, {1, 0, 0.5, 2}, 0}};
  pattern.calibrated_period_ps = 1'000.001;
  pattern.pulse = TabulatedPulse{-10, 0.5, {0, 1, 0}};
  return pattern;
}

Pattern good_mrr() {
  return make_mrr(std::vector<double>{90, 100}, std::vector<std::int64_t>{2, 3});
}

struct BadPattern {
  const char* name;
  std::function<void(Pattern&)> spoil;
  std::string message;
};

class BadPatterns : public testing::TestWithParam<BadPattern> {};

TEST_P(BadPatterns, AreNamed) {
  Pattern pattern = good_pattern();
  ASSERT_EQ(validate(pattern), std::nullopt);
  GetParam().spoil(pattern);
  EXPECT_EQ(validate(pattern).value_or("accepted"), GetParam().message);
}

const double infinite = HUGE_VAL;
const double nan = std::nan("");

INSTANTIATE_TEST_SUITE_P(
    EachBound, BadPatterns,
    testing::Values(
        BadPattern{"no_segment", [](Pattern& p) { p.segments.clear(); },
                   "/segments: empty; a pattern has at least one segment"},
        BadPattern{"two_segments", [](Pattern& p) { p.segments.push_back(p.segments[0]); },
                   "/segments: 2 segments; mode interleaved has exactly one"},
        BadPattern{"period_zero", [](Pattern& p) { p.segments[0].period_ps = 0; },
                   "/segments/0/period_ps: 0; it must be above 0 and at most 1000000000000 ps"},
        BadPattern{"period_nan", [](Pattern& p) { p.segments[0].period_ps = nan; },
                   "/segments/0/period_ps: not finite; it must be above 0 and at most "
                   "1000000000000 ps"},
        BadPattern{"period_huge", [](Pattern& p) { p.segments[0].period_ps = 1.5e12; },
                   "/segments/0/period_ps: 1500000000000; it must be above 0 and at most "
                   "1000000000000 ps"},
        BadPattern{"no_pulse",
                   [](Pattern& p) {
                     p.segments[0].pulse_times_ps.clear();
                     p.segments[0].amplitudes.clear();
                   },
                   "/segments/0/pulse_times_ps: empty; a segment has at least one pulse"},
        BadPattern{"time_negative", [](Pattern& p) { p.segments[0].pulse_times_ps[0] = -0.5; },
                   "/segments/0/pulse_times_ps/0: -0.5; it must be from 0 to below the segment's "
                   "period, 1000 ps"},
        BadPattern{"time_at_period", [](Pattern& p) { p.segments[0].pulse_times_ps[3] = 1'000; },
                   "/segments/0/pulse_times_ps/3: 1000; it must be from 0 to below the segment's "
                   "period, 1000 ps"},
        BadPattern{"time_nan", [](Pattern& p) { p.segments[0].pulse_times_ps[1] = nan; },
                   "/segments/0/pulse_times_ps/1: not finite; it must be from 0 to below the "
                   "segment's period, 1000 ps"},
        BadPattern{"time_equal", [](Pattern& p) { p.segments[0].pulse_times_ps[2] = 250; },
                   "/segments/0/pulse_times_ps/2: 250; it must be above the pulse before, 250 ps"},
        BadPattern{"amplitude_missing", [](Pattern& p) { p.segments[0].amplitudes.pop_back(); },
                   "/segments/0/amplitudes: 3 amplitudes; there must be one a pulse, 4"},
        BadPattern{"amplitude_negative", [](Pattern& p) { p.segments[0].amplitudes[1] = -1; },
                   "/segments/0/amplitudes/1: -1; it must be finite and at least 0"},
        BadPattern{"amplitude_infinite", [](Pattern& p) { p.segments[0].amplitudes[1] = infinite; },
                   "/segments/0/amplitudes/1: not finite; it must be finite and at least 0"},
        BadPattern{"amplitudes_zero",
                   [](Pattern& p) {
                     p.segments[0].amplitudes = {0, 0, 0, 0};
                   },
                   "/segments/0/amplitudes: all 0; one at least must be above 0"},
        BadPattern{"repeats_negative", [](Pattern& p) { p.segments[0].repeats = -1; },
                   "/segments/0/repeats: -1; it must be at least 0 and at most 1000000000 "
                   "(1 s in all)"},
        BadPattern{"repeats_huge", [](Pattern& p) { p.segments[0].repeats = INT64_MAX; },
                   "/segments/0/repeats: 9223372036854775807; it must be at least 0 and at most "
                   "1000000000 (1 s in all)"},
        BadPattern{"one_subperiod", [](Pattern& p) { p.subperiods_ps.pop_back(); },
                   "/subperiods_ps: 1 subperiods; mode interleaved needs two or more"},
        BadPattern{"subperiod_zero", [](Pattern& p) { p.subperiods_ps[1] = 0; },
                   "/subperiods_ps/1: 0; it must be above 0 and at most 1000 ps"},
        BadPattern{"subperiod_odd", [](Pattern& p) { p.subperiods_ps[1] = 251; },
                   "/subperiods_ps/1: 251; the pattern period, 1000 ps, must be a multiple of it"},
        BadPattern{"subperiods_of_random", [](Pattern& p) { p.mode = Mode::random; },
                   "/subperiods_ps: 2 subperiods; mode random has none"},
        BadPattern{"delay_zero", [](Pattern& p) { p.unambiguous_delay_ps = 0; },
                   "/unambiguous_delay_ps: 0; it must be above 0 and at most 1000 ps"},
        BadPattern{"delay_long", [](Pattern& p) { p.unambiguous_delay_ps = 1'000.5; },
                   "/unambiguous_delay_ps: 1000.5; it must be above 0 and at most 1000 ps"},
        BadPattern{"calibrated_off", [](Pattern& p) { p.calibrated_period_ps = 1'011; },
                   "/calibrated_period_ps: 1011; it must be within 1 % of the pattern period, "
                   "1000 ps"},
        BadPattern{"calibrated_nan", [](Pattern& p) { p.calibrated_period_ps = nan; },
                   "/calibrated_period_ps: not finite; it must be within 1 % of the pattern "
                   "period, 1000 ps"},
        BadPattern{"pulse_first", [](Pattern& p) { p.pulse->first_ps = infinite; },
                   "/pulse/first_ps: not finite; it must be finite"},
        BadPattern{"pulse_step", [](Pattern& p) { p.pulse->step_ps = 0; },
                   "/pulse/step_ps: 0; it must be above 0 and at most 1000000000000 ps"},
        BadPattern{"pulse_short", [](Pattern& p) { p.pulse->density = {1}; },
                   "/pulse/density: 1 values; a shape has at least 2"},
        BadPattern{"pulse_negative", [](Pattern& p) { p.pulse->density[0] = -1; },
                   "/pulse/density/0: -1; it must be finite and at least 0"},
        BadPattern{"pulse_zero", [](Pattern& p) { p.pulse->density[1] = 0; },
                   "/pulse/density: all 0; one at least must be above 0"}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(PatternValidate, Mrr) {
  EXPECT_EQ(validate(good_mrr()), std::nullopt);
  Pattern pattern = good_mrr();
  pattern.segments.pop_back();
  EXPECT_EQ(validate(pattern), "/segments: 1 segments; mode mrr needs two or more");
  pattern = good_mrr();
  pattern.segments[1].repeats = 0;
  EXPECT_EQ(validate(pattern),
            "/segments/1/repeats: 0; it must be at least 1, as there are several segments, and at "
            "most 10000000000 (1 s in all)");
  pattern = good_mrr();
  pattern.subperiods_ps.pop_back();
  EXPECT_EQ(validate(pattern), "/subperiods_ps: 1 subperiods; mode mrr needs one a segment");
  pattern = good_mrr();
  pattern.subperiods_ps[1] = 99;
  EXPECT_EQ(validate(pattern), "/subperiods_ps/1: 99; it must be the period of segment 1, 100 ps");
  pattern = good_mrr();
  pattern.segments[0].repeats = 11'111'111'111;
  pattern.segments[1].repeats = 10'000'000'000;
  EXPECT_EQ(validate(pattern),
            "/segments: 1999999999990; it must be above 0 and at most 1000000000000 ps");
}

TEST(PatternValidate, AStretchedSampleClockIsNoFault) {
  Pattern pattern = good_pattern();
  pattern.subperiods_ps = {500 * (1 + 5e-7), 250 * (1 - 5e-7)};
  EXPECT_EQ(validate(pattern), std::nullopt);
}

}  // namespace
}  // namespace splid
