#include "estimator/likelihood/information.hpp"

#include <algorithm>

namespace splid::likelihood {
namespace {

constexpr double no_background = 1e-6;  // photons in the frame

}  // namespace

FreeSet known_free(const FreeSet& free, const Model& at, const Exposure& exposure) {
  FreeSet known = free;
  if (at.background_per_ns * exposure.seen_ns < no_background) {
    known.reset(background_place(at.count));
  }
  return known;
}

SmallVector units_of(const Model& at, const Exposure& exposure, double width_ns) {
  SmallVector units(static_cast<Eigen::Index>(parameters_of(at.count)));
  for (std::size_t k = 0; k < at.count; ++k) {
    const double S = at.targets[k].signal_per_pulse;
    units.segment<of_target>(static_cast<Eigen::Index>(of_target * k)) << width_ns, width_ns,
        width_ns, S > 0 ? S : 1 / exposure.amplitude;
  }
  units.tail<2>() << 1, std::max(at.background_per_ns, 1 / exposure.seen_ns);
  return units;
}

SmallMatrix information_of(const SmallMatrix& hessian, const SmallVector& units,
                           const FreeSet& free) {
  SmallMatrix J = -(units.asDiagonal() * hessian * units.asDiagonal());
  for (Eigen::Index i = 0; i < J.rows(); ++i) {
    if (free[static_cast<std::size_t>(i)]) continue;
    J.row(i).setZero();
    J.col(i).setZero();
    J(i, i) = 1;
  }
  return J;
}

std::optional<SmallMatrix> covariance_of(const SmallMatrix& hessian, const Model& at,
                                         const Exposure& exposure, double width_ns,
                                         const FreeSet& free) {
  const FreeSet known = known_free(free, at, exposure);
  const SmallVector units = units_of(at, exposure, width_ns);
  std::optional<SmallMatrix> C = inverse_of_positive(information_of(hessian, units, known));
  if (!C) return std::nullopt;
  *C = units.asDiagonal() * *C * units.asDiagonal();
  for (Eigen::Index i = 0; i < C->rows(); ++i) {
    if (!known[static_cast<std::size_t>(i)]) C->row(i).setZero(), C->col(i).setZero();
  }
  if (!C->allFinite()) return std::nullopt;
  return C;
}

}  // namespace splid::likelihood
