#include "estimator/checks/afterpulse_check.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>

#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

// Light as a detector sees it, and what the estimator knows of that detector.
struct AfterpulseScene {
  std::string name;
  test::FrameMaker made;
  double given_ns = 50;                     // dead time, as configured
  std::vector<test::FrameMaker> more = {};  // targets
  // How much of the light there is, 0 to 1, at a time in ns: null: all of it.
  std::function<double(double)> light = nullptr;

  [[nodiscard]] test::FrameMaker::Frame frame(std::uint64_t seed) const {
    if (more.empty() && !light) return made.make(seed);
    test::FrameMaker ideal = made;
    ideal.dead_time_ns = 0;
    ideal.inputs = 1;
    ideal.afterpulse_probability = 0;
    test::FrameMaker::Frame frame = more.empty() ? ideal.make(seed) : ideal.make_with(more, seed);
    std::mt19937_64 random(seed + 1);
    if (light) {
      std::uniform_real_distribution<double> chance(0, 1);
      std::erase_if(frame.photons_ps, [&](std::int64_t t) {
        return chance(random) >= light(static_cast<double>(t - frame.start_ps) * 1e-3);
      });
    }
    made.blind(frame, random);
    return frame;
  }
};

FrameEstimator estimator_of(const AfterpulseScene& scene) {
  return {scene.made.pattern,
          {},
          {},
          {},
          scene.made.length_ms,
          400'000,
          ClockReference::tagger,
          {scene.given_ns},
          static_cast<std::size_t>(scene.made.inputs)};
}

Pattern two_rates() { return test::interleaved_pattern({180000, 189000}, 3780000); }
Pattern rates_in_turn() { return test::mrr_pattern({180000, 189000}, 3780000, 2e8); }

test::FrameMaker bright_light(const Pattern& pattern, double signal_per_pulse = 0.5) {
  test::FrameMaker made;
  made.pattern = pattern;
  made.velocity_mps = 20;
  made.length_ms = 10;
  made.signal_per_pulse = signal_per_pulse;
  made.background_per_ns = 2e-3;
  made.dead_time_ns = 50;
  return made;
}

test::FrameMaker weak_light() {
  test::FrameMaker made = bright_light(two_rates(), 13.5e-4);
  made.background_per_ns = 1.75e-4;
  made.length_ms = 50;
  return made;
}

test::FrameMaker followed(test::FrameMaker made, double probability = 0.05,
                          double afterpulse_ns = 30) {
  made.afterpulse_probability = probability;
  made.afterpulse_ns = afterpulse_ns;
  return made;
}

// share: that is found, to within a third; it is less than there is in light that is so strong
// that the next photon mostly comes first.
void expect_followed(const AfterpulseScene& scene, double share) {
  FrameEstimator estimator = estimator_of(scene);
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    const auto frame = scene.frame(seed);
    const Estimate e = estimator.estimate(frame.view());
    EXPECT_NEAR(e.afterpulse_misfit.value_or(0), share, share / 3) << scene.name;
    if (!e.has_values) continue;
    const double error = e.background_per_ns - scene.made.background_per_ns;
    EXPECT_LT(std::abs(error), 2.5 * e.std_background_per_ns) << scene.name;
  }
}

void expect_silent(const AfterpulseScene& scene, std::uint64_t frames = 5) {
  FrameEstimator estimator = estimator_of(scene);
  for (std::uint64_t seed = 0; seed < frames; ++seed) {
    const auto frame = scene.frame(seed);
    EXPECT_EQ(estimator.estimate(frame.view()).afterpulse_misfit, std::nullopt)
        << scene.name << " " << seed;
  }
}

TEST(AfterpulseCheck, NoticesThemAndWidensTheBackgroundsDeviation) {
  expect_followed({"weak", followed(weak_light())}, 0.05);
  expect_followed({"weak, dead time not given", followed(weak_light()), 0}, 0.047);
  expect_followed({"weak, later", followed(weak_light(), 0.05, 100)}, 0.053);
  expect_followed({"bright", followed(bright_light(two_rates()))}, 0.04);
  expect_followed({"random", followed(bright_light(test::random_pattern(3780000, 40, 9000, 5)))},
                  0.037);
  expect_followed({"one pulse", followed(bright_light(test::periodic_pattern(3780000), 3))}, 0.048);
  test::FrameMaker rates = bright_light(rates_in_turn());
  rates.length_ms = 20;
  expect_followed({"rates in turn", followed(rates)}, 0.032);
  test::FrameMaker two = bright_light(two_rates());
  two.inputs = 2;
  expect_followed({"two inputs", followed(two)}, 0.04);
  test::FrameMaker ideal = bright_light(two_rates());
  ideal.dead_time_ns = 0;
  expect_followed({"no dead time", followed(ideal, 0.03), 0}, 0.03);
}

