#include "estimator/checks/dead_time_check.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

struct Scene {
  std::string name;
  test::FrameMaker made;
  double given_ns = 0;     // as configured
  double expected_ns = 0;  // that is to be noticed; 0: nothing is
  double tolerance_ns = 0.5;
};

test::FrameMaker strong_light(const Pattern& pattern) {
  test::FrameMaker made;
  made.pattern = pattern;
  made.velocity_mps = 20;
  made.length_ms = 10;
  made.signal_per_pulse = 0.5;
  made.background_per_ns = 2e-3;
  return made;
}

Pattern interleaved() { return test::interleaved_pattern({180000, 189000}, 3780000); }

test::FrameMaker blind(test::FrameMaker made, double dead_time_ns, int inputs = 1) {
  made.dead_time_ns = dead_time_ns;
  made.inputs = inputs;
  return made;
}

test::FrameMaker weak(test::FrameMaker made) {
  made.signal_per_pulse = 13.5e-4;
  made.background_per_ns = 1.75e-4;
  made.length_ms = 50;
  return made;
}

void expect_noticed(const Scene& scene, std::uint64_t frames = 3) {
  const test::FrameMaker& made = scene.made;
  FrameEstimator estimator(made.pattern, {}, {}, {}, made.length_ms, 400'000,
                           ClockReference::tagger, {scene.given_ns},
                           static_cast<std::size_t>(made.inputs));
  for (std::uint64_t seed = 0; seed < frames; ++seed) {
    const auto frame = made.make(seed);
    const auto misfit_ns = estimator.estimate(frame.view()).dead_time_misfit_ns;
    EXPECT_EQ(misfit_ns.has_value(), scene.expected_ns > 0) << scene.name;
    EXPECT_NEAR(misfit_ns.value_or(0), scene.expected_ns, scene.tolerance_ns) << scene.name;
  }
}

TEST(DeadTimeCheck, NoticesADeadTimeThatIsNotGivenOrTooShort) {
  const test::FrameMaker bright = strong_light(interleaved());
  const test::FrameMaker one_pulse = strong_light(test::periodic_pattern(3780000));
  const test::FrameMaker rates = strong_light(test::mrr_pattern({180000, 189000}, 3780000, 2e8));
  expect_noticed({"not given", blind(bright, 50), 0, 50});
  expect_noticed({"too short", blind(bright, 50), 20, 50});
  expect_noticed({"one pulse", blind(one_pulse, 50), 0, 50, 1});
  expect_noticed({"rates in turn", blind(rates, 50), 0, 50, 1});
  test::FrameMaker dark = bright;
  dark.signal_per_pulse = 0;
  expect_noticed({"no target", blind(dark, 50), 0, 50, 2});
  test::FrameMaker afterpulses = blind(bright, 50);
  afterpulses.afterpulse_probability = 0.05;
  expect_noticed({"afterpulses", afterpulses, 0, 50});
}

TEST(DeadTimeCheck, NoticesDetectorsThatAreBlindEachOnItsOwn) {
  const test::FrameMaker bright = strong_light(interleaved());
  expect_noticed({"two", blind(bright, 50, 2), 0, 50, 8});
  expect_noticed({"two, too short", blind(bright, 50, 2), 20, 50, 12});
  test::FrameMaker longer = bright;
  longer.length_ms = 20;
  expect_noticed({"four", blind(longer, 50, 4), 0, 50, 12});
}

// Pulses that are all alike and hardly any other light: no photon could come between two pulses.
TEST(DeadTimeCheck, IsSilentWhereNothingIsHidden) {
  const test::FrameMaker bright = strong_light(interleaved());
  for (const int inputs : {1, 2, 4}) {
    expect_noticed({"right", blind(bright, 50, inputs), 50});
    expect_noticed({"none", blind(bright, 0, inputs)});
  }
  test::FrameMaker even = strong_light(test::periodic_pattern(100000));
  even.signal_per_pulse = 0.05;
  even.background_per_ns = 1e-6;
  expect_noticed({"even, none", even});
  expect_noticed({"even, right", blind(even, 50), 50});
  expect_noticed({"even, not given", blind(even, 50), 0, 95, 10});
  expect_noticed({"weak", weak(blind(bright, 50))}, 10);
  expect_noticed({"rates, right",
                  blind(strong_light(test::mrr_pattern({180000, 189000}, 3780000, 2e8)), 50), 50});
}

TEST(DeadTimeCheck, TakesPhotonsInAnyOrder) {
  const test::FrameMaker made = blind(strong_light(interleaved()), 50);
  FrameEstimator estimator(made.pattern, {}, {}, {}, made.length_ms, 400'000);
  auto frame = made.make(1);
  const auto sorted_ns = estimator.estimate(frame.view()).dead_time_misfit_ns;
  for (std::size_t i = 0; i + 1 < frame.photons_ps.size(); i += 5) {
    std::swap(frame.photons_ps[i], frame.photons_ps[i + 1]);
  }
  EXPECT_EQ(estimator.estimate(frame.view()).dead_time_misfit_ns, sorted_ns);
}

}  // namespace
}  // namespace splid
