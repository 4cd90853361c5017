#pragma once

#include <string>

#include "protocol/pattern_json.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid::test {

// The pattern beside each configuration that is tried. It has a measured pulse, so that
// pulse.shape may be either.
inline std::string fuzz_pattern_json() {
  Pattern pattern = interleaved_pattern({180'000, 189'000}, 3'780'000);
  pattern.pulse = TabulatedPulse{-200, 100, {0.0, 0.003, 0.004, 0.002, 0.001, 0.0}};
  return to_json(pattern);
}

}  // namespace splid::test
