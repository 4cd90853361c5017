#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace splid::array {

// Where a pixel looks, degrees.
struct PixelDirection {
  double azimuth_deg = 0;
  double elevation_deg = 0;
};

// Which pixels look beside each other. The pitch of the field is the median distance from a pixel
// to the nearest other one; directions need not be on a grid.
class Neighbours {
 public:
  // rings: how many pitches away the farthest neighbours are, in azimuth and in elevation.
  Neighbours(std::span<const PixelDirection> directions, std::size_t rings);

  // The pixels up to so many rings around a pixel, the nearest first, the pixel itself before all
  // of them. ring: 0 to rings.
  [[nodiscard]] std::span<const std::size_t> around(std::size_t pixel, std::size_t ring) const;

 private:
  struct Around {
    std::vector<std::size_t> near;
    std::vector<std::size_t> ends;  // of each ring
  };
  std::vector<Around> around_;  // each pixel
};

}  // namespace splid::array
