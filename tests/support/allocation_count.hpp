#pragma once

#include <atomic>
#include <cstdint>

// Counts every operator new of a test binary that is linked with allocation_count.cpp.
namespace splid::test {
extern std::atomic<std::uint64_t> allocations;
extern std::atomic<std::uint64_t> allocated_bytes;  // of these, given back or not
// Says whether the calling thread's allocations count; null: those of all threads do.
extern std::atomic<bool (*)()> counted_thread;
}  // namespace splid::test
