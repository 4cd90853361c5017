#pragma once

#include <vector>

#include "drivers/simulator/simulator_options.hpp"
#include "drivers/simulator/surface.hpp"

namespace splid::simulator {

// One pixel of an array: a scene of its own, with the pixel's target, light and input in the place
// of the whole scene's.
struct ArrayPixel {
  Direction direction;
  double delay_ps = 0;  // of its cable; not in the scene
  Options scene;
};

// The pixels of options.array, row by row from the top. A pixel that looks at no surface has a
// signal of 0.
//
// Errors: as PictureSurface.
std::vector<ArrayPixel> array_pixels(const Options& options);

}  // namespace splid::simulator
