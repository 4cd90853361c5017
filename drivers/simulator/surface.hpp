#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drivers/simulator/picture.hpp"
#include "drivers/simulator/room.hpp"
#include "drivers/simulator/target_path.hpp"
#include "protocol/options.hpp"

namespace splid::simulator {

// Where a pixel looks: azimuth to the right and elevation up, from the lidar's axis.
struct Direction {
  double azimuth_deg = 0;
  double elevation_deg = 0;

  // Of length 1: ahead, to the left, up.
  [[nodiscard]] Vector unit() const;
};

// What a direction meets: the path along the line of sight, and the return signal.
struct Meeting {
  TargetOptions path;
  double signal_per_pulse = 0;  // mean detections of a pulse of amplitude 1
};

// A field of directions, both ends included; unbounded where its list is empty.
struct Field {
  std::vector<double> azimuth_deg;  // least, largest
  std::vector<double> elevation_deg;

  [[nodiscard]] bool contains(const Direction& direction) const;
  void describe(OptionVisitor& visitor);
  [[nodiscard]] std::optional<OptionFault> validate() const;
};

// A plane that moves along the lidar's axis. Tilted, it is a ramp; in a field of its own, a plate.
// JSON: an element of `source`/`array`/`planes`.
//
// Design note: with the plane's normal n, a ray u meets the plane at z = d n_x / (n u), d being the
// distance on the axis. The factor does not change with time, so that distance and velocity along
// the ray are those on the axis times the factor.
struct Plane {
  TargetOptions path;             // on the axis, whether or not the field has the axis in it
  double tilt_azimuth_deg = 0;    // > 0: farther to the right
  double tilt_elevation_deg = 0;  // > 0: farther up
  Field field;
  double signal_per_pulse = 13.5e-4;

  void describe(OptionVisitor& visitor);
  [[nodiscard]] std::optional<OptionFault> validate() const;
  // Absent where the direction does not meet the plane.
  [[nodiscard]] std::optional<Meeting> meet(const Direction& direction) const;
};

// The wall of a room that a direction meets. Absent where it meets none at the stream's start.
std::optional<Meeting> meet(const RoomOptions& room, const Direction& direction);

// A picture of distances and one of velocities, along the line of sight. JSON: `source`/`array`/
// `picture`. The pictures fill the field; the nearest of their points counts.
struct PictureOptions {
  std::string distance;             // PGM file; empty: no picture
  std::string velocity;             // PGM file; empty: at rest
  double distance_m = 0;            // of the value 1, less one step
  double distance_step_m = 1e-3;    // a step of the value
  double velocity_mps = 0;          // of the value 0
  double velocity_step_mps = 1e-3;  // a step of the value
  Field field{{-1, 1}, {-1, 1}};
  double signal_per_pulse = 13.5e-4;

  void describe(OptionVisitor& visitor);
  [[nodiscard]] std::optional<OptionFault> validate() const;
};

// The surface that a PictureOptions describes, with its files read.
class PictureSurface {
 public:
  // Errors: Error(Fault::usage) of a file that cannot be read, or of pictures of unequal size.
  explicit PictureSurface(PictureOptions options);
  // Absent outside the field, and where the value of the distance is 0.
  [[nodiscard]] std::optional<Meeting> meet(const Direction& direction) const;

 private:
  PictureOptions options_;
  std::optional<Picture> distance_;
  std::optional<Picture> velocity_;
};

}  // namespace splid::simulator
