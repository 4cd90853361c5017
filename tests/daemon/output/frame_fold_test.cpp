#include "daemon/output/frame_fold.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "estimator/frame_estimator.hpp"
#include "estimator/model/units.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

constexpr std::size_t plane_side = PhotonFold::plane_cells;

// A bright target that moves, its frame, its estimate and its pictures.
struct PicturedScene {
  test::FrameMaker made;
  test::FrameMaker::Frame frame;
  Estimate estimate;
  PhotonFold pictures;

  explicit PicturedScene(test::FrameMaker maker, SceneOptions scene = {},
                         ClockReference reference = ClockReference::tagger)
      : made(std::move(maker)), frame(made.make(1)) {
    FrameEstimator estimator(made.pattern, {}, scene, {}, made.length_ms, 400'000, reference);
    estimate = estimator.estimate(frame.view());
    pictures = FrameFold(made.pattern, {}, reference).fold(frame.view(), estimate);
  }
};

test::FrameMaker moving_target() {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  made.velocity_mps = 30;
  made.drift_ppm = 5;
  return made;
}

double photons_in(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}
double photons_in(const std::vector<std::uint64_t>& counts) {
  return static_cast<double>(std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}));
}

// Chi squared of the stack against what is expected, for each bin.
double chi_squared(const PhotonFold::Stack& stack) {
  double chi = 0;
  for (std::size_t i = 0; i < stack.counts.size(); ++i) {
    const double off = static_cast<double>(stack.counts[i]) - stack.expected[i];
    chi += off * off / stack.expected[i];
  }
  return chi / static_cast<double>(stack.counts.size());
}

// 200 bins: chi squared a bin is 1 with a deviation of 0.1 (a little more where few are expected).
void expect_fits(const PhotonFold::Stack& stack) {
  EXPECT_EQ(stack.counts.size(), PhotonFold::stack_bins);
  EXPECT_NEAR(chi_squared(stack), 1, 0.5);
  EXPECT_NEAR(photons_in(stack.counts) / photons_in(stack.expected), 1,
              5 / std::sqrt(photons_in(stack.expected)));
}

TEST(FrameFold, TheStackIsThePulseThatTheEstimateExpects) {
  const PicturedScene scene(moving_target());
  ASSERT_TRUE(scene.pictures.stack);
  const PhotonFold::Stack& stack = *scene.pictures.stack;
  EXPECT_NEAR(stack.first_ns, -1, 1e-12);
  EXPECT_NEAR(stack.bin_ns, 0.01, 1e-12);
  expect_fits(stack);
  // Most of the light is within two pulse widths.
  const double inside =
      photons_in(std::vector<std::uint64_t>(stack.counts.begin() + 80, stack.counts.begin() + 120));
  EXPECT_GT(inside, 0.7 * photons_in(stack.counts));
}

