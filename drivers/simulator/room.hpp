#pragma once

#include <array>
#include <optional>
#include <vector>

#include "drivers/simulator/motion_state.hpp"
#include "protocol/options.hpp"

namespace splid::simulator {

// Ahead, to the left, up: the axes of point clouds.
using Vector = std::array<double, 3>;

// A room with flat walls, and the sensor that moves and turns through it. JSON: `source`/`array`/
// `room`.
//
// Velocity and turn are constant along the sensor's own axes, as of a car that drives a circle: a
// program of odometry then finds the same velocity and turn at every time of a scan.
struct RoomOptions {
  double ahead_m = 0;  // from the sensor to the wall at the stream's start; 0: no wall
  double behind_m = 0;
  double left_m = 0;
  double right_m = 0;
  double up_m = 0;
  double down_m = 0;
  std::vector<double> velocity_mps = {0, 0, 0};    // of the sensor: ahead, to the left, up
  std::vector<double> turn_deg_per_s = {0, 0, 0};  // about these axes, by the right-hand rule
  double signal_per_pulse = 13.5e-4;

  void describe(OptionVisitor& visitor);
  [[nodiscard]] std::optional<OptionFault> validate() const;
};

// The distance to the nearest wall along a direction of a sensor that moves through a room.
//
// Threads: any. Errors: none. No allocation.
class RoomSight {
 public:
  // options: valid. direction: of length 1, along the sensor's axes.
  RoomSight(const RoomOptions& options, const Vector& direction);

  // time_s: true seconds since the stream's start. The distance is 0 where the direction meets
  // no wall, and negative where the sensor has passed through one.
  [[nodiscard]] MotionState at(double time_s) const;

 private:
  struct Wall {
    Vector normal;  // at the stream's start
    double distance_m;
  };

  std::array<Wall, 6> walls_;
  Vector velocity_mps_;
  Vector axis_{};  // of the turn, of length 1; 0 without a turn
  double turns_per_s_;
  Vector direction_;
};

}  // namespace splid::simulator
