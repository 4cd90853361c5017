#pragma once

#include "estimator/likelihood/likelihood_kernels.hpp"
#include "estimator/model/vector_level.hpp"

namespace splid::likelihood {

// The kernels of a level, which must be one that this processor runs.
const LikelihoodKernels& likelihood_kernels(VectorLevel level);

}  // namespace splid::likelihood
