#include "estimator/frame_values.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "estimator/model/units.hpp"

namespace splid {
namespace {

constexpr double length_ns = 5e7;
constexpr double circle_ns = 4000;

// A target whose delay grows by walk_ns over the frame.
likelihood::Maximum fit_at(double delay_ns, double walk_ns) {
  likelihood::Maximum fit;
  fit.model = likelihood::model_of({delay_ns, walk_ns}, 0.001, 1e-4);
  constexpr auto size = static_cast<Eigen::Index>(likelihood::parameters_of(1));
  fit.covariance = SmallMatrix::Zero(size, size);
  return fit;
}

Estimate values_of(likelihood::Maximum at, const FrameUnits& units = {length_ns, circle_ns, 1},
                   const SyncFit& sync = {}, double quadratic_ns = 0,
                   const checks::Widening& wider = {}) {
  DelayTrack& track = at.model.targets[0].track;
  track.quadratic_ns = quadratic_ns;
  track.delay_ns += track.quadratic_ns / 2;  // the fit's delay is that at mid-frame
  Estimate estimate;
  fill_values(estimate, at, 0, wider, units, sync);
  return estimate;
}

TEST(FrameValues, TheDelayIsThatOfTheLineStretchedByTheMotion) {
  const double walk_ns = walk_ns_at(30, length_ns);
  const Estimate estimate = values_of(fit_at(1000, walk_ns));
  const double beta = 30 / speed_of_light_mps;
  EXPECT_TRUE(estimate.has_values);
  EXPECT_NEAR(estimate.velocity_mps, 30, 1e-9);
  EXPECT_NEAR(estimate.delay_ns, 1000 * (1 + beta), 1e-9);
  EXPECT_NEAR(estimate.delay_start_ns, 1000 * (1 + beta) - beta * length_ns, 1e-9);
  EXPECT_EQ(estimate.std_delay_ns, 0);
}

// A copy of the delay, k circles on, is the same delay: it is folded before it is stretched, or it
// would come out k beta circles further, which is 0.4 ps here.
TEST(FrameValues, ACopyOfTheDelayIsTheDelay) {
  const double walk_ns = walk_ns_at(30, length_ns);
  const Estimate first = values_of(fit_at(1000, walk_ns));
  EXPECT_NEAR(values_of(fit_at(1000 + circle_ns, walk_ns)).delay_ns, first.delay_ns, 1e-9);
  EXPECT_NEAR(values_of(fit_at(1000 - 3 * circle_ns, walk_ns)).delay_ns, first.delay_ns, 1e-9);
}

TEST(FrameValues, DelaysAreInTheClockThatIsRight) {
  const Estimate estimate = values_of(fit_at(1000, 0), {length_ns, circle_ns, 1 + 1e-5});
  EXPECT_NEAR(estimate.delay_ns, 1000.01, 1e-9);
}

// Over a frame a path that curves is at its ends a quarter of the curvature from where a straight
// path through its middle is.
TEST(FrameValues, CurvatureMovesTheDelayAtTheStart) {
  const FrameUnits units{length_ns, circle_ns, 1};
  const Estimate curved = values_of(fit_at(1000, 0), units, {}, 0.8 / 6);
  EXPECT_NEAR(curved.delay_ns, 1000, 1e-9);
  EXPECT_NEAR(curved.delay_start_ns, 1000.2, 1e-9);
  EXPECT_NEAR(curved.acceleration_mps2, acceleration_of(0.8 / 6, length_ns), 1e-9);
}

// Shifts add in quadrature; a larger deviation that the photons show takes the fit's place.
TEST(FrameValues, FindingsWidenTheDeviations) {
  likelihood::Maximum fit = fit_at(1000, 0);
  fit.has_covariance = true;
  fit.covariance(0, 0) = 0.03 * 0.03;
  fit.covariance(1, 1) = 0.1 * 0.1;
  const FrameUnits units{length_ns, circle_ns, 1};
  SyncFit sync;
  sync.period_ps = 4e6;
  const Estimate fitted = values_of(fit, units, sync);
  const Estimate shifted = values_of(fit, units, sync, 0, {0.04, 0, 0, 0.2});
  EXPECT_NEAR(fitted.std_delay_ns, 0.03, 1e-6);
  EXPECT_NEAR(shifted.std_delay_ns, 0.05, 1e-6);
  EXPECT_NEAR(shifted.std_velocity_mps, 2 * fitted.std_velocity_mps, 1e-6);
}

TEST(FrameValues, TheSyncsNoiseIsPartOfTheDeviations) {
  likelihood::Maximum fit = fit_at(1000, 0);
  fit.has_covariance = true;
  fit.covariance(0, 0) = 0.03 * 0.03;
  fit.covariance(1, 1) = 0.1 * 0.1;
  SyncFit sync;
  sync.std_phase_ps = 40;
  sync.period_ps = 4e6;
  sync.std_period_ps = 0.004;
  const Estimate estimate = values_of(fit, {length_ns, circle_ns, 1}, sync);
  EXPECT_NEAR(estimate.std_delay_ns, 0.05, 1e-6);
  const double by_photons = 0.1 / (2 * length_ns);
  const double by_syncs = 0.5e-9;
  EXPECT_NEAR(estimate.std_velocity_mps, speed_of_light_mps * std::hypot(by_photons, by_syncs),
              1e-6);
}

}  // namespace
}  // namespace splid
