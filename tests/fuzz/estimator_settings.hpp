#pragma once

#include <array>
#include <cstddef>
#include <memory>

#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"

// The patterns and options that the estimator's fuzz target tries. The first byte of an input
// chooses one of them, by its remainder.

namespace splid::test::fuzz_estimator {

// Short, so that an estimate takes milliseconds with all the sanitizers' checks.
inline constexpr double length_ms = 0.1;
inline constexpr std::size_t most_photons = 256;
inline constexpr std::size_t setting_count = 18;

struct Setting {
  Pattern pattern;
  std::unique_ptr<FrameEstimator> estimator;
  double period_ps = 0;
};

// What differs from the scene that the name says: a pulse of 100 ps, a target that moves.
struct Choice {
  double sigma_ps = 100;
  PulseWidth width = PulseWidth::fixed;
  Motion motion = Motion::moving;
  std::int64_t targets = 1;
  Method method = Method::search;
  DetectorOptions detector = {};
  std::size_t inputs = 1;
  ClockReference reference = ClockReference::tagger;
};

inline Setting make_setting(const Pattern& pattern, const Choice& choice) {
  SceneOptions scene;
  scene.motion = choice.motion;
  scene.targets = choice.targets;
  scene.max_acceleration_mps2 = 2e8;  // curves these short frames by 7 ns, so that all looks happen
  EstimatorOptions options;
  options.method = choice.method;
  options.effort = Effort::fast;
  const PulseOptions pulse{.sigma_ps = choice.sigma_ps, .width = choice.width};
  return {pattern,
          std::make_unique<FrameEstimator>(pattern, pulse, scene, options, length_ms, most_photons,
                                           choice.reference, choice.detector, choice.inputs),
          pattern_period_ps(pattern)};
}

inline std::array<Setting, setting_count>& settings() {
  static const Pattern interleaved = interleaved_pattern({180'000, 189'000}, 3'780'000);
  static const Pattern rates = mrr_pattern({90'000, 99'000}, 990'000, 2e6);
  static const Pattern random = random_pattern(1'000'000, 8, 9'000, 1);
  static std::array<Setting, setting_count> made = {
      make_setting(interleaved, {}),
      make_setting(interleaved, {.sigma_ps = 1000, .motion = Motion::automatic}),
      make_setting(interleaved, {.method = Method::paper}),
      make_setting(periodic_pattern(100'000), {.sigma_ps = 50, .motion = Motion::static_target}),
      make_setting(random, {}),
      make_setting(rates, {}),
      make_setting(interleaved, {.motion = Motion::accelerating}),
      make_setting(rates, {.sigma_ps = 300, .motion = Motion::accelerating}),
      make_setting(interleaved, {.detector = {0.05}}),
      make_setting(interleaved,
                   {.sigma_ps = 1000, .motion = Motion::automatic, .detector = {45}, .inputs = 2}),
      make_setting(rates, {.detector = {2000}}),
      make_setting(interleaved, {.motion = Motion::accelerating, .detector = {50}}),
      make_setting(interleaved, {.targets = 3}),
      make_setting(random, {.sigma_ps = 300, .motion = Motion::static_target, .targets = 2}),
      make_setting(interleaved, {.width = PulseWidth::fitted}),
      make_setting(interleaved,
                   {.motion = Motion::accelerating, .reference = ClockReference::pattern}),
      make_setting(interleaved, {.targets = 2,
                                 .detector = {45, DeadTime::flagged},
                                 .reference = ClockReference::pattern}),
      make_setting(interleaved,
                   {.width = PulseWidth::fitted, .reference = ClockReference::pattern})};
  return made;
}

}  // namespace splid::test::fuzz_estimator
