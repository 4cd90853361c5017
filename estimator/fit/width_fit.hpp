#pragma once

#include <memory>
#include <optional>

#include "estimator/fit/fit.hpp"
#include "estimator/likelihood/maximizer.hpp"
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

// The maximum of the likelihood near a fit with the configured width, with the width free too.
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
  std::optional<FittedWidth> climb(const FoldedFrame& frame, const Fit& start, bool moving);

 private:
  GaussianPulse shape_;
  likelihood::Maximizer maximizer_;
};

// Null where the width is not to be fitted.
std::unique_ptr<WidthFit> make_width_fit(const PulseOptions& pulse, const PulseTrain& train,
                                         std::size_t max_photons);

}  // namespace splid
