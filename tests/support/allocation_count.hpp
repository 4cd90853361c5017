#pragma once

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <new>

// Counts every operator new of the program. The operators are weak, so that several files of a test
// binary may include this.
namespace splid::test {
inline std::atomic<std::uint64_t> allocations{0};
// Says whether the calling thread's allocations count; null: those of all threads do.
inline std::atomic<bool (*)()> counted_thread{nullptr};

inline void count_allocation() {
  bool (*const counts)() = counted_thread;
  if (counts == nullptr || counts()) ++allocations;
}
}  // namespace splid::test

// GCC pairs the replaced operators by name and sees free() where it expects operator delete.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
[[gnu::weak]] void* operator new(std::size_t size) {
  splid::test::count_allocation();
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
[[gnu::weak]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  splid::test::count_allocation();
  return std::malloc(size == 0 ? 1 : size);
}
[[gnu::weak]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::weak]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
#pragma GCC diagnostic pop
