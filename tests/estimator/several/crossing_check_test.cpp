#include "estimator/several/crossing_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "estimator/model/pulse_shape.hpp"
#include "tests/support/frame_maker.hpp"
#include "tests/support/sanitized.hpp"

namespace splid {
namespace {

// Photons about a line, as many as a frame of [P]'s experiment has of two targets and their
// background. Lengths are in pulse widths.
struct CrossingScene {
  static constexpr double width_ns = 0.1, pulses = 5.4e5, window_widths = 20;
  static constexpr double S = 13.5e-4, background_per_ns = 1.75e-4;

  PulseTrain train{test::interleaved_pattern({180000, 189000}, 3780000)};
  std::unique_ptr<PulseShape> shape = make_gaussian(width_ns);
  CrossingCheck check{*shape, train, 1e-3};
  NearSet near{10'000, 10'000};

  // How far from the line the photon of a target is at the place s, by lots.
  using Offset = std::function<double(double s, std::mt19937_64& random)>;

  void see(const Offset& offset, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> place(-0.5, 0.5), anywhere(-1, 1);
    near.line = {1900, 10};
    near.residual_ns.clear(), near.position.clear();
    const double dark = background_per_ns * pulses * 2 * window_widths * width_ns;
    for (int n = std::poisson_distribution<int>(2 * S * pulses)(random); n > 0; --n) {
      near.position.push_back(place(random));
      near.residual_ns.push_back(width_ns * offset(near.position.back(), random));
    }
    for (int n = std::poisson_distribution<int>(dark)(random); n > 0; --n) {
      near.position.push_back(place(random));
      near.residual_ns.push_back(width_ns * window_widths * anywhere(random));
    }
    near.amplitude.assign(near.residual_ns.size(), 1.0);
  }
  [[nodiscard]] std::optional<DelayLine> parting() const {
    return check.parting_about(near, {near.line, 2 * S}, background_per_ns);
  }
  // Two at +-(delay + travel s) about the line, of which the first has this share of the light.
  [[nodiscard]] JointParameters pair(double delay_ns, double travel_ns, double share = 0.5) const {
    JointParameters two;
    two.background_per_ns = background_per_ns;
    const double first = -2 * (1 - share), other = 2 * share;
    two.add({{near.line.delay_ns + first * delay_ns, near.line.travel_ns + first * travel_ns},
             2 * S * share});
    two.add({{near.line.delay_ns + other * delay_ns, near.line.travel_ns + other * travel_ns},
             2 * S * (1 - share)});
    return two;
  }
  // Of two that the light itself says, about the line.
  [[nodiscard]] CrossingCheck::Verdict verdict() const {
    const auto off = parting();
    return off ? check.judge(near, pair(off->delay_ns, off->travel_ns), 0, 1)
               : CrossingCheck::Verdict{};
  }
};

double normal(std::mt19937_64& random) { return std::normal_distribution<double>()(random); }

// Two at +-(delay + travel s).
CrossingScene::Offset two_that_part(double delay, double travel, double share = 0.5) {
  return [=](double s, std::mt19937_64& random) {
    const double off = std::bernoulli_distribution(share)(random) ? -2 * (1 - share) : 2 * share;
    return off * (delay + travel * s) + normal(random);
  };
}

TEST(CrossingCheck, SeesTwoThatPart) {
  struct {
    double delay, travel, share;
  } const pairs[] = {{0, 2.2, 0.5}, {0.2, -2.3, 0.5}, {0.8, 2.5, 0.5}, {0, 2.6, 0.7}};
  for (const auto& [delay, travel, share] : pairs) {
    CrossingScene scene;
    const double w = scene.width_ns;
    int part = 0, are_two = 0;
    double left = 0;
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
      scene.see(two_that_part(delay, travel, share), seed);
      const auto pair = scene.pair(delay * w, travel * w, share);
      const CrossingCheck::Verdict verdict = scene.check.judge(scene.near, pair, 0, 1);
      part += verdict.does_part ? 1 : 0;
      are_two += verdict.are_two() ? 1 : 0;
      left += verdict.left / 100;
      EXPECT_EQ(verdict.does_part, scene.check.judge(scene.near, pair, 1, 0).does_part);
    }
    EXPECT_GE(part, 97) << travel;
    EXPECT_GE(are_two, part - 3) << travel;
    EXPECT_NEAR(left, 7, 4 * std::sqrt(14.0 / 100)) << travel;
  }
}

// With the lines that the light itself says: one in a thousand of whatever pulse.
TEST(CrossingCheck, ThePulseItselfDoesNotPart) {
  const CrossingScene::Offset pulses[] = {
      [](double, auto& random) { return normal(random); },
      [](double, auto& random) { return 1.3 * normal(random); },
      [](double, auto& random) { return 2 * normal(random); },
      [](double, auto& random) {
        const bool is_late = std::bernoulli_distribution(0.125)(random);
        return normal(random) + (is_late ? std::exponential_distribution<double>(0.5)(random) : 0);
      },
      two_that_part(1.2, 0)};
  const auto trials = test::times(2000);
  int part = 0;
  for (const auto& pulse : pulses) {
    CrossingScene scene;
    for (int seed = 0; seed < trials; ++seed) {
      scene.see(pulse, seed);
      part += scene.verdict().does_part ? 1 : 0;
    }
  }
  const double expected = 5e-3 * static_cast<double>(trials);
  EXPECT_LE(part, expected + 4 * std::sqrt(expected));
}

// One step from no spread takes a wide one for less than it is, but where the lines cross is known.
TEST(CrossingCheck, KnowsHowFarTheyPart) {
  for (const double delay : {-0.3, 0.0, 0.4}) {
    CrossingScene scene;
    double delays = 0, travels = 0;
    constexpr int trials = 100;
    for (int seed = 0; seed < trials; ++seed) {
      scene.see(two_that_part(delay, 2), seed);
      const auto off = scene.parting();
      ASSERT_TRUE(off.has_value());
      delays += off->delay_ns / scene.width_ns / trials;
      travels += off->travel_ns / scene.width_ns / trials;
    }
    EXPECT_NEAR(travels, 1.6, 0.25);
    EXPECT_NEAR(delays / travels, delay / 2, 0.05);
  }
}

// A path that bends, one that shakes, and a pulse that is wide for a third of the frame: their
// light parts, but is not that of two targets.
TEST(CrossingCheck, OtherLightThatPartsIsNotThatOfTwo) {
  const CrossingScene::Offset lights[] = {
      [](double s, auto& random) { return 14 * (s * s - 1.0 / 12) + normal(random); },
      [](double s, auto& random) { return 6 * s * std::sin(25 * s) + normal(random); },
      [](double s, auto& random) { return (s > 1.0 / 6 ? 2.5 : 1) * normal(random); }};
  for (const auto& light : lights) {
    CrossingScene scene;
    int part = 0, are_two = 0;
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
      scene.see(light, seed);
      const CrossingCheck::Verdict verdict = scene.verdict();
      part += verdict.does_part ? 1 : 0;
      are_two += verdict.are_two() ? 1 : 0;
    }
    EXPECT_GE(part, 95);
    EXPECT_LE(are_two, 2);
  }
}

// Without photons, and of targets without light, nothing is said.
TEST(CrossingCheck, SaysNothingOfNothing) {
  CrossingScene scene;
  const JointParameters pair = scene.pair(0, 0.3);
  EXPECT_FALSE(scene.check.judge(scene.near, pair, 0, 1).does_part);
  EXPECT_FALSE(scene.parting().has_value());
  scene.see(two_that_part(0, 2.5), 1);
  JointParameters dark = pair;
  dark.targets[0].signal_per_pulse = dark.targets[1].signal_per_pulse = 0;
  EXPECT_FALSE(scene.check.judge(scene.near, dark, 0, 1).does_part);
}

}  // namespace
}  // namespace splid
