#include "protocol/pattern_make.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/pattern_json.hpp"

namespace splid {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

using Doubles = std::vector<double>;
using Counts = std::vector<std::int64_t>;

template <class Make>
std::string error_of(Make make) {
  try {
    (void)make();
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::usage);
    return error.what();
  }
  return "no error";
}

// Of neighbours, the last pulse and the next period's first included.
double closest_ps(const PatternSegment& segment) {
  const Doubles& times_ps = segment.pulse_times_ps;
  double closest = times_ps.front() + segment.period_ps - times_ps.back();
  for (std::size_t i = 1; i < times_ps.size(); ++i) {
    closest = std::min(closest, times_ps[i] - times_ps[i - 1]);
  }
  return closest;
}

TEST(MakePeriodic, Baseline) {
  const Pattern pattern = make_periodic(Mode::baseline, 3'780'000);
  EXPECT_EQ(validate(pattern), std::nullopt);
  EXPECT_EQ(pattern.mode, Mode::baseline);
  EXPECT_EQ(pattern.unambiguous_delay_ps, 3'780'000);
  EXPECT_THAT(pattern.segments[0].pulse_times_ps, ElementsAre(0));
  EXPECT_THAT(pattern.segments[0].amplitudes, ElementsAre(1));
  EXPECT_EQ(pattern.segments[0].repeats, 0);
}

TEST(MakePeriodic, SeveralPulsesDivideTheUnambiguousDelay) {
  const Pattern pattern = make_periodic(Mode::ambiguous, 100.5, 3);
  EXPECT_EQ(validate(pattern), std::nullopt);
  EXPECT_EQ(pattern.unambiguous_delay_ps, 33.5);
  EXPECT_THAT(pattern.segments[0].pulse_times_ps, ElementsAre(0, 33.5, 67));
}

TEST(MakePeriodic, Refuses) {
  EXPECT_THAT(error_of([] { return make_periodic(Mode::random, 100); }), HasSubstr("mode random"));
  EXPECT_THAT(error_of([] { return make_periodic(Mode::baseline, 0); }), HasSubstr("period of 0"));
  EXPECT_THAT(error_of([] { return make_periodic(Mode::baseline, 1e13); }), HasSubstr("1e12"));
  EXPECT_THAT(error_of([] { return make_periodic(Mode::baseline, 100, 0); }),
              HasSubstr("0 pulses"));
}

