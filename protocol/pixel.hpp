#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "protocol/options.hpp"

namespace splid {

// A pixel: a direction that photons are counted from, which is an input of the tagger. JSON: an
// element of `pixels`.
struct PixelOptions {
  std::string name;                                  // unique; in JSON the input's number if absent
  std::int64_t input = 1;                            // as the instrument numbers it
  std::optional<double> azimuth_deg, elevation_deg;  // of the direction; absent: not known
  double delay_ps = 0;                               // by how much later its tags come
  std::optional<double> dead_time_ns;                // absent: detector.dead_time_ns
  std::optional<double> sigma_ps;                    // of its pulse; absent: pulse.sigma_ps
  void describe(OptionVisitor& visitor);
  friend bool operator==(const PixelOptions&, const PixelOptions&) = default;
};

// The most pixels that there may be, and the inputs that they may have.
inline constexpr std::size_t most_pixels = 1024;
inline constexpr std::int64_t least_pixel_input = -128;
inline constexpr std::int64_t most_pixel_input = 1024;

// What is wrong with the pixels taken together: their number, their names, and inputs that two of
// them have. Pointers are relative to `pixels`.
std::optional<OptionFault> pixels_fault(std::span<const PixelOptions> pixels);

}  // namespace splid
