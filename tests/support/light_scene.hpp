#pragma once

#include <string>

namespace splid::test {

// Where any target will do, the built program measures a dim target that is slow. A frame then
// costs a third of the processor time that a frame of [P]'s scene costs, so that a program built
// with the thread sanitizer keeps up with its source.
inline constexpr const char* light_source =
    R"("driver":"simulator","signal_per_pulse":0.005,"ambient_per_s":2000)";

// A ring of 4 to 6 s of a scene instead of 15. Under the thread sanitizer a program starts in 0.8 s
// with the default ring, since all of it is written and watched, and in 0.3 s with this one.
inline constexpr const char* small_ring = R"(,"pipeline":{"ring_capacity_tags":1048576})";

// `more`, which are further blocks of a configuration, with a block that searches slow targets
// alone where `more` has no such block.
inline std::string with_light_scene(const std::string& more) {
  if (more.find("\"scene\"") != std::string::npos) return more;
  return R"(,"scene":{"max_speed_mps":20})" + more;
}

}  // namespace splid::test
