#pragma once

#include <memory>

#include "estimator/model/options.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "protocol/pattern.hpp"

namespace splid {

// The detected pulse that the configuration asks for.
// Errors: Error(Fault::usage) where it asks for the table of a pattern that has none.
std::unique_ptr<PulseShape> configured_pulse(const Pattern& pattern, const PulseOptions& options);

}  // namespace splid