TEST(FrameFold, ThePeriodHasEveryPhotonAndItsPulses) {
  const PicturedScene scene(moving_target());
  ASSERT_TRUE(scene.pictures.period);
  const PhotonFold::Period& period = *scene.pictures.period;
  EXPECT_TRUE(period.moved_back);
  EXPECT_EQ(period.counts.size(), PhotonFold::period_bins);
  EXPECT_EQ(photons_in(period.counts), static_cast<double>(scene.frame.photons_ps.size()));
  EXPECT_NEAR(period.bin_ns * PhotonFold::period_bins, 3780, 1e-9);
  // The bins with a pulse, and those beside where it may fall over the edge, have the light.
  double lit = 0;
  std::vector<bool> has_pulse(PhotonFold::period_bins, false);
  for (const double time_ps : scene.made.pattern.segments.front().pulse_times_ps) {
    for (const double off_ns : {-0.5, 0.5}) {
      const double at = std::fmod(time_ps * ns_per_ps + off_ns + 3780, 3780) / period.bin_ns;
      has_pulse[static_cast<std::size_t>(at)] = true;
    }
  }
  for (std::size_t i = 0; i < has_pulse.size(); ++i) {
    if (has_pulse[i]) lit += static_cast<double>(period.counts[i]);
  }
  const double share = static_cast<double>(std::count(has_pulse.begin(), has_pulse.end(), true)) /
                       PhotonFold::period_bins;
  EXPECT_GT(lit, share * photons_in(period.counts) + 0.8 * 13.5e-4 * 529'000);
}

TEST(FrameFold, ThePlaneHasTheSignificanceInItsMiddleAndFallsOff) {
  const PicturedScene scene(moving_target());
  ASSERT_TRUE(scene.pictures.plane);
  const PhotonFold::Plane& plane = *scene.pictures.plane;
  ASSERT_EQ(plane.gain_nats.size(), plane_side * plane_side);
  const auto best = std::max_element(plane.gain_nats.begin(), plane.gain_nats.end());
  const auto at = static_cast<std::size_t>(best - plane.gain_nats.begin());
  EXPECT_NEAR(static_cast<double>(at / plane_side), 31.5, 1.5);
  EXPECT_NEAR(static_cast<double>(at % plane_side), 31.5, 1.5);
  EXPECT_NEAR(*best, scene.estimate.significance_nats, 0.02 * scene.estimate.significance_nats);
  EXPECT_LE(*best, scene.estimate.significance_nats + 1);
  for (const std::size_t corner : {std::size_t{0}, plane_side - 1, plane_side * (plane_side - 1)}) {
    EXPECT_LT(plane.gain_nats[corner], *best / 2);
  }
  EXPECT_NEAR(plane.delay_step_ns * 31.5, 0.4, 1e-9);
  // At the ends of the frame, half of it from the middle, the fastest cell is 4 widths off.
  EXPECT_NEAR(plane.velocity_step_mps * 31.5 * 2 / speed_of_light_mps * 25e6, 0.4, 1e-4);
}

TEST(FrameFold, TheStackFitsInEveryModeClockAndMotion) {
  test::FrameMaker mrr = moving_target();
  mrr.pattern = test::mrr_pattern({180000, 189000}, 3780000, 3780000.0 * 20);
  expect_fits(*PicturedScene(mrr).pictures.stack);
  test::FrameMaker drifting = moving_target();
  drifting.drift_ppm = 200;
  expect_fits(*PicturedScene(drifting, {}, ClockReference::pattern).pictures.stack);
  test::FrameMaker curved = moving_target();
  curved.acceleration_mps2 = 60;
  SceneOptions options;
  options.motion = Motion::accelerating;
  const PicturedScene scene(curved, options);
  ASSERT_GT(scene.estimate.std_acceleration_mps2, 0);
  expect_fits(*scene.pictures.stack);
}

TEST(FrameFold, NeighbouringPulsesAreExpectedToo) {
  test::FrameMaker dense = moving_target();
  // Pulses 0.6 ns apart: six widths, so that each has its neighbours in its stack.
  dense.pattern.mode = Mode::random;
  dense.pattern.subperiods_ps.clear();
  PatternSegment& segment = dense.pattern.segments.front();
  segment.pulse_times_ps.clear();
  for (double time_ps = 0; time_ps < 3'700'000; time_ps += 94'500) {
    segment.pulse_times_ps.push_back(time_ps + std::fmod(time_ps * 0.37, 20'000));
    segment.pulse_times_ps.push_back(segment.pulse_times_ps.back() + 600);
  }
  segment.amplitudes.assign(segment.pulse_times_ps.size(), 1.0);
  const PicturedScene scene(dense);
  ASSERT_TRUE(scene.pictures.stack);
  expect_fits(*scene.pictures.stack);
}

TEST(FrameFold, OfASampleIsThatOfTheFrameWithFewerCounts) {
  PicturedScene scene(moving_target());
  std::vector<std::int64_t> some;
  for (std::size_t i = 0; i < scene.frame.photons_ps.size(); i += 3) {
    some.push_back(scene.frame.photons_ps[i]);
  }
  FrameView view = scene.frame.view();
  view.photons_ps = some;
  const PhotonFold pictures =
      FrameFold(scene.made.pattern, {}, ClockReference::tagger).fold(view, scene.estimate);
  ASSERT_TRUE(pictures.stack && pictures.plane);
  EXPECT_NEAR(photons_in(pictures.stack->expected), photons_in(scene.pictures.stack->expected) / 3,
              0.01 * photons_in(scene.pictures.stack->expected));
  const auto middle = plane_side * plane_side / 2 + plane_side / 2;
  EXPECT_NEAR(pictures.plane->gain_nats[middle], scene.pictures.plane->gain_nats[middle],
              0.3 * scene.pictures.plane->gain_nats[middle]);
}

TEST(FrameFold, WithoutATargetThereIsThePeriodAsItCame) {
  test::FrameMaker dark = moving_target();
  dark.signal_per_pulse = 0;
  const PicturedScene scene(dark);
  EXPECT_FALSE(scene.pictures.stack);
  EXPECT_FALSE(scene.pictures.plane);
  ASSERT_TRUE(scene.pictures.period);
  EXPECT_FALSE(scene.pictures.period->moved_back);
  EXPECT_EQ(photons_in(scene.pictures.period->counts),
            static_cast<double>(dark.make(1).photons_ps.size()));
}

TEST(FrameFold, WithoutALockOrAPhotonThereIsNothing) {
  PicturedScene scene(moving_target());
  FrameFold fold(scene.made.pattern, {}, ClockReference::tagger);
  FrameView view = scene.frame.view();
  view.sync.locked = false;
  EXPECT_FALSE(fold.fold(view, scene.estimate).period);
  view = scene.frame.view();
  view.photons_ps = {};
  EXPECT_FALSE(fold.fold(view, scene.estimate).period);
}

TEST(FrameFold, WithoutBackgroundEverythingIsFinite) {
  test::FrameMaker clear = moving_target();
  clear.background_per_ns = 0;
  PicturedScene scene(clear);
  scene.estimate.background_per_ns = 0;
  scene.pictures =
      FrameFold(clear.pattern, {}, ClockReference::tagger).fold(scene.frame.view(), scene.estimate);
  ASSERT_TRUE(scene.pictures.plane);
  for (const double nats : scene.pictures.plane->gain_nats) EXPECT_TRUE(std::isfinite(nats));
  for (const double count : scene.pictures.stack->expected) EXPECT_GE(count, 0);
}

}  // namespace
}  // namespace splid
