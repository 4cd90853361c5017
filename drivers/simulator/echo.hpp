#pragma once

#include <optional>

#include "drivers/simulator/fine_time.hpp"
#include "drivers/simulator/target_path.hpp"

namespace splid::simulator {

// How long light that leaves the lidar at `emitted` is under way to the target and back, in ps of
// the tagger's clock: 2 (t_h - t_e), where z(t_h) = c (t_h - t_e), solved for the meeting point.
// Absent where the target is not in front of the lidar. To 1e-4 ps at distances up to 1e6 m.
std::optional<double> round_trip_ps(const TargetPath& motion, const FineTime& emitted);

}  // namespace splid::simulator
