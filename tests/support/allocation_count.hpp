#pragma once

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <new>

// Counts every operator new of the program. Include in exactly one file of a test binary.
namespace splid::test {
inline std::atomic<std::uint64_t> allocations{0};
}  // namespace splid::test

// GCC pairs the replaced operators by name and sees free() where it expects operator delete.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
void* operator new(std::size_t size) {
  ++splid::test::allocations;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
#pragma GCC diagnostic pop
