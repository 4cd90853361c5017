#pragma once

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

// How often a test does the same again where a fifth finds as much. The release build does it the
// whole number of times; a sanitizer's takes ten times as long for each, and what it looks for is
// on the way and not in the number.
constexpr int times(int whole) {
#ifdef SPLID_SANITIZED
  return whole < 10 ? 1 : whole / 5;
#else
  return whole;
#endif
}

}  // namespace splid::test
