#pragma once

#include <vector>

#include "estimator/model/pulse_kernels.hpp"

namespace splid {

// The vector widths that the loops in *_kernels.cpp are compiled for. All levels of a kernel give
// the same bits; wider vectors are faster.
enum class VectorLevel {
  generic,    // any processor of the architecture; on arm64 one number at a time
  x86_64_v3,  // AVX2
  x86_64_v4,  // AVX-512
  neon,       // what every arm64 processor has
};

// "generic", "x86_64_v3", ...
const char* vector_level_name(VectorLevel level);

// The widest level that this processor runs and this build holds, within the limit.
VectorLevel best_vector_level();

// From now on no wider level than this is used, in the whole process: to compare one level with
// another. Before any FrameEstimator is made that is to have it. Threads: while no other one
// estimates.
void limit_vector_level(VectorLevel widest);

// All levels that this processor runs, generic first.
std::vector<VectorLevel> runnable_vector_levels();

// The pulse's kernels of a level, which must be one that this processor runs.
const PulseKernels& pulse_kernels(VectorLevel level);

}  // namespace splid
