#pragma once

#include <chrono>

namespace splid::test {

// How long a test waits for what must come. Whoever waits for a condition loses nothing by a long
// limit: a machine at a quarter of the speed that does other work too must not turn a test red.
inline constexpr std::chrono::seconds patience{120};

}  // namespace splid::test
