#include "protocol/vector_level.hpp"

namespace splid {

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
#endif
  return levels;
}

VectorLevel best_vector_level() {
  static const VectorLevel level = runnable_vector_levels().back();
  return level;
}

}  // namespace splid
