#include "drivers/simulator/target_path.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "drivers/simulator/portable_math.hpp"

namespace splid::simulator {
namespace {

constexpr std::array<const char*, 3> motion_names = {"linear", "sinusoid", "points"};

OptionFault too_fast(const std::string& pointer, double speed_mps) {
  return {pointer, "makes the target move at " + std::to_string(speed_mps) +
                       " m/s; at most 30000 m/s can be simulated"};
}

std::optional<OptionFault> validate_points(const std::vector<TargetOptions::Point>& points) {
  if (points.size() < 2) {
    return OptionFault{"/points", "has " + std::to_string(points.size()) +
                                      " points; the motion \"points\" needs at least 2"};
  }
  for (std::size_t i = 1; i < points.size(); ++i) {
    const std::string pointer = "/points/" + std::to_string(i);
    const double step_s = points[i].time_s - points[i - 1].time_s;
    if (!(step_s > 0)) {
      return OptionFault{pointer + "/time_s", "is " + std::to_string(points[i].time_s) +
                                                  " s; must be later than the point before"};
    }
    const double speed_mps = std::abs(points[i].distance_m - points[i - 1].distance_m) / step_s;
    if (speed_mps > max_speed_mps) return too_fast(pointer + "/distance_m", speed_mps);
  }
  return std::nullopt;
}

std::optional<OptionFault> validate_sinusoid(const TargetOptions& options) {
  const double speed_mps = 2 * std::numbers::pi * std::abs(options.amplitude_m) / options.period_s;
  if (speed_mps > max_speed_mps) return too_fast("/amplitude_m", speed_mps);
  if (std::abs(options.amplitude_m) > options.distance_m) {
    return OptionFault{"/amplitude_m",
                       "is " + std::to_string(options.amplitude_m) +
                           " m; must not pass distance_m, or the target goes through the lidar"};
  }
  return std::nullopt;
}

}  // namespace

void TargetOptions::describe(OptionVisitor& visitor) {
  choose(visitor, "motion", motion, motion_names,
         "linear: constant velocity; sinusoid: to and fro; points: straight lines between points, "
         "forwards, then backwards, and so on");
  visitor.number("distance_m", distance_m, {0, max_distance_m},
                 "distance at the start (linear) or mean distance (sinusoid), m");
  visitor.number("velocity_mps", velocity_mps, {-max_speed_mps, max_speed_mps},
                 "linear: velocity, positive away from the lidar, m/s");
  visitor.number("amplitude_m", amplitude_m, {-max_distance_m, max_distance_m},
                 "sinusoid: largest excursion from the mean distance, m");
  visitor.number("period_s", period_s, {1e-6, 1e9}, "sinusoid: time to and fro, s");
  visitor.number("phase_turns", phase_turns, {-1, 1},
                 "sinusoid: where it starts, in turns; 0 is the mean distance, going away");
  visitor.objects(
      "points", [this](std::size_t count) { points.resize(count); },
      [this](OptionVisitor& member, std::size_t i) {
        Point placeholder;
        Point& point = i < points.size() ? points[i] : placeholder;
        member.number("time_s", point.time_s, {-1e9, 1e9}, "time since the stream's start, s");
        member.require("time_s");
        member.number("distance_m", point.distance_m, {0, max_distance_m}, "distance, m");
        member.require("distance_m");
      },
      points.size(), "points: at least two, in the order of time");
  visitor.number("depth_m", depth_m, {0, 1e4},
                 "depth of the target behind distance_m, evenly lit, m; 0: one surface");
  visitor.number("edge_period_s", edge_period_s, {0, 1e9},
                 "period of a beam that goes to and fro over an edge: light comes from the front "
                 "and the back of depth_m only, s; 0: no edge");
}

std::optional<OptionFault> TargetOptions::validate() const {
  if (motion == MotionKind::points) return validate_points(points);
  if (motion == MotionKind::sinusoid) return validate_sinusoid(*this);
  return std::nullopt;
}

TargetPath::TargetPath(TargetOptions options, double clock_rate)
    : options_(std::move(options)), clock_rate_(clock_rate) {}

MotionState TargetPath::at(double tagger_s) const {
  const double time_s = tagger_s / clock_rate_;
  if (options_.room) return options_.room->at(time_s);
  switch (options_.motion) {
    case MotionKind::sinusoid:
      return on_sinusoid(time_s);
    case MotionKind::points:
      return between_points(time_s);
    case MotionKind::linear:
      break;
  }
  return {options_.distance_m + options_.velocity_mps * time_s, options_.velocity_mps};
}

double TargetPath::behind_m(double tagger_s, double chance) const {
  if (!(options_.edge_period_s > 0)) return options_.depth_m * chance;
  const double turns = tagger_s / clock_rate_ / options_.edge_period_s;
  const double back_share = 1 - std::abs(2 * (turns - std::floor(turns)) - 1);
  return chance < back_share ? options_.depth_m : 0;
}

MotionState TargetPath::on_sinusoid(double time_s) const {
  const double turns = time_s / options_.period_s + options_.phase_turns;
  const double rate_per_s = 2 * std::numbers::pi / options_.period_s;
  return {options_.distance_m + options_.amplitude_m * sin_turns(turns),
          options_.amplitude_m * rate_per_s * cos_turns(turns)};
}

MotionState TargetPath::between_points(double time_s) const {
  const std::vector<TargetOptions::Point>& points = options_.points;
  const double span_s = points.back().time_s - points.front().time_s;
  double along_s = time_s - points.front().time_s;
  along_s -= 2 * span_s * std::floor(along_s / (2 * span_s));
  const bool backwards = along_s >= span_s;
  if (backwards) along_s = 2 * span_s - along_s;
  const double folded_s = points.front().time_s + along_s;
  const auto later = [](double time, const TargetOptions::Point& point) {
    return time < point.time_s;
  };
  const auto end = std::upper_bound(points.begin() + 1, points.end() - 1, folded_s, later);
  const auto begin = end - 1;
  const double slope_mps = (end->distance_m - begin->distance_m) / (end->time_s - begin->time_s);
  return {begin->distance_m + slope_mps * (folded_s - begin->time_s),
          backwards ? -slope_mps : slope_mps};
}

}  // namespace splid::simulator
