#include "estimator/fit/width_fit.hpp"

#include <cmath>

#include "estimator/model/units.hpp"

namespace splid {
namespace {

constexpr double most_uncertain = 0.5;

}  // namespace

WidthFit::WidthFit(double sigma_ns, const PulseTrain& train, std::size_t max_photons)
    : shape_(sigma_ns), maximizer_(shape_, train, max_photons, {1, most_ratio, false}) {}

std::optional<FittedWidth> WidthFit::climb(const FoldedFrame& frame, const Fit& start,
                                           bool moving) {
  maximizer_.begin(frame);
  const likelihood::Maximum maximum = maximizer_.maximize(
      model_of(start.parameters), {likelihood::free_set(1, moving ? 2 : 1, true)});
  const double log_width = maximum.model.log_width;
  if (!maximum.has_covariance || std::abs(log_width) > std::log(most_ratio) - 1e-3) {
    return std::nullopt;
  }
  constexpr auto w = static_cast<Eigen::Index>(likelihood::width_place(1));
  const double uncertain = std::sqrt(maximum.covariance(w, w));
  if (!(uncertain < most_uncertain)) return std::nullopt;
  const double sigma_ns = shape_.width_ns() * std::exp(log_width);
  return FittedWidth{fit_of(maximum), sigma_ns, uncertain * sigma_ns};
}

std::unique_ptr<WidthFit> make_width_fit(const PulseOptions& pulse, const PulseTrain& train,
                                         std::size_t max_photons) {
  if (pulse.width == PulseWidth::fixed) return nullptr;
  return std::make_unique<WidthFit>(pulse.sigma_ps * ns_per_ps, train, max_photons);
}

}  // namespace splid
