#include "drivers/simulator/detectors.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "tests/support/scene_runs.hpp"

namespace splid::simulator {
namespace {

using test::noiseless_scene;
using test::one_segment;
using test::paper_pattern;
using test::simulate;
using test::times_ps;

constexpr double four_deviations = 4;

Options daylight(double per_s, double seconds) {
  Options options = noiseless_scene();
  options.detection.signal_per_pulse = 0;
  options.ambient_per_s = per_s;
  options.seconds = seconds;
  return options;
}

std::vector<double> gaps_ns(const std::vector<std::int64_t>& times) {
  std::vector<double> gaps;
  for (std::size_t i = 1; i < times.size(); ++i) {
    gaps.push_back(static_cast<double>(times[i] - times[i - 1]) * 1e-3);
  }
  return gaps;
}

// What the definition of a dead time leaves of an ideal detector's times.
std::vector<std::int64_t> thinned(const std::vector<std::int64_t>& all, std::int64_t dead_ps) {
  std::vector<std::int64_t> seen;
  for (const std::int64_t time : all) {
    if (seen.empty() || time >= seen.back() + dead_ps) seen.push_back(time);
  }
  return seen;
}

std::map<int, std::vector<std::int64_t>> by_input(const std::vector<Tag>& tags) {
  std::map<int, std::vector<std::int64_t>> inputs;
  for (const Tag& tag : tags) {
    if (tag.kind == TagKind::photon) inputs[tag.value].push_back(tag.time_ps);
  }
  return inputs;
}

TEST(Detectors, ADeadDetectorLosesExactlyWhatTheDefinitionSays) {
  Options options;  // [P]'s set-up, brighter
  options.pace = Speed::max;
  options.seconds = 0.05;
  options.detection.signal_per_pulse = 0.5;
  options.ambient_per_s = 5e6;
  const auto all = times_ps(simulate(options, paper_pattern()), TagKind::photon);
  options.detector.dead_time_ns = 45;
  const auto seen = times_ps(simulate(options, paper_pattern()), TagKind::photon);
  EXPECT_EQ(seen, thinned(all, 45'000));
  EXPECT_LT(static_cast<double>(seen.size()), 0.8 * static_cast<double>(all.size()));
}

// Between detections a renewal process of a dead time and an exponential wait: rate r / (1 + r t).
TEST(Detectors, LostLightDoesNotProlongTheDeadTime) {
  for (const double light : {0.1, 3.0, 100.0}) {  // would-be detections in a dead time
    constexpr double dead_ns = 50;
    Options options = daylight(light / dead_ns * 1e9, light > 10 ? 0.002 : 0.02);
    if (light > 10) options.dark_per_s = options.ambient_per_s = 1e9;
    const double rate = options.background_per_s();
    options.detector.dead_time_ns = dead_ns;
    const auto times = times_ps(simulate(options, paper_pattern()), TagKind::photon);
    const double expected = rate * options.seconds / (1 + rate * dead_ns * 1e-9);
    const double deviation = std::sqrt(expected) / (1 + rate * dead_ns * 1e-9);
    EXPECT_NEAR(static_cast<double>(times.size()), expected, four_deviations * deviation + 1);
    const std::vector<double> gaps = gaps_ns(times);
    EXPECT_GE(*std::min_element(gaps.begin(), gaps.end()), dead_ns);
  }
}

TEST(Detectors, OfAPulseTheFirstPhotonIsKept) {
  constexpr double photons = 2;
  Options options = noiseless_scene();
  options.detection.sigma_ps = 100;
  options.detection.signal_per_pulse = photons;
  options.target.motion = MotionKind::linear;
  options.target.distance_m = 150;
  options.detector.dead_time_ns = 20;
  options.seconds = 0.01;
  const auto times = times_ps(simulate(options, one_segment(100'000, {0}, {1})), TagKind::photon);
  const double pulses = 100'000;
  const double share = 1 - std::exp(-photons);
  EXPECT_NEAR(static_cast<double>(times.size()), pulses * share,
              four_deviations * std::sqrt(pulses * share * (1 - share)) + 2);
  // The mean of the least of K normal numbers, K Poisson and above 0: its integral, summed.
  const double delay_ps = 300 / 0.000299792458;
  double sum = 0;
  for (const std::int64_t time : times) {
    sum += std::remainder(static_cast<double>(time) - delay_ps, 100'000);
  }
  double early_ps = 0;
  for (double x = -8; x < 8; x += 1e-3) {
    const double below = std::erfc(-x / std::sqrt(2)) / 2;
    const double density = std::exp(-x * x / 2) / std::sqrt(2 * M_PI);
    early_ps += 100 * x * photons * density * std::exp(-photons * below) / share * 1e-3;
  }
  EXPECT_LT(early_ps, -40);
  EXPECT_NEAR(sum / static_cast<double>(times.size()), early_ps, four_deviations * 100 / 290);
}

// Chains of afterpulses: each detection has one with probability p, so p / (1 - p) for each photon.
TEST(Detectors, AfterpulsesFollowTheDeadTimeExponentially) {
  Options options = daylight(1e4, 2);
  options.detector = {.dead_time_ns = 40, .afterpulse_probability = 0.2, .afterpulse_ns = 25};
  const auto times = times_ps(simulate(options, paper_pattern()), TagKind::photon);
  double primaries = 0, afterpulses = 0, lag_ns = 0;
  for (const double gap : gaps_ns(times)) {
    if (gap > 1000) {
      ++primaries;
      continue;
    }
    EXPECT_GE(gap, 40);
    ++afterpulses;
    lag_ns += gap - 40;
  }
  // 1 % of the photons follow another by chance within 1 us, and none follows within 40 ns.
  EXPECT_NEAR(afterpulses / primaries, 0.25 + 0.012, four_deviations * std::sqrt(0.4 / primaries));
  // One in twenty-five of these gaps is such a chance, of half a microsecond.
  const double chance = 0.012 / 0.262;
  EXPECT_NEAR(lag_ns / afterpulses, (1 - chance) * 25 + chance * 480,
              four_deviations * 120 / std::sqrt(afterpulses));
}

TEST(Detectors, SplitDetectorsAreDeadEachOnItsOwn) {
  Options options = daylight(2e7, 0.005);
  const auto all = times_ps(simulate(options, paper_pattern()), TagKind::photon);
  options.photon_input = 3;
  options.detector.inputs = 4;
  std::vector<std::int64_t> together;
  for (const auto& [input, times] : by_input(simulate(options, paper_pattern()))) {
    EXPECT_GE(input, 3);
    EXPECT_LE(input, 6);
    EXPECT_NEAR(static_cast<double>(times.size()), 2.5e4,
                four_deviations * std::sqrt(0.75 * 2.5e4));
    together.insert(together.end(), times.begin(), times.end());
  }
  std::sort(together.begin(), together.end());
  EXPECT_EQ(together, all);  // without a dead time nothing is lost

  options.detector.dead_time_ns = 60;
  const auto dead = by_input(simulate(options, paper_pattern()));
  ASSERT_EQ(dead.size(), 4U);
  std::vector<std::int64_t> seen;
  for (const auto& [input, times] : dead) {
    const std::vector<double> gaps = gaps_ns(times);
    EXPECT_GE(*std::min_element(gaps.begin(), gaps.end()), 60) << input;
    seen.insert(seen.end(), times.begin(), times.end());
  }
  std::sort(seen.begin(), seen.end());
  const std::vector<double> gaps = gaps_ns(seen);
  EXPECT_LT(*std::min_element(gaps.begin(), gaps.end()), 1);
  EXPECT_NEAR(static_cast<double>(seen.size()), 1e5 / (1 + 5e6 * 60e-9), 4 * std::sqrt(1e5));
}

// The light and the dead time are those of a detector without walk; each tag is late by what the
// table says of the wait since the detection before.
TEST(Detectors, WalkDelaysWhatFollowsSoon) {
  Options options = daylight(3e6, 0.02);
  options.detector.dead_time_ns = 50;
  const auto times = times_ps(simulate(options, paper_pattern()), TagKind::photon);
  options.detector.walk = {{60, 500}, {160, 100}, {200, 20}};
  const std::vector<Tag> tags = simulate(options, paper_pattern());
  EXPECT_TRUE(std::is_sorted(tags.begin(), tags.end(),
                             [](const Tag& a, const Tag& b) { return a.time_ps < b.time_ps; }));
  std::vector<std::int64_t> expected = times;
  std::size_t late = 0;
  for (std::size_t i = 1; i < times.size(); ++i) {
    const double wait_ns = static_cast<double>(times[i] - times[i - 1]) * 1e-3;
    double late_ps = 0;
    if (wait_ns <= 60) late_ps = 500;
    if (wait_ns > 60 && wait_ns <= 160) late_ps = 500 - 4 * (wait_ns - 60);
    if (wait_ns > 160 && wait_ns <= 200) late_ps = 100 - 2 * (wait_ns - 160);
    expected[i] += std::llround(late_ps);
    late += wait_ns <= 200 ? 1 : 0;
  }
  const auto walked = times_ps(tags, TagKind::photon);
  ASSERT_EQ(walked.size(), expected.size());
  for (std::size_t i = 0; i < walked.size(); ++i) {
    ASSERT_LE(std::abs(walked[i] - expected[i]), 1) << i;
  }
  const double share = 1 - std::exp(-3e6 * 150e-9);
  EXPECT_NEAR(static_cast<double>(late) / static_cast<double>(times.size()), share,
              four_deviations * std::sqrt(share / static_cast<double>(times.size())));
}

TEST(Detectors, TheWaitsOfAWalkAscend) {
  DetectorModel model;
  model.walk = {{50, 150}, {50, 20}};
  const auto fault = model.validate();
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->pointer, "/walk/1/0");
  model.walk = {{50, 150}, {51, 20}};
  EXPECT_FALSE(model.validate());
}

TEST(Detectors, TagsStayInOrderAndASeedGivesOneStream) {
  Options options;
  options.pace = Speed::max;
  options.seconds = 0.05;
  options.ambient_per_s = 3e6;
  options.detector = {
      .dead_time_ns = 30, .afterpulse_probability = 0.3, .afterpulse_ns = 500, .inputs = 2};
  const std::vector<Tag> tags = simulate(options, paper_pattern());
  EXPECT_TRUE(std::is_sorted(tags.begin(), tags.end(),
                             [](const Tag& a, const Tag& b) { return a.time_ps < b.time_ps; }));
  EXPECT_EQ(tags, simulate(options, paper_pattern()));
}

}  // namespace
}  // namespace splid::simulator
