#pragma once

#include <memory>
#include <string>

#include "config/config.hpp"
#include "estimator/model/pulse_shape.hpp"

namespace splid::calibration {

// Which delays of a pattern are hard to tell apart, for people. Threads: any. Errors: none.

// The pulse shape that a pattern is measured with: the pattern's own, if it has a shape and `pulse`
// asks for that; otherwise the shape in `pulse`.
std::unique_ptr<PulseShape> shape_of(const Pattern& pattern, const PulseOptions& pulse);

// "hardest to tell from the right delay: 180 ns (26.98 m) away, 17 signal photons a frame tell them
// apart"; empty where hardest_delay() is absent, and in mode ambiguous. For a calibrated pattern it
// also says whether a frame of length_ms has that many photons.
std::string describe_side_lobe(const Pattern& pattern, const PulseShape& shape, double length_ms);

}  // namespace splid::calibration
