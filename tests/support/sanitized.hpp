#pragma once

#include <cstdlib>

// Defined where the address or thread sanitizer keeps memory of its own, and what was freed, so
// that a process's memory says nothing of the program's.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)  // gcc
#define SPLID_SANITIZED
#elif defined(__has_feature)  // clang
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define SPLID_SANITIZED
#endif
#endif

namespace splid::test {

// How often a test does the same again: for each change a fifth of what it does before a release
// (scripts/test --long). A new fault of the way that is repeated shows in the fifth too; the rest
// is for what comes by once in a hundred times.
inline int times(int whole) {
  static const bool is_long = std::getenv("SPLID_LONG_TESTS") != nullptr;
  return is_long ? whole : whole < 10 ? 1 : whole / 5;
}

}  // namespace splid::test
