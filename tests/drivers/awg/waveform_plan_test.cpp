#include "drivers/awg/waveform_plan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "protocol/error.hpp"
#include "protocol/pattern_make.hpp"
#include "tests/support/error_text.hpp"

namespace splid::awg {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

using Counts = std::array<std::int64_t, 2>;

const Model& m8195a = models()[0];
const Model& m8195a_extended = models()[1];
const Model& m8190a = models()[2];

std::string refusal(const Pattern& pattern, const Model& model, const Options& options = {}) {
  try {
    plan_waveform(pattern, model, options);
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::data);
    return error.what();
  }
  return "";
}

// What holds of every plan.
void check(const WaveformPlan& plan, const Pattern& pattern, const Model& model) {
  EXPECT_EQ(plan.samples() % model.granule_samples, 0);
  EXPECT_GE(plan.samples(), model.min_samples);
  EXPECT_LE(plan.samples(), model.max_samples);
  EXPECT_GE(plan.rate_hz, model.min_rate_hz);
  EXPECT_LE(plan.rate_hz, model.max_rate_hz);
  EXPECT_EQ(plan.pulse_starts.size(), pulses_per_period(pattern));
  const double period_ps = static_cast<double>(plan.samples_per_period) / plan.rate_hz * 1e12;
  EXPECT_NEAR(period_ps, pattern_period_ps(pattern), 1e-15 * period_ps);
  EXPECT_LE(plan.max_deviation_ps, 0.5e12 / plan.rate_hz);
}

