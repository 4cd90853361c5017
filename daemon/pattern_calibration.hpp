#pragma once

#include <stop_token>
#include <string>

#include "config/config.hpp"
#include "drivers/source.hpp"
#include "protocol/pattern.hpp"

namespace splid {

// The pattern that a recording of a static target shows: the period from the syncs, the pulses from
// the photons folded on it. Its times hold the target's own delay, so distances measured with it
// are relative to that target.
//
// The configured pattern gives the nominal period; mode and range are kept where the recording has
// as many pulses, otherwise the pattern is baseline (one pulse) or random (several).
//
// Threads: the caller's. Errors: the source's; Error(Fault::data) where the syncs do not fit the
// nominal period or no pulse stands out, saying what was seen.
Pattern calibrate_pattern(const Config& config, TagSource& source, const std::string& recording,
                          const std::stop_token& stop);

}  // namespace splid
