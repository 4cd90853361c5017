#include "drivers/simulator/surface.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "drivers/simulator/portable_math.hpp"
#include "protocol/error.hpp"

namespace splid::simulator {
namespace {

constexpr double widest_deg = 89;

bool holds(const std::vector<double>& range, double value) {
  return range.empty() || (value >= range.front() && value <= range.back());
}

std::optional<OptionFault> range_fault(const char* key, const std::vector<double>& range) {
  if (range.empty() || (range.size() == 2 && range[0] < range[1])) return std::nullopt;
  return OptionFault{std::string("/") + key,
                     "must be two angles, the least and the largest, or empty for all"};
}

// The index of the point at `value` in a row of `count` points that fills the range.
std::size_t place(const std::vector<double>& range, double value, std::size_t count) {
  const double share = (value - range.front()) / (range.back() - range.front());
  const auto index = static_cast<std::size_t>(share * static_cast<double>(count));
  return std::min(index, count - 1);
}

double tangent(double angle_deg) { return sin_turns(angle_deg / 360) / cos_turns(angle_deg / 360); }

TargetOptions scaled(TargetOptions path, double factor) {
  path.distance_m *= factor;
  path.velocity_mps *= factor;
  path.amplitude_m *= factor;
  path.depth_m *= factor;
  for (TargetOptions::Point& point : path.points) point.distance_m *= factor;
  return path;
}

}  // namespace

Vector Direction::unit() const {
  const double azimuth = azimuth_deg / 360;
  const double elevation = elevation_deg / 360;
  return {cos_turns(elevation) * cos_turns(azimuth), -(cos_turns(elevation) * sin_turns(azimuth)),
          sin_turns(elevation)};
}

bool Field::contains(const Direction& direction) const {
  return holds(azimuth_deg, direction.azimuth_deg) && holds(elevation_deg, direction.elevation_deg);
}

void Field::describe(OptionVisitor& visitor) {
  const Bounds bounds{-180, 180};
  visitor.numbers("azimuth_deg", azimuth_deg, bounds,
                  "least and largest azimuth that it fills, degrees; empty: all");
  visitor.numbers("elevation_deg", elevation_deg, bounds,
                  "least and largest elevation that it fills, degrees; empty: all");
}

std::optional<OptionFault> Field::validate() const {
  if (auto fault = range_fault("azimuth_deg", azimuth_deg)) return fault;
  return range_fault("elevation_deg", elevation_deg);
}

void Plane::describe(OptionVisitor& visitor) {
  path.describe(visitor);
  visitor.number(
      "tilt_azimuth_deg", tilt_azimuth_deg, {-widest_deg, widest_deg},
      "tilt: the distance of the plane grows to the right by the tangent of this angle, degrees");
  visitor.number(
      "tilt_elevation_deg", tilt_elevation_deg, {-widest_deg, widest_deg},
      "tilt: the distance of the plane grows upwards by the tangent of this angle, degrees");
  field.describe(visitor);
  visitor.number("signal_per_pulse", signal_per_pulse, {0, 1e3},
                 "mean detections of a pulse of amplitude 1 in a pixel that looks at the plane");
}

std::optional<OptionFault> Plane::validate() const {
  if (auto fault = path.validate()) return fault;
  return field.validate();
}

std::optional<Meeting> Plane::meet(const Direction& direction) const {
  if (!field.contains(direction)) return std::nullopt;
  // x = d + y tan(tilt_azimuth) + z tan(tilt_elevation), with y to the right and z up.
  const auto [ahead, left, up] = direction.unit();
  const double nearing =
      ahead + left * tangent(tilt_azimuth_deg) - up * tangent(tilt_elevation_deg);
  if (!(nearing > 1e-6)) return std::nullopt;
  return Meeting{scaled(path, 1 / nearing), signal_per_pulse};
}

std::optional<Meeting> meet(const RoomOptions& room, const Direction& direction) {
  TargetOptions path;
  path.room.emplace(room, direction.unit());
  if (!(path.room->at(0).distance_m > 0)) return std::nullopt;
  return Meeting{std::move(path), room.signal_per_pulse};
}

void PictureOptions::describe(OptionVisitor& visitor) {
  visitor.path("distance", distance,
               "PGM file of distances, its first row at the top; a value of 0 is no target");
  visitor.path("velocity", velocity, "PGM file of velocities, of the same size; none: at rest");
  visitor.number("distance_m", distance_m, {0, max_distance_m},
                 "the distance of a value is distance_m + value * distance_step_m, m");
  visitor.number("distance_step_m", distance_step_m, {1e-9, 1e6},
                 "distance for each step of the value, m");
  visitor.number("velocity_mps", velocity_mps, {-max_speed_mps, max_speed_mps},
                 "velocity of the value 0, m/s");
  visitor.number("velocity_step_mps", velocity_step_mps, {1e-9, 1e3},
                 "velocity for each step of the value, m/s");
  field.describe(visitor);
  visitor.number("signal_per_pulse", signal_per_pulse, {0, 1e3},
                 "mean detections of a pulse of amplitude 1 in a pixel that looks at the picture");
}

std::optional<OptionFault> PictureOptions::validate() const {
  if (auto fault = field.validate()) return fault;
  if (distance.empty() && !velocity.empty()) {
    return OptionFault{"/velocity", "is given without distance; give both files"};
  }
  if (field.azimuth_deg.empty() || field.elevation_deg.empty()) {
    return OptionFault{field.azimuth_deg.empty() ? "/azimuth_deg" : "/elevation_deg",
                       "is empty; a picture fills a range of angles"};
  }
  return std::nullopt;
}

PictureSurface::PictureSurface(PictureOptions options) : options_(std::move(options)) {
  if (options_.distance.empty()) return;
  distance_ = read_pgm(options_.distance);
  if (options_.velocity.empty()) return;
  velocity_ = read_pgm(options_.velocity);
  if (velocity_->columns == distance_->columns && velocity_->rows == distance_->rows) return;
  throw Error(Fault::usage, options_.velocity + ": has " + std::to_string(velocity_->columns) +
                                " x " + std::to_string(velocity_->rows) + " points; " +
                                options_.distance + " has " + std::to_string(distance_->columns) +
                                " x " + std::to_string(distance_->rows));
}

std::optional<Meeting> PictureSurface::meet(const Direction& direction) const {
  if (!distance_ || !options_.field.contains(direction)) return std::nullopt;
  const std::size_t column =
      place(options_.field.azimuth_deg, direction.azimuth_deg, distance_->columns);
  const std::size_t above =
      place(options_.field.elevation_deg, direction.elevation_deg, distance_->rows);
  const std::size_t index = (distance_->rows - 1 - above) * distance_->columns + column;
  if (distance_->values[index] == 0) return std::nullopt;
  Meeting meeting{{}, options_.signal_per_pulse};
  meeting.path.motion = MotionKind::linear;
  meeting.path.distance_m =
      options_.distance_m + options_.distance_step_m * distance_->values[index];
  if (velocity_) {
    meeting.path.velocity_mps =
        options_.velocity_mps + options_.velocity_step_mps * velocity_->values[index];
  }
  return meeting;
}

}  // namespace splid::simulator