TEST(WaveformPlan, TheInterleavedSetUpIsPlayedExactly) {
  const Pattern pattern = make_interleaved(std::array{180e3, 189e3});
  const WaveformPlan plan = plan_waveform(pattern, m8195a, {});
  check(plan, pattern, m8195a);
  // All pulses are at whole multiples of 9 ns: 576 samples of 64 GSa/s, 420 of them a period.
  EXPECT_EQ(plan.samples_per_period, 241'920);
  EXPECT_EQ(plan.periods, 1);
  EXPECT_NEAR(plan.rate_hz, 64e9, 1);
  EXPECT_NEAR(plan.max_deviation_ps, 0, 1e-6);
  EXPECT_EQ(plan.pulse_samples, 128);
  EXPECT_EQ(plan.marker_samples, 640);
  EXPECT_EQ(plan.pulse_starts[1], 180 * 64);
  const Pattern played = played_pattern(pattern, plan, plan.rate_hz);
  ASSERT_EQ(played.segments[0].pulse_times_ps.size(), 40U);
  for (std::size_t i = 0; i < 40; ++i) {
    EXPECT_NEAR(played.segments[0].pulse_times_ps[i], pattern.segments[0].pulse_times_ps[i], 1e-6);
  }
  EXPECT_EQ(played.segments[0].period_ps, 3'780'000);
  EXPECT_EQ(played.mode, Mode::interleaved);
  EXPECT_EQ(played.subperiods_ps, pattern.subperiods_ps);
}

TEST(WaveformPlan, RandomPulsesAreWithinHalfASample) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Pattern pattern = make_random({3'780'000, 40, 9'000, seed});
    const WaveformPlan plan = plan_waveform(pattern, m8195a, {});
    check(plan, pattern, m8195a);
    const Pattern played = played_pattern(pattern, plan, plan.rate_hz);
    EXPECT_FALSE(validate(played));
    double worst_ps = 0;
    for (std::size_t i = 0; i < 40; ++i) {
      worst_ps = std::max(worst_ps, std::abs(played.segments[0].pulse_times_ps[i] -
                                             pattern.segments[0].pulse_times_ps[i]));
    }
    EXPECT_NEAR(worst_ps, plan.max_deviation_ps, 1e-6);
    // Of several hundred rates the best is better than one picked at random, half a sample.
    EXPECT_LT(worst_ps, 0.5e12 / plan.rate_hz - 0.1);
  }
}

TEST(WaveformPlan, ShortPeriodsAreHeldSeveralTimes) {
  const Pattern pattern = make_periodic(Mode::baseline, 10'000);
  Options options;
  options.marker_width_ns = 3;
  const WaveformPlan plan = plan_waveform(pattern, m8195a, options);
  check(plan, pattern, m8195a);
  EXPECT_EQ(plan.samples_per_period, 640);  // 64 GSa/s, five granules
  EXPECT_EQ(plan.periods, 2);               // 1280 samples at least
  // No multiple of 128 between 53.76 and 65 GSa/s: 2 copies of 64 n, and so on.
  const Pattern odd = make_periodic(Mode::baseline, 9'800);
  const WaveformPlan copies = plan_waveform(odd, m8195a, options);
  check(copies, odd, m8195a);
  EXPECT_NE(copies.samples_per_period % 128, 0);
  EXPECT_GT(copies.periods, 1);
}

TEST(WaveformPlan, MrrAsFarAsMemoryAllows) {
  const std::array periods_ps{180e3, 189e3};
  const Pattern fits = make_mrr(periods_ps, Counts{10, 10});
  const WaveformPlan plan = plan_waveform(fits, m8195a, {});
  check(plan, fits, m8195a);
  EXPECT_NEAR(plan.max_deviation_ps, 0, 1e-6);
  EXPECT_EQ(played_pattern(fits, plan, plan.rate_hz), fits);

  const Pattern large = make_mrr(periods_ps, Counts{2'778, 2'646});
  EXPECT_THAT(refusal(large, m8195a),
              AllOf(HasSubstr("awg m8195a: a pattern of 1000134 ns is 53767204 samples"),
                    HasSubstr("holds 262144; the longest that fits is 4876.19 ns"),
                    HasSubstr("as with repeats 13, 12")));
  check(plan_waveform(make_mrr(periods_ps, Counts{13, 12}), m8195a, {}),
        make_mrr(periods_ps, Counts{13, 12}), m8195a);
  check(plan_waveform(large, m8195a_extended, {}), large, m8195a_extended);
  const WaveformPlan slow = plan_waveform(large, m8190a, {});
  check(slow, large, m8190a);
  EXPECT_EQ(slow.samples_per_period, 8'001'072);  // 8 GSa/s, 48 * 166689
  EXPECT_NEAR(slow.max_deviation_ps, 0, 1e-5);

  const Pattern long_ones = make_mrr(std::array{4e6, 5e6}, Counts{1, 1});
  EXPECT_THAT(refusal(long_ones, m8195a), HasSubstr("not even one of each segment does"));
}

TEST(WaveformPlan, NamesPulsesThatAreTooClose) {
  Pattern pattern = make_interleaved(std::array{180e3, 189e3});
  Options options;
  options.min_spacing_ns = 9.001;
  EXPECT_THAT(refusal(pattern, m8195a, options),
              HasSubstr("pulse 1 at 180 ns and pulse 2 at 189 ns are 9 ns apart; "
                        "awg.min_spacing_ns is 9.001"));
  // The last and the first of the next period.
  EXPECT_THAT(
      refusal(make_periodic(Mode::baseline, 8'900), m8195a),
      HasSubstr("pulse 0 at 0 ns and pulse 0 of the next period at 8.9 ns are 8.9 ns apart"));
  options.min_spacing_ns = 1;
  options.pulse_width_ns = 9;
  EXPECT_THAT(refusal(pattern, m8195a, options),
              HasSubstr("pulse 1 of 9 ns reaches the next; awg.pulse_width_ns must be below 8.98"));
}

// Pairs of pulses, the same time apart, at any places between the samples.
Pattern pairs(double apart_ps, int count) {
  Pattern pattern = make_periodic(Mode::baseline, 3'780'000);
  pattern.mode = Mode::random;
  PatternSegment& segment = pattern.segments.front();
  segment.pulse_times_ps.clear();
  for (int i = 0; i < count; ++i) {
    const double time_ps = 37'000.0 * i + std::fmod(7.3183 * i * i, 29.0);
    segment.pulse_times_ps.push_back(time_ps);
    segment.pulse_times_ps.push_back(time_ps + apart_ps);
  }
  segment.amplitudes.assign(segment.pulse_times_ps.size(), 1);
  return pattern;
}

double least_played_ns(const WaveformPlan& plan) {
  double least_ns = 1e9;
  for (std::size_t i = 1; i < plan.pulse_starts.size(); ++i) {
    least_ns =
        std::min(least_ns, static_cast<double>(plan.pulse_starts[i] - plan.pulse_starts[i - 1]) /
                               plan.rate_hz * 1e9);
  }
  return least_ns;
}

// The grid nearest to the pulses' times would play the pairs 8.9598 ns apart.
TEST(WaveformPlan, PulsesAsTheyArePlayedKeepTheirDistance) {
  Options options;
  options.min_spacing_ns = 8.96;
  const WaveformPlan plan = plan_waveform(pairs(8'960, 100), models()[0], options);
  EXPECT_GE(least_played_ns(plan), 8.96 - 1e-6);
  // Few rates are left, and at none of them.
  options.pulse_width_ns = 0.0309;
  options.min_spacing_ns = 8.9635;
  EXPECT_THAT(refusal(pairs(8'963.5, 100), models()[0], options),
              ::testing::AllOf(HasSubstr("would be played 8.9"),
                               HasSubstr("awg.min_spacing_ns is 8.9635: lower it")));
}

TEST(WaveformPlan, NamesTheWidthsThatCanBePlayed) {
  Options options;
  options.pulse_width_ns = 0.03;
  EXPECT_THAT(refusal(make_periodic(Mode::baseline, 1e6), m8195a, options),
              HasSubstr("a pulse of 0.03 ns is under two samples; the shortest is 0.0307"));
  EXPECT_THAT(refusal(make_periodic(Mode::baseline, 10'000), m8195a),
              HasSubstr("samples to the next; awg.marker_width_ns must be at most 8"));
}

TEST(WaveformPlan, NarrowPulsesMayLeaveNoRate) {
  Options options;
  options.pulse_width_ns = 0.25;  // two samples at 8 GSa/s, the only rate
  options.marker_width_ns = 1;
  EXPECT_EQ(plan_waveform(make_periodic(Mode::baseline, 30'000), m8190a, options).periods, 1);
  EXPECT_THAT(refusal(make_periodic(Mode::baseline, 30'100), m8190a, options),
              HasSubstr("to 8000000000 Sa/s makes 30.1 ns a whole number of samples; a larger"));
}

TEST(WaveformPlan, APulseAtThePeriodsEndIsOneOfTheNextStart) {
  Pattern pattern = make_periodic(Mode::baseline, 3'780'000);
  pattern.mode = Mode::random;
  pattern.segments[0].pulse_times_ps = {20'000, 3'779'999};
  pattern.segments[0].amplitudes = {1, 2};
  const WaveformPlan plan = plan_waveform(pattern, m8195a, {});
  EXPECT_EQ(plan.pulse_starts.front(), 0);
  const Pattern played = played_pattern(pattern, plan, plan.rate_hz);
  EXPECT_EQ(played.segments[0].pulse_times_ps.front(), 0);
  EXPECT_THAT(played.segments[0].amplitudes, ElementsAre(2, 1));
  EXPECT_FALSE(validate(played));
}

TEST(WaveformPlan, ASlowerClockStretchesEveryTime) {
  Pattern pattern = make_interleaved(std::array{180e3, 189e3});
  pattern.calibrated_period_ps = 3'780'001;
  const WaveformPlan plan = plan_waveform(pattern, m8195a, {});
  const Pattern played = played_pattern(pattern, plan, plan.rate_hz / 1.0000005);
  EXPECT_NEAR(played.segments[0].period_ps, 3'780'001.89, 1e-6);
  EXPECT_NEAR(played.segments[0].pulse_times_ps[1], 180'000.09, 1e-6);
  EXPECT_NEAR(played.subperiods_ps[0], 180'000.09, 1e-6);
  EXPECT_NEAR(played.unambiguous_delay_ps, 3'780'001.89, 1e-6);
  EXPECT_FALSE(played.calibrated_period_ps);
  EXPECT_FALSE(validate(played));
}

TEST(WaveformPlan, IsToldInWords) {
  const WaveformPlan plan = plan_waveform(make_interleaved(std::array{180e3, 189e3}), m8195a, {});
  EXPECT_THAT(in_words(plan), HasSubstr("241920 samples at 64 GSa/s, 241920 a period; pulses 2 ns "
                                        "wide, at most "));
}

}  // namespace
}  // namespace splid::awg
