#include "estimator/fold/kernel_choice.hpp"

namespace splid {

const SearchKernels& search_kernels(VectorLevel level) {
  return SPLID_KERNELS_OF(level, search_kernels);
}

const SearchKernels& best_search_kernels() { return search_kernels(best_vector_level()); }

}  // namespace splid
