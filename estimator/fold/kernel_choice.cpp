#include "estimator/fold/kernel_choice.hpp"

namespace splid {

const SearchKernels& search_kernels(VectorLevel level) {
#ifdef SPLID_X86_64_LEVELS
  if (level == VectorLevel::x86_64_v4) return x86_64_v4::search_kernels;
  if (level == VectorLevel::x86_64_v3) return x86_64_v3::search_kernels;
#elif defined(SPLID_ARM64_LEVELS)
  if (level == VectorLevel::neon) return neon::search_kernels;
#else
  (void)level;
#endif
  return generic::search_kernels;
}

const SearchKernels& best_search_kernels() { return search_kernels(best_vector_level()); }

}  // namespace splid