TEST(MakeInterleaved, TheSetOfTheSetUp) {
  const Pattern pattern = make_interleaved(Doubles{180'000, 189'000});
  EXPECT_EQ(validate(pattern), std::nullopt);
  EXPECT_EQ(pattern.mode, Mode::interleaved);
  EXPECT_EQ(pattern.unambiguous_delay_ps, 3'780'000);
  EXPECT_THAT(pattern.subperiods_ps, ElementsAre(180'000, 189'000));
  const PatternSegment& segment = pattern.segments[0];
  EXPECT_EQ(segment.period_ps, 3'780'000);
  ASSERT_EQ(segment.pulse_times_ps.size(), 40U);
  EXPECT_EQ(closest_ps(segment), 9'000);
  for (const double time_ps : segment.pulse_times_ps) {
    const auto t_ps = static_cast<std::int64_t>(time_ps);
    EXPECT_TRUE(t_ps % 180'000 == 0 || t_ps % 189'000 == 0) << t_ps;
  }
}

TEST(MakeInterleaved, ThreePeriods) {
  const Pattern pattern = make_interleaved(Doubles{6, 4, 3});
  EXPECT_EQ(pattern.segments[0].period_ps, 12);
  EXPECT_THAT(pattern.segments[0].pulse_times_ps, ElementsAre(0, 3, 4, 6, 8, 9));
}

TEST(MakeInterleaved, Refuses) {
  EXPECT_THAT(error_of([] { return make_interleaved(Doubles{180}); }), HasSubstr("two or more"));
  EXPECT_THAT(error_of([] {
                return make_interleaved(Doubles{180, 180});
              }),
              HasSubstr("given twice"));
  EXPECT_THAT(error_of([] {
                return make_interleaved(Doubles{180, 180.5});
              }),
              HasSubstr("180.5 ps; it must be a whole number"));
  EXPECT_THAT(error_of([] { return make_interleaved(Doubles{180, -1}); }), HasSubstr("-1 ps"));
  EXPECT_THAT(error_of([] {
                return make_interleaved(Doubles{999'999'999'989, 999'999'999'961});
              }),
              HasSubstr("least common multiple"));
  EXPECT_THAT(error_of([] {
                return make_interleaved(Doubles{2, 999'999'999'999});
              }),
              HasSubstr("least common multiple"));
  EXPECT_THAT(error_of([] {
                return make_interleaved(Doubles{1, 10'000'000});
              }),
              HasSubstr("10000000 pulses"));
}

TEST(MakeRandom, KeepsTheSpacingAroundTheCircle) {
  RandomPatternOptions options;
  for (options.seed = 1; options.seed <= 200; ++options.seed) {
    const Pattern pattern = make_random(options);
    ASSERT_EQ(validate(pattern), std::nullopt);
    ASSERT_EQ(pattern.segments[0].pulse_times_ps.size(), 40U);
    ASSERT_EQ(pattern.segments[0].pulse_times_ps.front(), 0);
    ASSERT_GE(closest_ps(pattern.segments[0]), 9'000);
  }
}

TEST(MakeRandom, TheSeedDecides) {
  RandomPatternOptions options;
  EXPECT_EQ(make_random(options), make_random(options));
  RandomPatternOptions other;
  other.seed = 2;
  EXPECT_NE(make_random(options), make_random(other));
}

// With n pulses the gaps after the spacing share the spare time evenly: each is spare / n in the
// mean.
TEST(MakeRandom, GapsAreAlikeOnAverage) {
  RandomPatternOptions options;
  options.pulses = 5;
  options.period_ps = 100'000;
  options.min_spacing_ps = 10'000;
  std::vector<double> sums(5, 0);
  constexpr int rounds = 4'000;
  for (options.seed = 1; options.seed <= rounds; ++options.seed) {
    const Doubles times_ps = make_random(options).segments[0].pulse_times_ps;
    for (std::size_t i = 0; i < 5; ++i) {
      sums[i] += (i < 4 ? times_ps[i + 1] : options.period_ps) - times_ps[i];
    }
  }
  // One gap spreads by 8165 ps, so the mean by 129 ps.
  for (const double sum : sums) EXPECT_NEAR(sum / rounds, 20'000, 5 * 129);
}

TEST(MakeRandom, FillsThePeriodWhereThereIsNoSpareTime) {
  RandomPatternOptions options;
  options.pulses = 4;
  options.period_ps = 40;
  options.min_spacing_ps = 10;
  EXPECT_THAT(make_random(options).segments[0].pulse_times_ps, ElementsAre(0, 10, 20, 30));
  options.min_spacing_ps = 9.5;
  EXPECT_THAT(make_random(options).segments[0].pulse_times_ps, ElementsAre(0, 10, 20, 30));
}

TEST(MakeRandom, Refuses) {
  const auto with = [](double period_ps, std::size_t pulses, double spacing_ps) {
    return error_of([=] { return make_random({period_ps, pulses, spacing_ps, 1}); });
  };
  EXPECT_THAT(with(40, 5, 10), HasSubstr("at most 4 do"));
  EXPECT_THAT(with(40, 0, 10), HasSubstr("0 pulses"));
  EXPECT_THAT(with(40.5, 1, 10), HasSubstr("40.5"));
  EXPECT_THAT(with(40, 1, 0), HasSubstr("spacing of 0"));
  EXPECT_THAT(with(40, 1, 41), HasSubstr("spacing of 41"));
}

TEST(MakeStratified, OnePulseASlot) {
  RandomPatternOptions options;
  for (options.seed = 1; options.seed <= 100; ++options.seed) {
    const Pattern pattern = make_stratified(options);
    ASSERT_EQ(validate(pattern), std::nullopt);
    for (std::size_t i = 0; i < 40; ++i) {
      const double time_ps = pattern.segments[0].pulse_times_ps[i];
      ASSERT_GE(time_ps, static_cast<double>(i) * 94'500);
      ASSERT_LT(time_ps, static_cast<double>(i + 1) * 94'500);
    }
  }
  EXPECT_THAT(error_of([] { return make_stratified({10, 11, 1, 1}); }), HasSubstr("11 pulses"));
}

TEST(MakeMrr, PeriodsInTurn) {
  const Pattern pattern = make_mrr(Doubles{90'000, 94'500, 100'000}, Counts{100, 200, 300});
  EXPECT_EQ(validate(pattern), std::nullopt);
  EXPECT_EQ(pattern.mode, Mode::mrr);
  EXPECT_EQ(pattern.unambiguous_delay_ps, 18'900'000);
  EXPECT_THAT(pattern.subperiods_ps, ElementsAre(90'000, 94'500, 100'000));
  EXPECT_EQ(pattern.segments[2], (PatternSegment{100'000, {0}, {1}, 300}));
  EXPECT_EQ(pattern_period_ps(pattern), 9'000'000 + 18'900'000 + 30'000'000);
  EXPECT_EQ(pulses_per_period(pattern), 600U);
}

TEST(MakeMrr, Refuses) {
  EXPECT_THAT(error_of([] { return make_mrr(Doubles{90}, Counts{1}); }), HasSubstr("two or more"));
  EXPECT_THAT(error_of([] {
                return make_mrr(Doubles{90, 91}, Counts{1});
              }),
              HasSubstr("1 repeat counts for 2 periods"));
  EXPECT_THAT(error_of([] {
                return make_mrr(Doubles{90, 91}, Counts{1, 0});
              }),
              HasSubstr("0 repeats of 91"));
  EXPECT_THAT(error_of([] {
                return make_mrr(Doubles{180e6, 189e6}, Counts{4000, 4000});
              }),
              HasSubstr("4000 repeats of 189000000 ps; there must be at least 1, and together"));
  // Of the 288 divisors of this number of ps.
  Doubles periods_ps;
  for (std::int64_t i = 1; periods_ps.size() < 256; ++i) {
    if (1'441'440 % i == 0) periods_ps.push_back(static_cast<double>(i));
  }
  EXPECT_THAT(error_of([&] { return make_mrr(periods_ps, Counts(256, 1)); }),
              HasSubstr("256 segments; there must be at most 255"));
}

// The shipped files are what the functions here make.
TEST(PatternMake, ShippedPatterns) {
  const auto shipped = [](const std::string& name) {
    std::ifstream stream(SPLID_SOURCE_DIR "/config/patterns/" + name);
    return std::string{std::istreambuf_iterator<char>(stream), {}};
  };
  EXPECT_EQ(shipped("interleaved-180-189.json"),
            to_json_file(make_interleaved(Doubles{180'000, 189'000})));
  EXPECT_EQ(shipped("random-40.json"), to_json_file(make_random({})));
  EXPECT_EQ(shipped("periodic-3780.json"), to_json_file(make_periodic(Mode::baseline, 3'780'000)));
  EXPECT_EQ(shipped("ambiguous-94.5.json"),
            to_json_file(make_periodic(Mode::ambiguous, 3'780'000, 40)));
}

}  // namespace
}  // namespace splid
