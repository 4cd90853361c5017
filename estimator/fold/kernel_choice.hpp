#pragma once

#include "estimator/fold/search_kernels.hpp"
#include "estimator/model/vector_level.hpp"

namespace splid {

// The kernels of a level, which must be one that this processor runs, and those of the best level.
inline const SearchKernels& search_kernels(VectorLevel level) {
  return SPLID_KERNELS_OF(level, search_kernels);
}
inline const SearchKernels& best_search_kernels() { return search_kernels(best_vector_level()); }

// Those of a type of counts.
template <class Count>
const SearchKernels::Of<Count>& of(const SearchKernels& kernels) {
  if constexpr (sizeof(Count) == 1) {
    return kernels.bytes;
  } else if constexpr (sizeof(Count) == 2) {
    return kernels.words;
  } else {
    return kernels.longs;
  }
}

}  // namespace splid
