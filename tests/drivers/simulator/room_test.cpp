#include "drivers/simulator/room.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "drivers/simulator/surface.hpp"
#include "drivers/simulator/target_path.hpp"

namespace splid::simulator {
namespace {

using Matrix = std::array<Vector, 3>;  // rows

RoomOptions room() {
  RoomOptions options;
  options.ahead_m = 14;
  options.behind_m = 11;
  options.left_m = 6;
  options.right_m = 9;
  options.up_m = 4;
  options.down_m = 3;
  return options;
}

RoomOptions moving_room() {
  RoomOptions options = room();
  options.velocity_mps = {1.5, -0.4, 0.2};
  options.turn_deg_per_s = {5, -8, 20};
  return options;
}

Vector times(const Matrix& m, const Vector& x) {
  Vector y{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) y[i] += m[i][k] * x[k];
  }
  return y;
}

// The distance along a direction of a sensor whose pose is followed in small steps.
double stepped_distance_m(const RoomOptions& options, const Vector& direction, double time_s) {
  constexpr int steps = 4000;
  const double step_s = time_s / steps;
  Vector w{};
  for (std::size_t i = 0; i < 3; ++i) {
    w[i] = options.turn_deg_per_s[i] * std::numbers::pi / 180 * step_s;
  }
  Matrix pose = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Vector place{};
  // A step of the turn, to the third order of its angle.
  const Matrix k = {{{0, -w[2], w[1]}, {w[2], 0, -w[0]}, {-w[1], w[0], 0}}};
  const Vector velocity = {options.velocity_mps[0], options.velocity_mps[1],
                           options.velocity_mps[2]};
  for (int i = 0; i < steps; ++i) {
    Matrix next = pose;
    Matrix term = pose;
    for (const double divisor : {1.0, 2.0, 3.0}) {
      Matrix product{};
      for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 3; ++c) {
          for (std::size_t j = 0; j < 3; ++j) product[r][c] += term[r][j] * k[j][c] / divisor;
          next[r][c] += product[r][c];
        }
      }
      term = product;
    }
    const Vector before = times(pose, velocity);
    const Vector after = times(next, velocity);
    for (std::size_t j = 0; j < 3; ++j) place[j] += step_s * (before[j] + after[j]) / 2;
    pose = next;
  }
  const Vector ray = times(pose, direction);
  const std::array<std::array<double, 2>, 3> walls = {{{options.ahead_m, options.behind_m},
                                                       {options.left_m, options.right_m},
                                                       {options.up_m, options.down_m}}};
  double nearest_m = 1e9;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (ray[axis] > 0) nearest_m = std::min(nearest_m, (walls[axis][0] - place[axis]) / ray[axis]);
    if (ray[axis] < 0) nearest_m = std::min(nearest_m, (walls[axis][1] + place[axis]) / -ray[axis]);
  }
  return nearest_m;
}

TEST(Room, EachWallIsWhereTheOptionsSay) {
  for (const auto& [direction, distance_m] : {std::pair<Vector, double>{{1, 0, 0}, 14},
                                              {{-1, 0, 0}, 11},
                                              {{0, 1, 0}, 6},
                                              {{0, -1, 0}, 9},
                                              {{0, 0, 1}, 4},
                                              {{0, 0, -1}, 3}}) {
    const MotionState state = RoomSight(room(), direction).at(5);
    EXPECT_EQ(state.distance_m, distance_m);
    EXPECT_EQ(state.velocity_mps, 0);
  }
}

TEST(Room, DirectionsLookRightAndUp) {
  const Direction right_up{30, 20};
  const double reach_m = 9 / (std::cos(20 * std::numbers::pi / 180) * 0.5);
  EXPECT_NEAR(meet(room(), right_up)->path.room->at(0).distance_m,
              std::min(reach_m, 4 / std::sin(20 * std::numbers::pi / 180)), 1e-12);
  RoomOptions right = room();
  right.ahead_m = right.left_m = right.up_m = 0;
  EXPECT_NEAR(meet(right, right_up)->path.room->at(0).distance_m, reach_m, 1e-12);
  EXPECT_EQ(meet(right, right_up)->signal_per_pulse, 13.5e-4);
  // To the left there is no wall.
  EXPECT_FALSE(meet(right, {-30, 20}));
  EXPECT_FALSE(meet(RoomOptions{}, right_up));
}

TEST(Room, AMovingSensorIsFollowed) {
  for (const double azimuth_deg : {-70.0, -20.0, 35.0, 80.0}) {
    const Vector direction = Direction{azimuth_deg, 12}.unit();
    const RoomSight sight(moving_room(), direction);
    for (const double time_s : {-1.0, 0.7, 3.0}) {
      EXPECT_NEAR(sight.at(time_s).distance_m, stepped_distance_m(moving_room(), direction, time_s),
                  1e-6);
    }
    RoomOptions straight = moving_room();
    straight.turn_deg_per_s = {0, 0, 0};
    EXPECT_NEAR(RoomSight(straight, direction).at(2).distance_m,
                stepped_distance_m(straight, direction, 2), 1e-9);
  }
}

TEST(Room, VelocityIsTheSlope) {
  TargetOptions options;
  options.room.emplace(moving_room(), Direction{25, -9}.unit());
  const TargetPath path(options, 1.001);
  constexpr double step_s = 1e-5;
  for (double time_s = -1; time_s < 4; time_s += 0.37) {
    const double slope_mps = (path.at((time_s + step_s) * 1.001).distance_m -
                              path.at((time_s - step_s) * 1.001).distance_m) /
                             (2 * step_s);
    EXPECT_NEAR(path.at(time_s * 1.001).velocity_mps, slope_mps, 1e-6) << time_s;
  }
}

TEST(Room, ASensorThatLeavesSeesNothing) {
  RoomOptions options = room();
  options.velocity_mps = {7, 0, 0};
  EXPECT_GT(RoomSight(options, {1, 0, 0}).at(1.9).distance_m, 0);
  EXPECT_LT(RoomSight(options, {1, 0, 0}).at(2.1).distance_m, 0);
  RoomOptions wall;
  wall.ahead_m = 5;
  EXPECT_EQ(RoomSight(wall, {0, 1, 0}).at(0).distance_m, 0);
}

TEST(Room, VectorsHaveThreeValues) {
  RoomOptions options = room();
  options.velocity_mps = {1, 2};
  EXPECT_EQ(options.validate().value().pointer, "/velocity_mps");
  options = room();
  options.turn_deg_per_s = {};
  EXPECT_EQ(options.validate().value().pointer, "/turn_deg_per_s");
}

}  // namespace
}  // namespace splid::simulator
