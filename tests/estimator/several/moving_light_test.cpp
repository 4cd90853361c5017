#include "estimator/several/moving_light.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

// A bright target at a line, and light beside it; times and lines are in pulse widths.
struct MovingScene {
  static constexpr double width_ns = 0.1, window_widths = 18;
  static constexpr double bright_photons = 3000, weak_photons = 150, dark_photons = 200;

  PulseTrain train{test::interleaved_pattern({180000, 189000}, 3780000)};
  std::unique_ptr<PulseShape> shape = make_gaussian(width_ns);
  MovingLight light{*shape, train};
  NearSet near{10'000, 10'000};

  using Offset = std::function<double(double s, std::mt19937_64& random)>;

  // The light of the bright target, and some that is so far from its line at the place s.
  void see(const Offset& bright, const Offset& weak, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> place(-0.5, 0.5),
        anywhere(-window_widths, window_widths);
    near.line = {1900, 10};
    near.residual_ns.clear(), near.position.clear();
    const auto add = [&](double photons, const Offset& offset) {
      for (int n = std::poisson_distribution<int>(photons)(random); n > 0; --n) {
        near.position.push_back(place(random));
        near.residual_ns.push_back(width_ns * offset(near.position.back(), random));
      }
    };
    add(bright_photons, bright);
    add(weak_photons, weak);
    add(dark_photons, [&](double, auto& lots) { return anywhere(lots); });
    near.amplitude.assign(near.residual_ns.size(), 1.0);
  }
  // What is said of a weak target that is so far from the bright one, and moves by so much.
  [[nodiscard]] MovingLight::Verdict verdict(double delay, double travel) const {
    const double pulses = 1e6;
    JointParameters at;
    at.background_per_ns = dark_photons / (2 * window_widths * width_ns * pulses);
    at.add({near.line, bright_photons / pulses});
    at.add({{near.line.delay_ns + width_ns * delay, near.line.travel_ns + width_ns * travel},
            weak_photons / pulses});
    return light.judge(near, at, 1, 0);
  }
};

double pulse(double, std::mt19937_64& random) { return std::normal_distribution<double>()(random); }

MovingScene::Offset moving_by(double delay, double travel) {
  return [=](double s, std::mt19937_64& random) { return delay + travel * s + pulse(s, random); };
}

TEST(MovingLight, SeesWhatMovesBesideABrightTargetAndThroughIt) {
  struct {
    double delay, travel;
  } const movers[] = {{5, 6.7}, {-4, 5}, {3, -6.7}, {0, 10.4}, {1, 9}};
  MovingScene scene;
  for (const auto& [delay, travel] : movers) {
    int moves = 0;
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
      scene.see(pulse, moving_by(delay, travel), seed);
      moves += scene.verdict(delay, travel).does_move(10) ? 1 : 0;
    }
    EXPECT_GE(moves, 38) << delay << ", " << travel;
  }
}

// Tails, wide pulses and shoulders stay beside the bright target's line. Then the mean of e^nats is
// 1, whatever the light is; it is held by few frames, and so is looked at where it seldom exceeds.
TEST(MovingLight, LightThatStaysSeldomSeemsToMove) {
  const MovingScene::Offset lights[] = {
      [](double s, auto& random) {
        return pulse(s, random) + std::exponential_distribution<double>(0.3)(random);
      },
      [](double s, auto& random) { return 2.5 * pulse(s, random); },
      [](double s, auto& random) { return 4 + pulse(s, random); }};
  constexpr int frames = 1000;
  MovingScene scene;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> delay(-8, 8), travel(1, 12);
  for (const auto& light : lights) {
    int above_2 = 0, above_5 = 0;
    for (std::uint64_t seed = 0; seed < frames; ++seed) {
      scene.see(pulse, light, seed);
      const double nats = scene.verdict(delay(random), travel(random)).nats;
      above_2 += nats > 2 ? 1 : 0;
      above_5 += nats > 5 ? 1 : 0;
    }
    EXPECT_LE(above_2, frames * std::exp(-2.0));
    EXPECT_LE(above_5, frames * std::exp(-5.0) + 3 * std::sqrt(frames * std::exp(-5.0)));
  }
}

// A bright path that bends has light beside its straight line that comes and goes. So has a pulse
// that is wide for a third of the frame.
TEST(MovingLight, LightThatComesAndGoesIsNotThatOfTargets) {
  struct {
    MovingScene::Offset light;
    double delay, travel;
  } const scenes[] = {
      {[](double s, auto& random) { return 14 * (s * s - 1.0 / 12) + pulse(s, random); }, -2, 10},
      {[](double s, auto& random) { return (s > 1.0 / 6 ? 2.5 : 1) * pulse(s, random); }, 1, 4}};
  MovingScene scene;
  for (const auto& [light, delay, travel] : scenes) {
    int seem_to = 0, move = 0;
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
      scene.see(light, light, seed);
      const MovingLight::Verdict verdict = scene.verdict(delay, travel);
      seem_to += verdict.nats > 10 ? 1 : 0;
      move += verdict.does_move(10) ? 1 : 0;
    }
    EXPECT_GE(seem_to, 30);
    EXPECT_EQ(move, 0);
  }
}

// Lines that hardly part say nothing, nor do those that the photons about the target do not cover.
TEST(MovingLight, SaysNothingWhereItCannotSee) {
  MovingScene scene;
  scene.see(pulse, moving_by(5, 6.7), 1);
  EXPECT_GT(scene.verdict(5, 6.7).nats, 10);
  EXPECT_EQ(scene.verdict(5, 0.9).nats, 0);
  EXPECT_EQ(scene.verdict(5, 12.1).nats, 0);
  EXPECT_EQ(scene.verdict(8.1, 6.7).nats, 0);
}

}  // namespace
}  // namespace splid
