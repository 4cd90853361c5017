#include "estimator/search/fit.hpp"

#include <array>

namespace splid {

likelihood::Model model_of(const FrameParameters& parameters) {
  likelihood::Model model;
  model.add({{parameters.line.delay_ns, parameters.line.walk_ns}, parameters.signal_per_pulse});
  model.background_per_ns = parameters.background_per_ns;
  return model;
}

namespace {

constexpr std::array<Eigen::Index, 4> places = {
    likelihood::delay, likelihood::walk, likelihood::signal, likelihood::background_place(1)};

}  // namespace

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
  for (std::size_t i = 0; i < places.size(); ++i) {
    for (std::size_t j = 0; j < places.size(); ++j) {
      fit.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          maximum.covariance(places[i], places[j]);
    }
  }
  return fit;
}

likelihood::Maximum maximum_of(const Fit& fit) {
  likelihood::Maximum maximum;
  maximum.model = model_of(fit.parameters);
  maximum.gain_nats = fit.gain_nats;
  maximum.stop = fit.stop;
  maximum.has_covariance = fit.has_covariance;
  constexpr auto size = static_cast<Eigen::Index>(likelihood::parameters_of(1));
  maximum.covariance = SmallMatrix::Zero(size, size);
  for (std::size_t i = 0; i < places.size(); ++i) {
    for (std::size_t j = 0; j < places.size(); ++j) {
      maximum.covariance(places[i], places[j]) =
          fit.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
  return maximum;
}

}  // namespace splid
