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
