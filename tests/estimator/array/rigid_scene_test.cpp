#include "estimator/array/rigid_scene.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "tests/support/allocation_count.hpp"
#include "tests/support/pixel_field.hpp"

namespace splid::array {
namespace {

constexpr double way_m_per_ns = test::PixelField::way_m_per_ns;

test::FrameMaker paper_scene() {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  made.velocity_mps = 77;
  return made;
}

// Pixels that look at surfaces of different distances: measured alone, then together.
class Field : public test::PixelField {
 public:
  Field(std::size_t pixels, const test::FrameMaker& made)
      : PixelField(pixels, made),
        estimates_(pixels),
        bodies_(pixels),
        alone_(made.pattern, {}, {}, {}, made.length_ms, 50'000),
        scene_(made.pattern, {}, {}, {}, made.length_ms, 50'000, directions()) {
    for (std::size_t k = 0; k < pixels; ++k) pixel(k).distance_m += 1.3 * static_cast<double>(k);
  }

  // Returns the number of bodies.
  std::size_t measure(std::uint64_t seed) {
    const std::vector<FrameView>& views = next(seed);
    for (std::size_t k = 0; k < size(); ++k) estimates_[k] = alone_.estimate(views[k]);
    singles_ = estimates_;
    const std::uint64_t before = test::allocations;
    const std::size_t found = scene_.estimate({views, estimates_, bodies_});
    allocations = test::allocations - before;
    return found;
  }

  std::uint64_t allocations = 0;  // of the last frame
  [[nodiscard]] const Estimate& alone(std::size_t k) const { return singles_[k]; }
  [[nodiscard]] const Estimate& together(std::size_t k) const { return estimates_[k]; }
  [[nodiscard]] int body(std::size_t k) const { return bodies_[k]; }
  // Whether an estimate is the pixel's target, to within ten deviations or so.
  [[nodiscard]] bool is_locked(const Estimate& estimate, std::size_t k) const {
    return estimate.status == FrameStatus::ok && std::abs(velocity_error(estimate, k)) < 1 &&
           std::abs(distance_error(estimate, k)) < 0.05;
  }

 private:
  std::vector<Estimate> estimates_, singles_;
  std::vector<int> bodies_;
  FrameEstimator alone_;
  RigidScene scene_;
};

FrameEstimator knows_the_velocity(const test::FrameMaker& resting) {
  SceneOptions scene;
  scene.motion = Motion::static_target;
  return FrameEstimator(resting.pattern, {}, scene, {}, resting.length_ms, 50'000);
}

class Errors {
 public:
  void add(double error, double std) {
    squares_ += error * error;
    pulls_ += error * error / (std * std);
    ++count_;
  }
  [[nodiscard]] double rms() const { return std::sqrt(squares_ / count_); }
  [[nodiscard]] double pull() const { return std::sqrt(pulls_ / count_); }

 private:
  double squares_ = 0, pulls_ = 0, count_ = 0;
};

// The published deviation of the shared velocity is that of a single pixel over the root of the
// pixels, within 5 %, and errors are what it says: the pull of 60 frames is 1 within 0.36 (4
// deviations).
TEST(RigidScene, VelocityGainsWithTheRootOfThePixels) {
  for (const std::size_t pixels : {4U, 16U}) {
    Field field(pixels, paper_scene());
    const int frames = pixels == 4 ? 60 : 30;
    Errors velocity, distance;
    double ratio = 0;
    for (int n = 0; n < frames; ++n) {
      ASSERT_EQ(field.measure(static_cast<std::uint64_t>(n)), 1U);
      const double shared_mps = field.together(0).std_velocity_mps;
      velocity.add(field.velocity_error(field.together(0), 0), shared_mps);
      double information = 0;
      for (std::size_t k = 0; k < pixels; ++k) {
        EXPECT_EQ(field.body(k), 0);
        EXPECT_EQ(field.together(k).velocity_mps, field.together(0).velocity_mps);
        information += std::pow(field.alone(k).std_velocity_mps, -2);
        distance.add(field.distance_error(field.together(k), k),
                     field.together(k).std_delay_ns * way_m_per_ns);
      }
      ratio += shared_mps * std::sqrt(information) / frames;
    }
    EXPECT_NEAR(ratio, 1, 0.05);
    EXPECT_NEAR(velocity.pull(), 1, 4 / std::sqrt(2.0 * frames));
    EXPECT_NEAR(distance.pull(), 1, 4 / std::sqrt(2.0 * frames * static_cast<double>(pixels)));
  }
}

// At a thirteenth of [P]'s light, where half of the pixels show their target alone, the body's
// velocity is right in 99 % of the frames, and 94 % of the pixels have it. An oracle that knows the
// velocity, and searches the delay alone, is at the target in 95 % of the pixels and `ok` in 76 %:
// the others have too few photons. As many are `ok` together, to four deviations of the difference,
// and none of them is at a wrong distance.
TEST(RigidScene, LocksWhereSinglePixelsFail) {
  test::FrameMaker made = paper_scene();
  made.signal_per_pulse = 1.0e-4;
  const std::size_t pixels = 4;
  Field field(pixels, made);
  test::FrameMaker resting = made;
  resting.velocity_mps = 0;
  FrameEstimator oracle = knows_the_velocity(resting);
  const int frames = 240;
  int alone = 0, locks = 0, members = 0, ok = 0, wrong = 0, oracle_ok = 0;
  for (int n = 0; n < frames; ++n) {
    field.measure(static_cast<std::uint64_t>(n));
    int right = 0;
    for (std::size_t k = 0; k < pixels; ++k) {
      const Estimate& together = field.together(k);
      alone += field.is_locked(field.alone(k), k);
      right += field.body(k) == 0 && std::abs(field.velocity_error(together, k)) < 0.5;
      ok += field.is_locked(together, k);
      wrong += together.status == FrameStatus::ok && !field.is_locked(together, k);
      const test::FrameMaker::Frame frame =
          resting.make(1'000'000U + 1000U * static_cast<unsigned>(n) + k);
      oracle_ok += oracle.estimate(frame.view()).status == FrameStatus::ok;
    }
    locks += right > 0;
    members += right;
  }
  const int all = frames * static_cast<int>(pixels);
  EXPECT_NEAR(alone, 0.55 * all, 0.08 * all);
  EXPECT_GE(locks, frames - 1);
  EXPECT_GE(members, 0.94 * all);
  EXPECT_NEAR(ok, oracle_ok, 4 * std::sqrt(2 * 0.76 * 0.24 * all));
  EXPECT_LE(wrong, 1);
}

TEST(RigidScene, APixelThatDoesNotAgreeLeaves) {
  Field field(8, paper_scene());
  field.pixel(2).velocity_mps = 20;
  field.pixel(5).velocity_mps = 77.6;  // some ten deviations of its own
  for (std::uint64_t n = 0; n < 10; ++n) {
    EXPECT_EQ(field.measure(n), 1U);
    for (std::size_t k = 0; k < field.size(); ++k) {
      const bool leaves = k == 2 || k == 5;
      EXPECT_EQ(field.body(k), leaves ? -1 : 0) << k;
      EXPECT_TRUE(field.is_locked(field.together(k), k)) << k;
      EXPECT_LT(std::abs(field.velocity_error(field.together(k), k)), 0.2) << k;
    }
  }
}

TEST(RigidScene, APlateAndAWallAreTwoBodies) {
  Field field(10, paper_scene());
  for (std::size_t k = 0; k < 4; ++k) field.pixel(k).velocity_mps = 1.2;
  field.pixel(9).signal_per_pulse = 0;
  for (std::uint64_t n = 0; n < 5; ++n) {
    EXPECT_EQ(field.measure(n), 2U);
    for (std::size_t k = 0; k < 9; ++k) EXPECT_EQ(field.body(k), k < 4 ? 1 : 0) << k;
    EXPECT_EQ(field.body(9), -1);
    EXPECT_EQ(field.together(9).status, FrameStatus::no_target);
  }
}

// 0.6 m/s from one side of the field to the other: 15 deviations of a single pixel's velocity.
TEST(RigidScene, ABodyThatTurns) {
  Field field(16, paper_scene());
  for (std::size_t k = 0; k < field.size(); ++k) {
    field.pixel(k).velocity_mps += 1.0 * field.directions()[k].azimuth_deg;
    field.pixel(k).velocity_mps -= 0.5 * field.directions()[k].elevation_deg;
  }
  Errors velocity;
  for (std::uint64_t n = 0; n < 10; ++n) {
    EXPECT_EQ(field.measure(n), 1U);
    for (std::size_t k = 0; k < field.size(); ++k) {
      EXPECT_EQ(field.body(k), 0) << k;
      velocity.add(field.velocity_error(field.together(k), k), field.together(k).std_velocity_mps);
    }
  }
}

// Neither where the estimates tell the velocity, nor where the cells have to.
TEST(RigidScene, AllocatesNothing) {
  test::FrameMaker made = paper_scene();
  made.signal_per_pulse = 1.0e-4;
  Field field(12, made);
  for (std::uint64_t n = 0; n < 6; ++n) {
    field.measure(n);
    EXPECT_EQ(field.allocations, 0U) << n;
    for (std::size_t k = 0; n >= 3 && k < field.size(); ++k) field.pixel(k).signal_per_pulse = 1e-3;
  }
}

TEST(RigidScene, DarkPixelsStayDark) {
  test::FrameMaker made = paper_scene();
  made.signal_per_pulse = 0;
  Field field(6, made);
  for (std::uint64_t n = 0; n < 4; ++n) {
    EXPECT_EQ(field.measure(n), 0U);
    for (std::size_t k = 0; k < field.size(); ++k) {
      EXPECT_EQ(field.together(k).status, field.alone(k).status);
      EXPECT_EQ(field.body(k), -1);
    }
  }
}

}  // namespace
}  // namespace splid::array
