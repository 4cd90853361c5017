#include "estimator/fit/fit.hpp"

#include <array>

namespace splid {

likelihood::Model model_of(const FrameParameters& parameters) {
  likelihood::Model model;
  model.add({{parameters.line.delay_ns, parameters.line.travel_ns}, parameters.signal_per_pulse});
  model.background_per_ns = parameters.background_per_ns;
  return model;
}

Fit fit_of(const likelihood::Maximum& maximum) {
  const likelihood::Target& target = maximum.model.targets[0];
  Fit fit;
  fit.parameters = {{target.track.delay_ns, target.track.walk_ns},
                    target.signal_per_pulse,
                    maximum.model.background_per_ns};
  fit.gain_nats = maximum.gain_nats;
  fit.stop = maximum.stop;
  fit.has_covariance = maximum.has_covariance;
  if (!fit.has_covariance) return fit;
  constexpr std::array<std::size_t, 4> places = {
      likelihood::delay, likelihood::walk, likelihood::signal, likelihood::background_place(1)};
  for (Eigen::Index i = 0; i < fit.covariance.rows(); ++i) {
    for (Eigen::Index j = 0; j < fit.covariance.cols(); ++j) {
      fit.covariance(i, j) =
          maximum.covariance(static_cast<Eigen::Index>(places[static_cast<std::size_t>(i)]),
                             static_cast<Eigen::Index>(places[static_cast<std::size_t>(j)]));
    }
  }
  return fit;
}

}  // namespace splid
