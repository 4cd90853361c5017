#pragma once

#include <limits>

#include "estimator/likelihood/log_likelihood.hpp"
#include "estimator/model/estimate.hpp"

namespace splid::likelihood {

// A maximum of the likelihood, and the observed information there.
struct Maximum {
  Model model;
  double gain_nats = 0;         // log-likelihood over that of no target
  SmallMatrix covariance;       // in the places of model.hpp; rows of held parameters are 0
  bool has_covariance = false;  // false where the likelihood does not fall off in all directions
  Stop stop = Stop::not_run;

  // Of the first target.
  [[nodiscard]] const DelayTrack& track() const { return model.targets[0].track; }
  [[nodiscard]] double signal_per_pulse() const { return model.targets[0].signal_per_pulse; }
};

// Maximizes the likelihood in all free parameters at once: Newton's method with exact derivatives,
// damped as Levenberg and Marquardt do where the surface is not concave. [P] runs L-BFGS on (S, b)
// and (tau, v) in turn; the maximum is the same.
class Maximizer {
 public:
  // What is left to gain, in nats, at which a last step is taken. That step is a hundredth of a
  // deviation long, and ends some 1e-5 deviations from the maximum.
  static constexpr double exact_nats = 1e-4;
  // The same where maxima are only compared.
  static constexpr double compared_nats = 0.1;
  // The most that a step gains of which a parabola promises so much. The surface flattens on its
  // way down into the background, so that a parabola promises rather too much than too little. The
  // factor and the nats are for few photons.
  static constexpr double most_nats(double promised_nats) { return 3 * promised_nats + 10; }
  struct Aim {
    FreeSet free;
    // A maximum that cannot reach this gain is given up (Stop::beaten): its gain is then lower, and
    // it has no covariance.
    double to_beat_nats = -std::numeric_limits<double>::infinity();
    double enough_nats = exact_nats;
  };

  // Arguments: as for LogLikelihood.
  Maximizer(const PulseShape& shape, const PulseTrain& train, std::size_t max_photons,
            const Scope& scope);

  // A frame comes, which outlives the calls up to the next begin().
  void begin(const FoldedFrame& frame) { likelihood_.begin(frame); }
  // The maximum near `start`, whose tracks should be within two pulse widths of it. Signals of 0
  // begin at what the photons near the tracks show.
  Maximum maximize(const Model& start, const Aim& aim);
  // The likelihood and the information about the free parameters at a model as it is.
  Maximum judge(const Model& at, const FreeSet& free);
  // The likelihood, with the photons about the last maximum.
  LogLikelihood& likelihood() { return likelihood_; }

 private:
  [[nodiscard]] Model with_rates(const Model& start) const;
  void maximize_gathered(const Aim& aim, std::size_t gather_from, Maximum& best);
  void maximize_within(const Aim& aim, Maximum& best);
  void add_covariance(const FreeSet& free, Maximum& at) const;

  double width_ns_, most_log_width_;
  LogLikelihood likelihood_;
  Point point_, next_;
};

}  // namespace splid::likelihood