TEST(AfterpulseCheck, NoticesThemWithoutATarget) {
  test::FrameMaker dark = bright_light(two_rates(), 0);
  dark.length_ms = 20;
  expect_followed({"dark", followed(dark)}, 0.05);
}

TEST(AfterpulseCheck, IsSilentInLightOfAllKinds) {
  test::FrameMaker accelerates = bright_light(two_rates());
  accelerates.acceleration_mps2 = 4e3;
  for (const double dead_time_ns : {0.0, 50.0}) {
    const auto silent = [&](const std::string& name, test::FrameMaker made,
                            std::vector<test::FrameMaker> more = {}) {
      made.dead_time_ns = dead_time_ns;
      expect_silent({name, made, dead_time_ns, std::move(more)});
    };
    silent("weak", weak_light());
    silent("dark", bright_light(two_rates(), 0));
    silent("very bright", bright_light(two_rates(), 3));
    silent("accelerates", accelerates);
    silent("random", bright_light(test::random_pattern(3780000, 40, 9000, 5), 3));
    silent("one pulse", bright_light(test::periodic_pattern(3780000), 3));
    silent("one comb", bright_light(test::periodic_pattern(100000), 1));
    for (const Pattern& pattern : {two_rates(), rates_in_turn()}) {
      silent("two rates", bright_light(pattern));
      test::FrameMaker behind = bright_light(pattern);
      behind.distance_m += 8.5;
      silent("two returns", bright_light(pattern), {behind});
    }
    for (const int inputs : {2, 4}) {
      test::FrameMaker split = bright_light(two_rates());
      split.inputs = inputs;
      silent("inputs", split);
    }
  }
}

// Light that is there for a half or a tenth of the time, and light that rises and falls.
TEST(AfterpulseCheck, IsSilentInLightThatComesAndGoes) {
  test::FrameMaker twice = weak_light();
  twice.background_per_ns *= 4;
  for (const double period_ns : {1e5, 1e6, 1e7}) {
    const auto for_a_share = [=](double share) {
      return [=](double t) { return std::fmod(t, period_ns) < share * period_ns ? 1.0 : 0.0; };
    };
    const auto wave = [=](double t) {
      return 0.5 + 0.5 * std::sin(2 * std::numbers::pi * t / period_ns);
    };
    for (const test::FrameMaker& made : {twice, bright_light(two_rates())}) {
      expect_silent({"half", made, 50, {}, for_a_share(0.5)}, 3);
      expect_silent({"tenth", made, 50, {}, for_a_share(0.1)}, 3);
      expect_silent({"wave", made, 50, {}, wave}, 3);
    }
  }
}

// A dead time that is not given is said alone; one that is too long by a little does no harm.
TEST(AfterpulseCheck, LeavesAWrongDeadTimeToItsOwnCheck) {
  const test::FrameMaker bright = followed(bright_light(two_rates()));
  expect_silent({"not given", bright, 0});
  expect_silent({"too short", bright, 40});
  expect_silent({"too long", bright_light(two_rates()), 54});
  expect_silent({"weak, not given", weak_light(), 0});
}

TEST(AfterpulseCheck, TakesPhotonsInAnyOrder) {
  const AfterpulseScene scene = {"weak", followed(weak_light())};
  FrameEstimator estimator = estimator_of(scene);
  auto frame = scene.frame(1);
  const auto in_order = estimator.estimate(frame.view()).afterpulse_misfit;
  for (std::size_t i = 0; i + 1 < frame.photons_ps.size(); i += 5) {
    std::swap(frame.photons_ps[i], frame.photons_ps[i + 1]);
  }
  ASSERT_TRUE(in_order);
  EXPECT_NEAR(estimator.estimate(frame.view()).afterpulse_misfit.value_or(0), *in_order, 0.01);
}

}  // namespace
}  // namespace splid
