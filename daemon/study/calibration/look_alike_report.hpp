#pragma once

#include <memory>
#include <optional>
#include <string>

#include "config/config.hpp"
#include "estimator/calibration/look_alike.hpp"
#include "estimator/model/pulse_shape.hpp"

namespace splid {

// What is hard to tell in a pattern, for people. Threads: any. Errors: none.

// The pulse that a pattern is measured with: its own where it has one and that is asked for.
std::unique_ptr<PulseShape> shape_of(const Pattern& pattern, const PulseOptions& pulse);

// The delay hardest to tell from the right one; absent where the pattern has none or says itself
// that it cannot tell.
std::optional<LookAlike> hardest_delay(const Pattern& pattern, const PulseShape& shape,
                                       const PatternLight& light = {});

// That of a calibrated pattern: background and signal as its calibration had them.
PatternLight light_of(const Pattern& pattern, double background_photons);

// "hardest to tell from the right delay: 180 ns (26.98 m) away, 17 signal photons a frame tell it";
// empty where there is none. Of a calibrated pattern also whether a frame of length_ms has as many.
std::string describe_look_alike(const Pattern& pattern, const PulseShape& shape, double length_ms);

}  // namespace splid
