#include "estimator/model/vector_level.hpp"

#include <array>
#include <atomic>

namespace splid {

namespace {

std::atomic<VectorLevel>& used_level() {
  static std::atomic<VectorLevel> level = runnable_vector_levels().back();
  return level;
}

}  // namespace

const char* vector_level_name(VectorLevel level) {
  constexpr std::array names = {"generic", "x86_64_v3", "x86_64_v4", "neon"};
  return names.at(static_cast<std::size_t>(level));
}

std::vector<VectorLevel> runnable_vector_levels() {
  std::vector<VectorLevel> levels = {VectorLevel::generic};
#ifdef SPLID_X86_64_LEVELS
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
      __builtin_cpu_supports("bmi2")) {
    levels.push_back(VectorLevel::x86_64_v3);
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
        __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl")) {
      levels.push_back(VectorLevel::x86_64_v4);
    }
  }
#elif defined(SPLID_ARM64_LEVELS)
  levels.push_back(VectorLevel::neon);
#endif
  return levels;
}

VectorLevel best_vector_level() { return used_level(); }

void limit_vector_level(VectorLevel widest) {
  for (const VectorLevel level : runnable_vector_levels()) {
    if (level <= widest) used_level() = level;
  }
}

const PulseKernels& pulse_kernels(VectorLevel level) {
  return SPLID_KERNELS_OF(level, pulse_kernels);
}

}  // namespace splid
