#pragma once

#include <string>

namespace splid::test {

// Where any target will do, the built program measures a dim target that is slow. A frame then
// costs a third of the processor time that a frame of [P]'s scene costs, so that a program built
// with the thread sanitizer keeps up with its source.
inline constexpr const char* light_source =
    R"("driver":"simulator","signal_per_pulse":0.005,"ambient_per_s":2000)";

// `more`, which are further blocks of a configuration, with a block that searches slow targets
// alone where `more` has no such block.
inline std::string with_light_scene(const std::string& more) {
  if (more.find("\"scene\"") != std::string::npos) return more;
  return R"(,"scene":{"max_speed_mps":20})" + more;
}

}  // namespace splid::test
