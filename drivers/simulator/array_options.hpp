#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/simulator/surface.hpp"
#include "protocol/options.hpp"

namespace splid::simulator {

// One detector of an array, where it differs from the others. JSON: an element of
// `source`/`array`/`inputs`. An absent member is as in the scene.
struct ArrayInput {
  std::int64_t input = 1;
  std::optional<double> azimuth_deg;
  std::optional<double> elevation_deg;
  double delay_ps = 0;  // of its cable
  std::optional<double> dark_per_s;
  std::optional<double> distance_m;  // with velocity_mps: what it looks at, instead of a surface
  double velocity_mps = 0;
  std::optional<double> signal_per_pulse;
};

// An array of detectors, each of which looks in a direction of its own, and the surfaces that they
// look at. JSON: `source`/`array`. The pixel in column c and row r, from the left and from the top,
// has the input photon_input + r * columns + c.
struct ArrayOptions {
  std::int64_t columns = 0;  // 0: no array
  std::int64_t rows = 1;
  double pitch_deg = 0.1;  // between neighbours
  std::vector<ArrayInput> inputs;
  std::vector<Plane> planes;
  PictureOptions picture;
  RoomOptions room;
  double crosstalk_probability = 0;  // that a detection makes a detection in a neighbour
  double crosstalk_ns = 1;           // mean time from the one to the other

  [[nodiscard]] bool used() const { return columns > 0; }
  void describe(OptionVisitor& visitor);
  // first_input: of the scene's photons.
  [[nodiscard]] std::optional<OptionFault> validate(std::int64_t first_input) const;
};

}  // namespace splid::simulator
