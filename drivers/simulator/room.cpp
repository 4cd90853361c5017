#include "drivers/simulator/room.hpp"

#include <cmath>
#include <numbers>
#include <string>

#include "drivers/simulator/portable_math.hpp"

namespace splid::simulator {
namespace {

constexpr double farthest_m = 1e6;
constexpr double fastest_mps = 1e3;
constexpr double fastest_turn_deg_per_s = 3600;

double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// a + factor * b
Vector sum(const Vector& a, double factor, const Vector& b) {
  return {a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]};
}

Vector vector_of(const std::vector<double>& values) { return {values[0], values[1], values[2]}; }

}  // namespace

void RoomOptions::describe(OptionVisitor& visitor) {
  const Bounds distance{0, farthest_m};
  visitor.number("ahead_m", ahead_m, distance,
                 "distance of the wall ahead at the start, m; 0: no such wall");
  visitor.number("behind_m", behind_m, distance,
                 "distance of the wall behind at the start, m; 0: no such wall");
  visitor.number("left_m", left_m, distance,
                 "distance of the wall to the left at the start, m; 0: no such wall");
  visitor.number("right_m", right_m, distance,
                 "distance of the wall to the right at the start, m; 0: no such wall");
  visitor.number("up_m", up_m, distance, "distance of the ceiling at the start, m; 0: no ceiling");
  visitor.number("down_m", down_m, distance, "distance of the floor at the start, m; 0: no floor");
  visitor.numbers("velocity_mps", velocity_mps, {-fastest_mps, fastest_mps},
                  "velocity of the sensor: ahead, to the left, up; m/s");
  visitor.numbers("turn_deg_per_s", turn_deg_per_s,
                  {-fastest_turn_deg_per_s, fastest_turn_deg_per_s},
                  "turn of the sensor about these axes, by the right-hand rule, degrees a second");
  visitor.number("signal_per_pulse", signal_per_pulse, {0, 1e3},
                 "mean detections of a pulse of amplitude 1 in a pixel that looks at a wall");
}

std::optional<OptionFault> RoomOptions::validate() const {
  const auto fault = [](const char* key, const std::vector<double>& values) {
    return OptionFault{key, "has " + std::to_string(values.size()) +
                                " values; must have three: ahead, to the left, up"};
  };
  if (velocity_mps.size() != 3) return fault("/velocity_mps", velocity_mps);
  if (turn_deg_per_s.size() != 3) return fault("/turn_deg_per_s", turn_deg_per_s);
  return std::nullopt;
}

RoomSight::RoomSight(const RoomOptions& options, const Vector& direction)
    : walls_{{{{1, 0, 0}, options.ahead_m},
              {{-1, 0, 0}, options.behind_m},
              {{0, 1, 0}, options.left_m},
              {{0, -1, 0}, options.right_m},
              {{0, 0, 1}, options.up_m},
              {{0, 0, -1}, options.down_m}}},
      velocity_mps_(vector_of(options.velocity_mps)),
      direction_(direction) {
  const Vector turn = vector_of(options.turn_deg_per_s);
  const double deg_per_s = std::sqrt(dot(turn, turn));
  turns_per_s_ = deg_per_s / 360;
  if (deg_per_s > 0) axis_ = sum({}, 1 / deg_per_s, turn);
}

// Design note: with the constant turn w and velocity v along the sensor's axes, after the angle a a
// direction x is R x = x + sin(a) k x x + (1 - cos(a)) k x (k x x) along the axes of the start, k
// being the turn's axis, and the sensor is at the integral of R v. A wall n x = c has then the
// normal R'n and the distance c - n p along the sensor's axes. The distance z = c / (n u) along a
// direction u changes by -n (v + w x (z u)) / (n u).
MotionState RoomSight::at(double time_s) const {
  const double turns = turns_per_s_ * time_s;
  const double sine = sin_turns(turns);
  const double half_sine = sin_turns(turns / 2);
  const double versine = 2 * half_sine * half_sine;  // 1 - cos, without a difference of large ones
  const double turn_per_s = 2 * std::numbers::pi * turns_per_s_;
  const auto turned = [&](const Vector& x, double direction) {
    const Vector across = cross(axis_, x);
    return sum(sum(x, direction * sine, across), versine, cross(axis_, across));
  };
  Vector place = sum({}, time_s, velocity_mps_);
  if (turn_per_s > 0) {
    const Vector across = cross(axis_, velocity_mps_);
    place = sum(place, versine / turn_per_s, across);
    place = sum(place, time_s - sine / turn_per_s, cross(axis_, across));
  }
  std::optional<MotionState> nearest;
  for (const Wall& wall : walls_) {
    if (!(wall.distance_m > 0)) continue;
    const Vector normal = turned(wall.normal, -1);
    const double along = dot(normal, direction_);
    if (!(along > 1e-9)) continue;
    const double distance_m = (wall.distance_m - dot(wall.normal, place)) / along;
    if (nearest && distance_m >= nearest->distance_m) continue;
    const Vector sweep = cross(axis_, direction_);
    const Vector motion = sum(velocity_mps_, turn_per_s * distance_m, sweep);
    nearest = MotionState{distance_m, -dot(normal, motion) / along};
  }
  return nearest.value_or(MotionState{});
}

}  // namespace splid::simulator
