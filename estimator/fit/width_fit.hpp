#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "estimator/fit/refinement.hpp"
#include "estimator/fit/width_likelihood.hpp"
#include "estimator/model/options.hpp"

namespace splid {

// A maximum of the likelihood with the pulse's width as one more parameter.
struct FittedWidth {
  Fit fit;              // its covariance is that with the width unknown
  double sigma_ns = 0;  // of the detected pulse
  double std_sigma_ns = 0;

  void say_width(Estimate& estimate) const {
    estimate.pulse_sigma_ns = sigma_ns;
    estimate.std_pulse_sigma_ns = std_sigma_ns;
  }
};

// Climbs from a fit with the configured width to the maximum of the likelihood in delay, travel and
// width, with the best signal and background at every step.
//
// Threads: one thread for each object. Errors: none. No allocation in climb() for frames of up to
// max_photons, which must not have their blind time.
class WidthFit {
 public:
  // Widths are fitted from 1/4 of the configured width to 4 times it.
  static constexpr double most_ratio = 4;

  // sigma_ns: as configured.
  WidthFit(double sigma_ns, const PulseTrain& train, std::size_t max_photons);

  // The maximum near a fit. moving: false keeps the travel of `start`. Empty where the photons are
  // too few to tell the width: where the climb ends at one of its limits, or leaves the width
  // uncertain by more than half of it.
  std::optional<FittedWidth> climb(const FoldedFrame& frame, const Exposure& exposure,
                                   const Fit& start, bool moving);

 private:
  struct State {
    Likelihood::Profile best;
    double log_ratio = 0;  // of the width to the configured one
  };
  State at(const Exposure& exposure, DelayLine line, double log_ratio, double about_fraction);
  Stop climb_within(const Exposure& exposure, bool moving, DelayLine collected_at, State& state);
  std::optional<FittedWidth> with_covariance(const Exposure& exposure, bool moving,
                                             const State& state, Stop stop);

  const PulseTrain& train_;
  double sigma_ns_;
  double margin_ns_;  // how far the line may move before the near set is collected anew
  std::vector<CombWindow> windows_;
  NearSet near_;
  WidthLikelihood likelihood_;
};

// Null where the width is not to be fitted.
std::unique_ptr<WidthFit> make_width_fit(const PulseOptions& pulse, const PulseTrain& train,
                                         std::size_t max_photons);

}  // namespace splid
