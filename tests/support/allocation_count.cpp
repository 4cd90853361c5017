#include "tests/support/allocation_count.hpp"

#include <cstdlib>
#include <new>

namespace splid::test {

std::atomic<std::uint64_t> allocations{0};
std::atomic<std::uint64_t> allocated_bytes{0};
std::atomic<bool (*)()> counted_thread{nullptr};

namespace {

void count_allocation(std::size_t size) {
  bool (*const counts)() = counted_thread;
  if (counts != nullptr && !counts()) return;
  ++allocations;
  allocated_bytes += size;
}

}  // namespace
}  // namespace splid::test

// Not weak: a sanitizer's own are, and which of two weak ones is taken is the linker's choice.
// GCC pairs the replaced operators by name and sees free() where it expects operator delete.
#ifndef __clang__
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
#endif
void* operator new(std::size_t size) {
  splid::test::count_allocation(size);
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  splid::test::count_allocation(size);
  return std::malloc(size == 0 ? 1 : size);
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
