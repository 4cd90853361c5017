#pragma once

#include "estimator/fold/search_kernels.hpp"
#include "estimator/model/vector_level.hpp"

namespace splid {

// The kernels of a level, which must be one that this processor runs, and those of the best level.
const SearchKernels& search_kernels(VectorLevel level);
const SearchKernels& best_search_kernels();

}  // namespace splid
