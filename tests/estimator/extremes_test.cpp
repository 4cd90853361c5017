// Scenes at the edges of what can be asked: each frame is right within its stated deviation, or has
// a status that says why not; never NaN, infinity, an exception or a hang.
//
// SPLID_EXTREMES=FILE writes the table of scripts/evidence extremes.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "estimator/frame_estimator.hpp"
#include "estimator/sync/sync_clock.hpp"
#include "tests/support/frame_maker.hpp"
#include "tests/support/sanitized.hpp"

namespace splid {
namespace {

constexpr double light_m_per_ns = 0.299792458;

struct ExtremeScene {
  test::FrameMaker made;
  SceneOptions options;
  PulseOptions pulse;
  DetectorOptions detector;
  ClockReference reference = ClockReference::tagger;
  std::vector<test::FrameMaker> others;               // targets beside the one that is looked for
  bool right_signal = true, right_background = true;  // false: these are known to be biased
  double sync_jitter_ps = 0;
  double syncs_missing = 0;  // fraction
  double chirp_ppm_per_s = 0;
  int frames = 20;
  int measured = 20;  // frames that must be ok
};

struct Extreme {
  const char* name;
  std::function<void(ExtremeScene&)> set;
};

ExtremeScene long_scene() {
  ExtremeScene scene;
  scene.made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  scene.made.velocity_mps = 12.5;
  return scene;
}

// A pattern clock whose rate changes over the frame: all that it times comes later by a parabola,
// which leaves the rate and the phase at mid-frame as they are.
std::int64_t chirped(std::int64_t t_ps, const test::FrameMaker::Frame& frame, double ppm_per_s) {
  const double s = static_cast<double>(t_ps - frame.start_ps) * 1e-12;
  const double mid_s = static_cast<double>(frame.end_ps - frame.start_ps) * 0.5e-12;
  return t_ps + std::llround(0.5 * ppm_per_s * 1e-6 * (s - mid_s) * (s - mid_s) * 1e12);
}

// The frame's syncs as an instrument would send them, through the sync clock.
SyncFit fit_syncs(const test::FrameMaker::Frame& frame, double period_ps, const ExtremeScene& scene,
                  std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> jitter(0, 1);
  std::bernoulli_distribution missing(scene.syncs_missing);
  std::vector<std::int64_t> syncs;
  for (std::int64_t k = 0;; ++k) {
    const auto at = static_cast<double>(k) * frame.sync.period_ps;
    const double noise = scene.sync_jitter_ps * jitter(random);
    const std::int64_t t =
        chirped(frame.start_ps + std::llround(at + noise), frame, scene.chirp_ppm_per_s);
    if (t >= frame.end_ps) break;
    if (t >= frame.start_ps && !missing(random)) syncs.push_back(t);
  }
  SyncClock clock(period_ps, DriftMethod::regression, syncs.size() + 16);
  return clock.fit(syncs, frame.start_ps, frame.end_ps);
}

void at_pulse_width(ExtremeScene& scene, double sigma_ns) {
  scene.made.sigma_ns = sigma_ns;
  scene.pulse.sigma_ps = sigma_ns * 1e3;
}

void at_speed(ExtremeScene& scene, double velocity_mps) {
  scene.made.velocity_mps = velocity_mps;
  scene.options.max_speed_mps = std::max(150.0, std::abs(velocity_mps));
}

void with_acceleration(ExtremeScene& scene, double acceleration_mps2) {
  scene.made.acceleration_mps2 = acceleration_mps2;
  scene.options.motion = Motion::accelerating;
  scene.options.max_acceleration_mps2 = std::abs(acceleration_mps2);
}

// Light in frames of 1 ms, and a detector with a dead time.
void with_dead_time(ExtremeScene& scene, double dead_time_ns, double S, double in_a_dead_time) {
  scene.made.dead_time_ns = scene.detector.dead_time_ns = dead_time_ns;
  scene.made.length_ms = 1;
  scene.made.signal_per_pulse = S;
  scene.made.background_per_ns = in_a_dead_time / dead_time_ns;
}

// 100 ppm between the two clocks, of which the tagger's is wrong.
void with_wrong_tagger(ExtremeScene& scene, ClockReference reference) {
  scene.made.drift_ppm = scene.made.tagger_ppm = 100;
  scene.reference = reference;
}

// A further target with this share of the signal.
void add_target(ExtremeScene& scene, double further_m, double faster_mps, double share) {
  scene.others.push_back(scene.made.beside(further_m, faster_mps, share));
  scene.options.targets = static_cast<std::int64_t>(scene.others.size()) + 1;
}

// A pulse that is so many times as wide as the configured one, whose width is fitted.
void with_fitted_width(ExtremeScene& scene, double ratio) {
  scene.made.sigma_ns = ratio * scene.pulse.sigma_ps * 1e-3;
  scene.pulse.width = PulseWidth::fitted;
}

void without_target(ExtremeScene& scene) {
  scene.made.signal_per_pulse = 0;
  scene.measured = 0;
}

void of_length(ExtremeScene& scene, double length_ms, int frames) {
  scene.made.length_ms = length_ms;
  scene.frames = scene.measured = frames;
}

const std::vector<Extreme> extremes = {
    {"b = 0", [](ExtremeScene& s) { s.made.background_per_ns = 0; }},
    {"b = 1e-6 /ns", [](ExtremeScene& s) { s.made.background_per_ns = 1e-6; }},
    {"b = 1e-2 /ns, S = 5e-3",
     [](ExtremeScene& s) {
       s.made.background_per_ns = 1e-2;
       s.made.signal_per_pulse = 5e-3;
       s.frames = s.measured = 8;
     }},
    {"b = 1e-1 /ns, S = 2e-2",
     [](ExtremeScene& s) {
       s.made.background_per_ns = 1e-1;
       s.made.signal_per_pulse = 2e-2;
       s.frames = s.measured = 2;
     }},
    {"b = 1e-1 /ns, no target",
     [](ExtremeScene& s) {
       s.made.background_per_ns = 1e-1;
       s.frames = 1;
       without_target(s);
     }},
    {"S = 0", [](ExtremeScene& s) { without_target(s); }},
    {"S = 0, b = 0",
     [](ExtremeScene& s) {
       s.made.background_per_ns = 0;
       without_target(s);
     }},
    {"S = 1e-5 (5 photons a frame)",
     [](ExtremeScene& s) {
       s.made.signal_per_pulse = 1e-5;
       s.measured = 0;
     }},
    {"S = 0.1", [](ExtremeScene& s) { s.made.signal_per_pulse = 0.1; }},
    {"sigma = 1 ps", [](ExtremeScene& s) { at_pulse_width(s, 1e-3); }},
    {"sigma = 10 ps", [](ExtremeScene& s) { at_pulse_width(s, 1e-2); }},
    {"sigma = 1 ns", [](ExtremeScene& s) { at_pulse_width(s, 1); }},
    {"sigma = 5 ns, S = 1e-2",
     [](ExtremeScene& s) {
       at_pulse_width(s, 5);
       s.made.signal_per_pulse = 1e-2;
     }},
    {"sigma = 9 ns, the closest pulses' spacing, S = 2e-2",
     [](ExtremeScene& s) {
       at_pulse_width(s, 9);
       s.made.signal_per_pulse = 2e-2;
     }},
    {"v = 0", [](ExtremeScene& s) { at_speed(s, 0); }},
    {"v = 1e-6 m/s", [](ExtremeScene& s) { at_speed(s, 1e-6); }},
    {"v = -1e-6 m/s", [](ExtremeScene& s) { at_speed(s, -1e-6); }},
    {"v = 150 m/s, the limit", [](ExtremeScene& s) { at_speed(s, 150); }},
    {"v = -150 m/s, the limit", [](ExtremeScene& s) { at_speed(s, -150); }},
    {"v = 3,000 m/s",
     [](ExtremeScene& s) {
       at_speed(s, 3000);
       s.frames = s.measured = 6;
     }},
    {"v = -3,000 m/s",
     [](ExtremeScene& s) {
       at_speed(s, -3000);
       s.frames = s.measured = 6;
     }},
    {"v = 30,000 m/s, 5 ms",
     [](ExtremeScene& s) {
       at_speed(s, 30000);
       of_length(s, 5, 6);
       s.made.signal_per_pulse = 1e-2;
     }},
    {"v = -30,000 m/s, 5 ms",
     [](ExtremeScene& s) {
       at_speed(s, -30000);
       of_length(s, 5, 6);
       s.made.signal_per_pulse = 1e-2;
     }},
    {"v = 400 m/s, beyond the limit",
     [](ExtremeScene& s) {
       s.made.velocity_mps = 400;
       s.measured = 0;
     }},
    {"a = 100 m/s^2, accelerating", [](ExtremeScene& s) { with_acceleration(s, 100); }},
    {"a = -100 m/s^2, accelerating, 200 ms",
     [](ExtremeScene& s) {
       with_acceleration(s, -100);
       of_length(s, 200, 6);
     }},
    {"a = 1e5 m/s^2, auto, 5 ms, S = 1e-2",
     [](ExtremeScene& s) {
       with_acceleration(s, 1e5);
       s.options.motion = Motion::automatic;
       s.made.signal_per_pulse = 1e-2;
       of_length(s, 5, 6);
     }},
    {"delay 0", [](ExtremeScene& s) { s.made.distance_m = 0; }},
    {"delay of a pattern period",
     [](ExtremeScene& s) { s.made.distance_m = 3780 * light_m_per_ns / 2; }},
    {"delay crossing 0 at -150 m/s",
     [](ExtremeScene& s) {
       s.made.distance_m = 0.01;
       at_speed(s, -150);
     }},
    {"t_a = 100 us, S = 0.03",
     [](ExtremeScene& s) {
       of_length(s, 0.1, 20);
       s.made.signal_per_pulse = 0.03;
     }},
    {"t_a = 1 s", [](ExtremeScene& s) { of_length(s, 1000, 3); }},
    {"t_a = 10 s, b = 1e-5 /ns",
     [](ExtremeScene& s) {
       of_length(s, 10000, 1);
       s.made.background_per_ns = 1e-5;
       s.made.signal_per_pulse = 1e-4;
     }},
    {"t_r = 12 ns, one pulse, sigma = 50 ps",
     [](ExtremeScene& s) {
       s.made.pattern = test::periodic_pattern(12000);
       at_pulse_width(s, 0.05);
       s.frames = s.measured = 5;
     }},
    {"t_r = 1 ms, 4 pulses, S = 1",
     [](ExtremeScene& s) {
       s.made.pattern = test::random_pattern(1e9, 4, 1e7, 3);
       s.made.signal_per_pulse = 1;
       s.frames = s.measured = 5;
     }},
    {"amplitudes over 1:100",
     [](ExtremeScene& s) {
       auto& amplitudes = s.made.pattern.segments.front().amplitudes;
       for (std::size_t p = 0; p < amplitudes.size(); ++p) {
         amplitudes[p] = std::pow(100.0, static_cast<double>(p) / 39.0 - 0.5);
       }
     }},
    {"device clock at 3.4e17 ps",
     [](ExtremeScene& s) { s.made.start_ps = 340'000'000'000'000'000; }},
    {"device clock at 9e18 ps",
     [](ExtremeScene& s) { s.made.start_ps = 9'000'000'000'000'000'000; }},
    {"device clock at -9e18 ps",
     [](ExtremeScene& s) { s.made.start_ps = -9'000'000'000'000'000'000; }},
    {"clock drift 1 ppm", [](ExtremeScene& s) { s.made.drift_ppm = 1; }},
    {"clock drift 100 ppm", [](ExtremeScene& s) { s.made.drift_ppm = 100; }},
    {"clock drift -100 ppm", [](ExtremeScene& s) { s.made.drift_ppm = -100; }},
    {"clock drift of 1 ppm/s, sync jitter 10 ps",
     [](ExtremeScene& s) {
       s.chirp_ppm_per_s = 1;
       s.sync_jitter_ps = 10;
     }},
    {"clock drift of 10 ppm/s, sync jitter 1 ps",
     [](ExtremeScene& s) {
       s.chirp_ppm_per_s = 10;
       s.sync_jitter_ps = 1;
     }},
    {"clock drift of 0.01 ppm/s, sync jitter 10 ps, 1 s",
     [](ExtremeScene& s) {
       of_length(s, 1000, 8);
       s.chirp_ppm_per_s = 0.01;
       s.sync_jitter_ps = 10;
     }},
    {"sync jitter 10 ps", [](ExtremeScene& s) { s.sync_jitter_ps = 10; }},
    {"sync jitter 500 ps", [](ExtremeScene& s) { s.sync_jitter_ps = 500; }},
    {"30 % of syncs missing, jitter 100 ps",
     [](ExtremeScene& s) {
       s.syncs_missing = 0.3;
       s.sync_jitter_ps = 100;
     }},
    {"rates in turn, 180 and 189 ns, -150 m/s",
     [](ExtremeScene& s) {
       s.made.pattern = test::mrr_pattern({180000, 189000}, 3780000, 2e9);
       s.made.signal_per_pulse = 3e-3;
       at_speed(s, -150);
     }},
    {"rates in turn, three of them",
     [](ExtremeScene& s) {
       s.made.pattern = test::mrr_pattern({180000, 189000, 210000}, 3780000, 3e9);
       s.made.signal_per_pulse = 3e-3;
     }},
    {"interleaved, three rates",
     [](ExtremeScene& s) {
       s.made.pattern = test::interleaved_pattern({180000, 189000, 210000}, 3780000);
     }},
    {"dead time 1 ps",
     [](ExtremeScene& s) { s.made.dead_time_ns = s.detector.dead_time_ns = 1e-3; }},
    {"dead time 50 ns, S = 3, 3 of background in it, 1 ms",
     [](ExtremeScene& s) { with_dead_time(s, 50, 3, 3); }},
    {"dead time 50 ns, S = 3, two inputs, 1 ms",
     [](ExtremeScene& s) {
       with_dead_time(s, 50, 3, 0.1);
       s.made.inputs = 2;
     }},
    {"dead time 10 us, longer than the pattern's period",
     [](ExtremeScene& s) { s.made.dead_time_ns = s.detector.dead_time_ns = 1e4; }},
    {"dead time 50 ns, no target, 3 of background in it, 1 ms",
     [](ExtremeScene& s) {
       with_dead_time(s, 50, 0, 3);
       without_target(s);
     }},
    {"dead time 400 ns, flagged",
     [](ExtremeScene& s) {
       s.made.dead_time_ns = s.detector.dead_time_ns = 400;
       s.detector.dead_time = DeadTime::flagged;
       s.right_signal = s.right_background = false;
     }},
    {"dead time 50 ns, 5 % afterpulses",
     [](ExtremeScene& s) {
       s.made.dead_time_ns = s.detector.dead_time_ns = 50;
       s.made.afterpulse_probability = 0.05;
       s.right_background = false;
     }},
    {"tagger 100 ppm fast, distances in the pattern's clock",
     [](ExtremeScene& s) { with_wrong_tagger(s, ClockReference::pattern); }},
    {"tagger 100 ppm fast, distances in its own clock",
     [](ExtremeScene& s) { with_wrong_tagger(s, ClockReference::tagger); }},
    {"two targets, 1:1/2, 3 widths apart",
     [](ExtremeScene& s) { add_target(s, 3 * 0.1 * light_m_per_ns / 2, 0, 0.5); }},
    {"two targets at one place, 1:1/2, 5 m/s apart",
     [](ExtremeScene& s) { add_target(s, 0, 5, 0.5); }},
    {"two targets, 1:1/2, at -150 and 150 m/s",
     [](ExtremeScene& s) {
       at_speed(s, -150);
       add_target(s, 1, 300, 0.5);
     }},
    {"two targets, 1:1/1000", [](ExtremeScene& s) { add_target(s, 30, 0, 1e-3); }},
    {"four targets, 1:1/2:1/2:1/2",
     [](ExtremeScene& s) {
       for (const double further_m : {1, 10, 100}) add_target(s, further_m, 0, 0.5);
     }},
    {"rates in turn, two targets, 1:1/2, 30 m apart",
     [](ExtremeScene& s) {
       s.made.pattern = test::mrr_pattern({180000, 189000}, 3780000, 2e9);
       s.made.signal_per_pulse = 3e-3;
       add_target(s, 30, -40, 0.5);
     }},
    {"rates in turn, three targets, 1:1/2:1/2",
     [](ExtremeScene& s) {
       s.made.pattern = test::mrr_pattern({180000, 189000}, 3780000, 2e9);
       s.made.signal_per_pulse = 3e-3;
       add_target(s, 1, 0, 0.5);
       add_target(s, 100, 20, 0.5);
     }},
    {"random, two targets, 1:1/2, 30 m apart",
     [](ExtremeScene& s) {
       s.made.pattern = test::random_pattern(3780000, 40, 9000, 5);
       add_target(s, 30, -40, 0.5);
     }},
    {"random, three targets, 1:1/2:1/2",
     [](ExtremeScene& s) {
       s.made.pattern = test::random_pattern(3780000, 40, 9000, 5);
       add_target(s, 1, 0, 0.5);
       add_target(s, 100, 20, 0.5);
     }},
    {"no target, four asked for",
     [](ExtremeScene& s) {
       s.options.targets = 4;
       without_target(s);
     }},
    {"width fitted, 0.3 times as configured", [](ExtremeScene& s) { with_fitted_width(s, 0.3); }},
    {"width fitted, 3.8 times as configured", [](ExtremeScene& s) { with_fitted_width(s, 3.8); }},
    {"width fitted, S = 0.1",
     [](ExtremeScene& s) {
       with_fitted_width(s, 1);
       s.made.signal_per_pulse = 0.1;
     }},
    {"width fitted, no target",
     [](ExtremeScene& s) {
       with_fitted_width(s, 1);
       without_target(s);
     }},
};

// Of a size that a sanitizer takes minutes for.
const std::vector<Extreme> many_photons = {
    {"S = 10 (5,300,000 photons a frame)",
     [](ExtremeScene& s) {
       s.made.signal_per_pulse = 10;
       s.frames = s.measured = 1;
     }},
    {"10,000,000 photons, S = 10, b = 0.1 /ns",
     [](ExtremeScene& s) {
       s.made.signal_per_pulse = 10;
       s.made.background_per_ns = 0.1;
       s.frames = s.measured = 1;
     }},
};

void expect_finite(const Estimate& e) {
  for (const double value :
       {e.delay_ns, e.delay_start_ns, e.velocity_mps, e.signal_per_pulse, e.background_per_ns,
        e.std_delay_ns, e.std_velocity_mps, e.std_signal_per_pulse, e.std_background_per_ns,
        e.significance_nats, e.threshold_nats}) {
    EXPECT_TRUE(std::isfinite(value));
  }
}

// Errors over their published deviations, of delay, velocity, signal and background.
using ExtremeErrors = std::array<double, 4>;

struct ExtremeSums {
  int ok = 0;
  ExtremeErrors all{};
  ExtremeErrors squares{};
  ExtremeErrors largest{};

  void add(const ExtremeErrors& off) {
    ++ok;
    for (std::size_t k = 0; k < off.size(); ++k) {
      all.at(k) += off.at(k);
      squares.at(k) += off.at(k) * off.at(k);
      largest.at(k) = std::max(largest.at(k), std::abs(off.at(k)));
    }
  }
  [[nodiscard]] double rms(std::size_t k) const {
    return ok > 0 ? std::sqrt(squares.at(k) / ok) : 0;
  }
};

// Which of the four are to be right within their deviations. Of hardly any background the error is
// not normal.
std::array<bool, 4> judged(const ExtremeScene& scene) {
  constexpr double few_photons = 30;
  const double background = scene.made.background_per_ns * scene.made.length_ms * 1e6;
  return {true, true, scene.right_signal, scene.right_background && background > few_photons};
}

void write_row(const Extreme& extreme, const ExtremeScene& scene, const ExtremeSums& sums) {
  const char* file = std::getenv("SPLID_EXTREMES");
  if (file == nullptr) return;
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), "| %s | %d of %d", extreme.name, sums.ok, scene.frames);
  std::string row = text.data();
  if (sums.ok == 0) row += ", `no_target` | | | |";
  double largest = 0;
  for (std::size_t k = 0; k < 4 && sums.ok > 0; ++k) {
    const bool is_judged = judged(scene).at(k);
    std::snprintf(text.data(), text.size(), is_judged ? " | %.2f" : " | (%.2f)", sums.rms(k));
    row += text.data();
    if (is_judged) largest = std::max(largest, sums.largest.at(k));
  }
  std::snprintf(text.data(), text.size(), sums.ok > 0 ? " | %.1f |\n" : " | |\n", largest);
  std::ofstream(file, std::ios::app) << row << text.data();
}

// The delay in the clock that is taken to be right. A tagger that is fast counts more.
double true_delay_ns(const ExtremeScene& scene) {
  const bool by_tagger = scene.reference == ClockReference::tagger;
  const double rate = 1 + (by_tagger ? scene.made.tagger_ppm * 1e-6 : 0);
  return 2 * scene.made.distance_m / light_m_per_ns * rate;
}

ExtremeErrors errors_of(const Estimate& e, const ExtremeScene& scene) {
  const double circle_ns = scene.made.pattern.unambiguous_delay_ps * 1e-3;
  const double background_off = e.background_per_ns - scene.made.background_per_ns;
  return {std::remainder(e.delay_ns - true_delay_ns(scene), circle_ns) / e.std_delay_ns,
          (e.velocity_mps - scene.made.velocity_mps) / e.std_velocity_mps,
          (e.signal_per_pulse - scene.made.signal_per_pulse) / e.std_signal_per_pulse,
          e.std_background_per_ns > 0 ? background_off / e.std_background_per_ns : 0};
}

class Extremes : public testing::TestWithParam<Extreme> {};

TEST_P(Extremes, RightWithinItsDeviationOrSaysWhyNot) {
  ExtremeScene scene = long_scene();
  GetParam().set(scene);
#ifdef SPLID_SANITIZED  // statistics are the release build's
  scene.frames = std::min(scene.frames, 3);
#endif
  const double period_ps = pattern_period_ps(scene.made.pattern);
  ExtremeSums sums;
  std::optional<FrameEstimator> estimator;
  for (int n = 0; n < scene.frames; ++n) {
    const auto seed = static_cast<std::uint64_t>(n + 1);
    auto frame = scene.made.make_with(scene.others, seed);
    for (std::int64_t& t : frame.photons_ps) t = chirped(t, frame, scene.chirp_ppm_per_s);
    if (scene.sync_jitter_ps > 0) frame.sync = fit_syncs(frame, period_ps, scene, seed);
    if (!estimator) {
      estimator.emplace(scene.made.pattern, scene.pulse, scene.options, EstimatorOptions{},
                        scene.made.length_ms, frame.photons_ps.size() * 11 / 10 + 100,
                        scene.reference, scene.detector,
                        static_cast<std::size_t>(scene.made.inputs));
    }
    const Estimate e = estimator->estimate(frame.view());
    expect_finite(e);
    if (e.status != FrameStatus::ok) {
      EXPECT_EQ(e.status, FrameStatus::no_target) << n;
      continue;
    }
    ASSERT_GT(e.std_delay_ns, 0);
    ASSERT_GT(e.std_velocity_mps, 0);
    ASSERT_GT(e.std_signal_per_pulse, 0);
    sums.add(errors_of(e, scene));
  }
  write_row(GetParam(), scene, sums);
#ifndef SPLID_SANITIZED
  EXPECT_EQ(sums.ok, scene.measured);
#endif
  for (std::size_t k = 0; k < 4; ++k) {
    if (!judged(scene).at(k)) continue;
    EXPECT_LT(sums.largest.at(k), 5) << k;
    // The rms of 20 normal errors is 1 within 0.16, and their mean 0 within 0.22: 4 deviations.
    if (sums.ok >= 20) {
      EXPECT_NEAR(sums.all.at(k) / sums.ok, 0, 0.9) << k;
      EXPECT_NEAR(sums.rms(k), 1, 0.64) << k;
    }
  }
}

std::string letters_of(const testing::TestParamInfo<Extreme>& tested) {
  std::string name;
  for (const char c : std::string(tested.param.name)) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) name += c;
    if (c == '-') name += "minus";
    if (c == '.') name += "point";
  }
  return name;
}

