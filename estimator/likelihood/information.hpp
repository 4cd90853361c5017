#pragma once

#include <optional>

#include "estimator/likelihood/exposure.hpp"
#include "estimator/likelihood/model.hpp"
#include "estimator/likelihood/small_matrix.hpp"

namespace splid::likelihood {

// The scale of each parameter: in such units the information about them is well conditioned. Where
// no photon speaks for a background, the likelihood falls as exp(-b t), so that the unit of b is
// then 1 / t. width_ns: of the pulse.
SmallVector units_of(const Model& at, const Exposure& exposure, double width_ns);

// The free parameters that the photons tell anything of: a background of less than a millionth of a
// photon in the frame counts as held.
FreeSet known_free(const FreeSet& free, const Model& at, const Exposure& exposure);

// Minus the Hessian in these units, with a 1 in the place of each held parameter.
SmallMatrix information_of(const SmallMatrix& hessian, const SmallVector& units,
                           const FreeSet& free);

// The covariance of the free parameters, in their places and in the parameters' own units: the
// inverse of the information at a maximum. Rows of held parameters are 0. Absent where the
// likelihood does not fall off in all directions. See known_free().
std::optional<SmallMatrix> covariance_of(const SmallMatrix& hessian, const Model& at,
                                         const Exposure& exposure, double width_ns,
                                         const FreeSet& free);

}  // namespace splid::likelihood
