#pragma once

// Included by files compiled for several vector levels: no header here may emit inline functions.
// What a header of kernels and the function that chooses among them say of the levels that
// vector_level.hpp lists.

// Declares the kernels of each level, in namespaces of their own.
#define SPLID_DECLARE_KERNELS(Kernels, name) \
  namespace generic {                        \
  extern const Kernels name;                 \
  }                                          \
  namespace x86_64_v3 {                      \
  extern const Kernels name;                 \
  }                                          \
  namespace x86_64_v4 {                      \
  extern const Kernels name;                 \
  }                                          \
  namespace neon {                           \
  extern const Kernels name;                 \
  }

// The kernels of a level that this build holds.
#if defined(SPLID_X86_64_LEVELS)
#define SPLID_KERNELS_OF(level, name)                    \
  ((level) == VectorLevel::x86_64_v4   ? x86_64_v4::name \
   : (level) == VectorLevel::x86_64_v3 ? x86_64_v3::name \
                                       : generic::name)
#elif defined(SPLID_ARM64_LEVELS)
#define SPLID_KERNELS_OF(level, name) ((level) == VectorLevel::neon ? neon::name : generic::name)
#else
#define SPLID_KERNELS_OF(level, name) ((void)(level), generic::name)
#endif
