#pragma once

#include <array>
#include <cstdint>

// The room cloud/ writes frames of pixels whose directions are known as a cloud of points for other
// programs. Read this header first: it says what a point is. Its parts:
//   points.hpp      from frames to points
//   encoding.hpp    what all formats have in common; pcd.hpp, ply.hpp, las.hpp and rows.hpp are one
//                   each
//   cloud_file.hpp  from points to a file, in bounded memory; clouds.hpp: one for each frame

namespace splid::cloud {

// What a frame of one pixel, or one of its targets, shows. A value that the frame does not have is
// not a number.
struct Point {
  double x = 0, y = 0, z = 0;      // m; ahead, to the left, up
  double radial_velocity = 0;      // m/s, receding positive
  double std_radial_velocity = 0;  // m/s, one standard deviation
  double std_distance = 0;         // m, one standard deviation
  double signal_per_pulse = 0;     // detections
  double background_per_s = 0;     // detections
  double significance = 0;         // nats gained over no target
  double time_s = 0;               // UTC since 1970, middle of the dwell
  std::uint32_t pixel = 0;         // its place in the configuration, from 0
};

// How a value is kept.
enum class Kind { float32, float64, uint32 };

constexpr std::uint32_t bytes_of(Kind kind) { return kind == Kind::float64 ? 8 : 4; }

// What a point has besides its place. `value` is of the members that are real numbers; the pixel
// has none.
struct Column {
  const char* name;
  const char* unit;  // and what the value is, in at most 31 characters
  Kind kind;
  double Point::*value;
};

inline constexpr std::array<Column, 8> columns{{
    {"radial_velocity", "m/s, receding positive", Kind::float32, &Point::radial_velocity},
    {"std_radial_velocity", "m/s, one standard deviation", Kind::float32,
     &Point::std_radial_velocity},
    {"std_distance", "m, one standard deviation", Kind::float32, &Point::std_distance},
    {"signal_per_pulse", "detections", Kind::float32, &Point::signal_per_pulse},
    {"background_per_s", "detections", Kind::float32, &Point::background_per_s},
    {"significance", "nats over no target", Kind::float32, &Point::significance},
    {"time", "s, UTC since 1970, mid-dwell", Kind::float64, &Point::time_s},
    {"pixel", "its place in pixels, from 0", Kind::uint32, nullptr},
}};

}  // namespace splid::cloud
