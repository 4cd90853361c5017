#include "estimator/fit/path_check.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "estimator/model/units.hpp"

namespace splid {
namespace {

constexpr double reach_widths = 4;
constexpr double nearest_reach_widths = 2.5;
constexpr double fewest_photons = 40;
// Squared deviations of the bend. Chance reaches the first in one frame of a million.
constexpr double surely_bent = 24;
constexpr double may_be_straight = 4;
// With fewer photons a part of the frame may be empty by chance.
constexpr double fewest_for_straight = 100;
// Of chi squared with 7 degrees of freedom: one even frame of a thousand is taken as uneven.
constexpr double most_uneven = 24.3;

}  // namespace

bool PathVerdict::bends() const { return deviations * deviations >= surely_bent; }

bool PathVerdict::is_straight() const {
  return photons >= fewest_for_straight && is_even && deviations * deviations < may_be_straight;
}

void PathVerdict::widen(Estimate& estimate, double scale, double length_ns) const {
  estimate.acceleration_misfit_mps2 = acceleration_of_bend(bend_ns, length_ns);
  estimate.std_delay_ns = std::hypot(estimate.std_delay_ns, bend_ns * scale / 12);
}

PathCheck::PathCheck(const PulseShape& shape, double closest_ns) : shape_(shape) {
  const double reach_ns = std::min(reach_widths * shape.width_ns(), 0.499 * closest_ns);
  if (reach_ns < nearest_reach_widths * shape.width_ns()) return;
  first_ns_ = shape.peak_offset_ns() - reach_ns;
  steps_per_ns_ = static_cast<double>(steps) / (2 * reach_ns);
}

void PathCheck::begin(double signal_per_pulse, double background_per_ns) {
  score_.setZero();
  information_.setZero();
  signal_.fill(0);
  spread_ = 0;
  if (steps_per_ns_ == 0) return;
  std::array<double, steps> offset{}, h{}, d1{}, d2{};
  for (std::size_t i = 0; i < steps; ++i) {
    offset[i] = first_ns_ + (static_cast<double>(i) + 0.5) / steps_per_ns_;
  }
  shape_.evaluate(offset, {h, d1, d2});
  for (std::size_t i = 0; i < steps; ++i) {
    const double lambda = background_per_ns + signal_per_pulse * h[i];
    slope_[i] = lambda > 0 ? -signal_per_pulse * d1[i] / lambda : 0;
    chance_[i] = lambda > 0 ? signal_per_pulse * h[i] / lambda : 0;
  }
}

PathVerdict PathCheck::judge() const {
  PathVerdict verdict;
  for (const double photons : signal_) verdict.photons += photons;
  if (verdict.photons < fewest_photons) return verdict;
  const Eigen::LDLT<Eigen::Matrix2d> others(information_.topLeftCorner<2, 2>());
  const Eigen::Vector2d cross = information_.col(2).head<2>();
  const double score = score_[2] - cross.dot(others.solve(score_.head<2>()));
  const double information = information_(2, 2) - cross.dot(others.solve(cross));
  if (!(information > 0) || !std::isfinite(score)) return verdict;
  verdict.bend_ns = score / information;
  verdict.deviations = score / std::sqrt(information);
  const double mean = verdict.photons / parts;
  double squares = 0;
  for (const double photons : signal_) squares += (photons - mean) * (photons - mean);
  verdict.is_even = squares < most_uneven * spread_ / parts;
  return verdict;
}

}  // namespace splid