INSTANTIATE_TEST_SUITE_P(All, Extremes, testing::ValuesIn(extremes), letters_of);
INSTANTIATE_TEST_SUITE_P(ManyPhotons, Extremes, testing::ValuesIn(many_photons), letters_of);

TEST(ExtremeFrames, NoneOneAndTwoPhotons) {
  const ExtremeScene scene = long_scene();
  for (const std::size_t photons : {0, 1, 2}) {
    auto frame = scene.made.make(1);
    frame.photons_ps.resize(photons);
    FrameEstimator estimator(scene.made.pattern, {}, {}, {}, 50, 100);
    const Estimate e = estimator.estimate(frame.view());
    expect_finite(e);
    EXPECT_EQ(e.status, FrameStatus::no_target);
    EXPECT_EQ(e.photons, photons);
  }
}

TEST(ExtremeFrames, AllPhotonsAtOneTime) {
  const ExtremeScene scene = long_scene();
  for (const std::size_t photons : {3, 1000, 300000}) {
    auto frame = scene.made.make(1);
    frame.photons_ps.assign(photons, frame.start_ps + 12345678901);
    FrameEstimator estimator(scene.made.pattern, {}, {}, {}, 50, photons);
    expect_finite(estimator.estimate(frame.view()));
  }
}

TEST(ExtremeFrames, PhotonsOutOfOrderChangeNothing) {
  const ExtremeScene scene = long_scene();
  auto frame = scene.made.make(7);
  FrameEstimator estimator(scene.made.pattern, {}, {}, {}, 50, frame.photons_ps.size());
  const Estimate sorted = estimator.estimate(frame.view());
  std::mt19937_64 random(3);
  std::shuffle(frame.photons_ps.begin(), frame.photons_ps.end(), random);
  const Estimate shuffled = estimator.estimate(frame.view());
  EXPECT_NEAR(shuffled.delay_ns, sorted.delay_ns, 1e-6 * sorted.std_delay_ns);
  EXPECT_NEAR(shuffled.velocity_mps, sorted.velocity_mps, 1e-6 * sorted.std_velocity_mps);
}

}  // namespace
}  // namespace splid
