#include "estimator/likelihood/kernel_choice.hpp"

namespace splid::likelihood {

const LikelihoodKernels& likelihood_kernels(VectorLevel level) {
#ifdef SPLID_X86_64_LEVELS
  if (level == VectorLevel::x86_64_v4) return x86_64_v4::likelihood_kernels;
  if (level == VectorLevel::x86_64_v3) return x86_64_v3::likelihood_kernels;
#elif defined(SPLID_ARM64_LEVELS)
  if (level == VectorLevel::neon) return neon::likelihood_kernels;
#else
  (void)level;
#endif
  return generic::likelihood_kernels;
}

}  // namespace splid::likelihood
