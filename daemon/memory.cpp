#include "daemon/memory.hpp"

#include <malloc.h>

namespace splid {
namespace {

constexpr int large_bytes = 128 * 1024;

}  // namespace

void return_large_blocks() { (void)mallopt(M_MMAP_THRESHOLD, large_bytes); }

}  // namespace splid
