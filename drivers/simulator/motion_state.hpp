#pragma once

namespace splid::simulator {

struct MotionState {
  double distance_m = 0;    // from the lidar
  double velocity_mps = 0;  // positive away from the lidar
};

}  // namespace splid::simulator
