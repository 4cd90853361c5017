#include "estimator/fold/dead_intervals.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "tests/support/frame_maker.hpp"

// Which share of the light a detection takes, against the shares that the light was made with.

namespace splid {
namespace {

test::FrameMaker split_scene(double S, double background_per_ns, double dead_time_ns) {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  made.length_ms = 20;
  made.signal_per_pulse = S;
  made.background_per_ns = background_per_ns;
  made.dead_time_ns = dead_time_ns;
  made.inputs = 2;
  made.first_share = 0.7;
  return made;
}

DeadIntervals dead_intervals_of(const test::FrameMaker& made,
                                const test::FrameMaker::Frame& frame) {
  const PulseTrain train(made.pattern);
  DeadIntervals dead(train, made.dead_time_ns, static_cast<std::size_t>(made.inputs),
                     frame.photons_ps.size(), 3);
  dead.find(frame.view(), train);
  return dead;
}

// Of the detections of these counts, when the first input gets 0.7 of the light.
double true_share(const std::vector<std::uint64_t>& counts) {
  const double first = static_cast<double>(counts[0]);
  const double second = static_cast<double>(counts[1]);
  return (0.7 * first + 0.3 * second) / (first + second);
}

TEST(DeadIntervals, TheCountsOfEachInputTellWhichShareOfTheLightADetectionTakes) {
  // Steady light of 0.1 and of 3 photons a dead time; weak and bright pulses, with a dead time as
  // long as a quarter and as a half of the time between two.
  for (const test::FrameMaker& made :
       {split_scene(0, 0.002, 50), split_scene(0, 0.06, 50), split_scene(0.02, 0.002, 50),
        split_scene(0.5, 0.002, 50), split_scene(0.5, 0.002, 20)}) {
    const auto frame = made.make(7);
    ASSERT_EQ(frame.photons_of_input.size(), 2U);
    const double n = static_cast<double>(frame.photons_ps.size());
    const double truth = true_share(frame.photons_of_input);
    EXPECT_GT(truth, 0.53);
    // Four deviations of the counts, and what the steps of the light in a pulse are worth.
    EXPECT_NEAR(dead_intervals_of(made, frame).share, truth, 4 * 0.5 / std::sqrt(n) + 0.001)
        << made.signal_per_pulse << " " << made.dead_time_ns;
  }
}

TEST(DeadIntervals, LightIsSharedEvenlyWhereTheCountsAreNotKnownOrSayNothing) {
  const test::FrameMaker made = split_scene(0.1, 0.002, 50);
  auto frame = made.make(7);
  frame.photons_of_input.clear();
  EXPECT_EQ(dead_intervals_of(made, frame).share, 0.5);
  frame.photons_of_input = {0, 0};
  EXPECT_EQ(dead_intervals_of(made, frame).share, 0.5);
  frame.photons_of_input = {4000, 4000};
  EXPECT_EQ(dead_intervals_of(made, frame).share, 0.5);
}

TEST(DeadIntervals, OneInputThatGetsAllLightIsASingleInput) {
  test::FrameMaker made = split_scene(0.1, 0.002, 50);
  made.inputs = 1;
  made.first_share = 0;
  auto frame = made.make(7);
  const DeadIntervals single = dead_intervals_of(made, frame);
  EXPECT_EQ(single.share, 1);
  made.inputs = 2;
  frame.photons_of_input = {0, frame.photons_ps.size()};
  const DeadIntervals of_two = dead_intervals_of(made, frame);
  EXPECT_EQ(of_two.share, 1);
  EXPECT_EQ(of_two.dead_ns, single.dead_ns);
}

TEST(DeadIntervals, TheOrderOfPhotonsAndOfInputsMakesNoDifference) {
  const test::FrameMaker made = split_scene(0.5, 0.002, 50);
  auto frame = made.make(7);
  const double share = dead_intervals_of(made, frame).share;
  for (std::size_t i = 0; i + 1 < frame.photons_ps.size(); i += 7) {
    std::swap(frame.photons_ps[i], frame.photons_ps[i + 1]);
  }
  EXPECT_EQ(dead_intervals_of(made, frame).share, share);
  std::swap(frame.photons_of_input[0], frame.photons_of_input[1]);
  EXPECT_NEAR(dead_intervals_of(made, frame).share, share, 1e-12);
}

}  // namespace
}  // namespace splid
