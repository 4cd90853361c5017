#include "drivers/simulator/array_options.hpp"

#include <string>

namespace splid::simulator {
namespace {

// Ten thousand pixels in all.
constexpr std::int64_t most_columns = 100;
constexpr std::int64_t largest_array_input = 10'100;
constexpr double largest_angle_deg = 89;

void describe_input(ArrayInput& input, OptionVisitor& visitor) {
  visitor.integer("input", input.input, 0, largest_array_input, "input number of the detector");
  visitor.require("input");
  const Bounds angle{-largest_angle_deg, largest_angle_deg};
  visitor.number("azimuth_deg", input.azimuth_deg, angle,
                 "azimuth of its direction, degrees to the right of the axis");
  visitor.number("elevation_deg", input.elevation_deg, angle,
                 "elevation of its direction, degrees above the axis");
  visitor.number("delay_ps", input.delay_ps, {0, 1e7}, "delay of its cable, ps");
  visitor.number("dark_per_s", input.dark_per_s, {0, 1e9}, "dark counts of the detector a second");
  visitor.number("distance_m", input.distance_m, {0, max_distance_m},
                 "distance of its target at the start, m; absent: the nearest surface");
  visitor.number("velocity_mps", input.velocity_mps, {-max_speed_mps, max_speed_mps},
                 "velocity of that target, with distance_m, m/s");
  visitor.number("signal_per_pulse", input.signal_per_pulse, {0, 1e3},
                 "mean detections of a pulse of amplitude 1; absent: the surface's");
}

OptionFault inside(OptionFault fault, const std::string& place) {
  fault.pointer = place + fault.pointer;
  return fault;
}

}  // namespace

void ArrayOptions::describe(OptionVisitor& visitor) {
  visitor.integer("columns", columns, 0, most_columns, "pixels in a row; 0: no array");
  visitor.integer("rows", rows, 1, most_columns, "rows of pixels");
  visitor.number("pitch_deg", pitch_deg, {1e-6, 10}, "angle between neighbours, degrees");
  visitor.objects(
      "inputs", [this](std::size_t count) { inputs.resize(count); },
      [this](OptionVisitor& member, std::size_t i) {
        ArrayInput placeholder;
        describe_input(i < inputs.size() ? inputs[i] : placeholder, member);
      },
      inputs.size(), "detectors that differ from the others");
  visitor.objects(
      "planes", [this](std::size_t count) { planes.resize(count); },
      [this](OptionVisitor& member, std::size_t i) {
        Plane placeholder;
        (i < planes.size() ? planes[i] : placeholder).describe(member);
      },
      planes.size(), "planes that the pixels look at; the nearest at the start counts");
  visitor.object(
      "picture", [this](OptionVisitor& members) { picture.describe(members); },
      "pictures of distance and velocity that the pixels look at, as a plane of any shape");
  visitor.object(
      "room", [this](OptionVisitor& members) { room.describe(members); },
      "a room with flat walls, through which the sensor moves and turns");
  visitor.number("crosstalk_probability", crosstalk_probability, {0, 0.9},
                 "probability that a detection makes another in a neighbouring pixel");
  visitor.number("crosstalk_ns", crosstalk_ns, {0, 1e4},
                 "mean time between the two detections, ns");
}

std::optional<OptionFault> ArrayOptions::validate(std::int64_t first_input) const {
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const std::int64_t pixel = inputs[i].input - first_input;
    if (pixel >= 0 && pixel < columns * rows) continue;
    return OptionFault{"/inputs/" + std::to_string(i) + "/input",
                       "is " + std::to_string(inputs[i].input) + "; the array has the inputs " +
                           std::to_string(first_input) + " to " +
                           std::to_string(first_input + columns * rows - 1)};
  }
  for (std::size_t i = 0; i < planes.size(); ++i) {
    auto fault = planes[i].validate();
    if (fault) return inside(*fault, "/planes/" + std::to_string(i));
  }
  auto fault = picture.validate();
  if (fault) return inside(*fault, "/picture");
  fault = room.validate();
  if (fault) return inside(*fault, "/room");
  return std::nullopt;
}

}  // namespace splid::simulator
