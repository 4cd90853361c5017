#include "estimator/frame_values.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/model/units.hpp"

namespace splid {
namespace {

// A delay on a circle: in [0, circle_ns).
double within_circle(double delay_ns, double circle_ns) {
  const double turned = delay_ns - circle_ns * std::floor(delay_ns / circle_ns);
  return turned < circle_ns ? turned : 0.0;
}

// g: how far the delay travels in a ns. delay_ns: D of the photons' line, at mid-frame and in the
// pattern's clock; the delay itself is tau = D (1 + beta).
void fill_deviations(Estimate& estimate, const Fit& fit, const FrameUnits& units,
                     const SyncFit& sync, double g, double delay_ns) {
  // d beta / d travel = 2 / ((2 - g)^2 t_a).
  const double per_travel = 2 / ((2 - g) * (2 - g) * units.length_ns);
  const auto& C = fit.covariance;
  const double a = 1 + g / (2 - g);
  const double c = delay_ns * per_travel;
  const double variance = a * a * C(0, 0) + 2 * a * c * C(0, 1) + c * c * C(1, 1);
  // What the syncs leave uncertain of the pattern's clock adds to both deviations: an error of the
  // clock's phase is an error of the delay, and an error of its period is an error of the velocity
  // (with 10 ps of sync jitter in 50 ms 4.2 cm/s by endpoints, 0.09 cm/s by regression).
  estimate.std_delay_ns =
      std::hypot(std::sqrt(std::max(0.0, variance)) * units.scale, sync.std_phase_ps * ns_per_ps);
  if (C(1, 1) > 0) {
    estimate.std_velocity_mps =
        speed_of_light_mps *
        std::hypot(std::sqrt(C(1, 1)) * per_travel, sync.std_period_ps / sync.period_ps / 2);
  }
  estimate.std_signal_per_pulse = std::sqrt(C(2, 2));
  estimate.std_background_per_ns = std::sqrt(C(3, 3));
}

}  // namespace

void fill_values(Estimate& estimate, const Fit& fit, const FrameUnits& units, const SyncFit& sync,
                 double bend_ns) {
  const FrameParameters& p = fit.parameters;
  const double g = p.line.travel_ns / units.length_ns;
  const double beta = g / (2 - g);
  // Where delays repeat, the search may end at any copy of the delay, so the delay is folded before
  // it is turned into tau: a copy k circles on would otherwise come out k beta circles further.
  const double delay_ns = within_circle(p.line.delay_ns, units.circle_ns);
  estimate.has_values = true;
  estimate.velocity_mps = beta * speed_of_light_mps;
  // tau = D (1 + beta) in the pattern's clock; times `scale` it is in the clock that is right.
  estimate.delay_ns = within_circle(delay_ns * (1 + beta), units.circle_ns) * units.scale;
  estimate.delay_start_ns =
      within_circle(delay_ns * (1 + beta) - beta * units.length_ns + bend_ns / 4, units.circle_ns) *
      units.scale;
  estimate.signal_per_pulse = p.signal_per_pulse;
  estimate.background_per_ns = p.background_per_ns;
  estimate.significance_nats = fit.gain_nats;
  estimate.stop = fit.stop;
  if (fit.has_covariance) fill_deviations(estimate, fit, units, sync, g, delay_ns);
}

}  // namespace splid
