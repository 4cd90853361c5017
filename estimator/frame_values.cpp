#include "estimator/frame_values.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/model/units.hpp"
#include "estimator/sync/deviations.hpp"

namespace splid {
namespace {

using likelihood::Maximum;

// The covariance of the delay at mid-frame and the range walk. At mid-frame P_2 is -1/2.
struct MidFrame {
  double delay = 0, both = 0, walk = 0;
};

MidFrame at_mid_frame(const SmallMatrix& C, Eigen::Index d, const checks::Widening& wider) {
  const Eigen::Index w = d + likelihood::walk, q = d + likelihood::quadratic;
  MidFrame mid = {C(d, d) - C(d, q) + C(q, q) / 4, C(d, w) - C(q, w) / 2, C(w, w)};
  const auto square = [](double x) { return x * x; };
  mid.delay = std::max(mid.delay, square(wider.least_delay_ns)) + square(wider.off_delay_ns);
  if (mid.walk > 0) {
    mid.walk = std::max(mid.walk, square(wider.least_walk_ns)) + square(wider.off_walk_ns);
  }
  return mid;
}

// g: how far the delay walks in a ns. delay_ns: D of the photons' line, at mid-frame and in the
// pattern's clock; the delay itself is tau = D (1 + beta).
void fill_deviations(Estimate& estimate, const Maximum& at, std::size_t target,
                     const checks::Widening& wider, const FrameUnits& units, const SyncFit& sync,
                     double g, double delay_ns) {
  // d beta / d walk = 2 / ((2 - g)^2 t_a).
  const double per_walk = 2 / ((2 - g) * (2 - g) * units.length_ns);
  const auto& C = at.covariance;
  const auto d = static_cast<Eigen::Index>(likelihood::of_target * target);
  const MidFrame mid = at_mid_frame(C, d, wider);
  const double a = 1 + g / (2 - g);
  const double c = delay_ns * per_walk;
  const double variance = a * a * mid.delay + 2 * a * c * mid.both + c * c * mid.walk;
  // What the syncs leave uncertain of the pattern's clock adds to both deviations: an error of the
  // clock's phase is an error of the delay, and an error of its period is an error of the velocity
  // (with 10 ps of sync jitter in 50 ms 4.2 cm/s by endpoints, 0.09 cm/s by regression).
  estimate.std_delay_ns = in_quadrature(std::sqrt(std::max(0.0, variance)) * units.scale,
                                        sync.std_phase_ps * ns_per_ps);
  estimate.std_velocity_mps =
      mid.walk > 0 ? speed_of_light_mps * in_quadrature(std::sqrt(mid.walk) * per_walk,
                                                        sync.std_period_ps / sync.period_ps / 2)
                   : 0;
  const Eigen::Index q = d + likelihood::quadratic;
  estimate.std_acceleration_mps2 = std::sqrt(C(q, q)) * acceleration_of(1, units.length_ns);
  const Eigen::Index s = d + likelihood::signal;
  estimate.std_signal_per_pulse =
      in_quadrature(std::sqrt(C(s, s)), wider.off_signal * estimate.signal_per_pulse);
  const auto b = static_cast<Eigen::Index>(likelihood::background_place(at.model.count));
  estimate.std_background_per_ns =
      in_quadrature(std::sqrt(C(b, b)), wider.off_background * estimate.background_per_ns);
}

}  // namespace

void fill_values(Estimate& estimate, const Maximum& at, std::size_t target,
                 const checks::Widening& wider, const FrameUnits& units, const SyncFit& sync) {
  const likelihood::Target& own = at.model.targets.at(target);
  const double g = own.track.walk_ns / units.length_ns;
  const double beta = g / (2 - g);
  // Where delays repeat, the search may end at any copy of the delay, so the delay is folded before
  // it is turned into tau: a copy k circles on would otherwise come out k beta circles further.
  const double delay_ns = fold_on(own.track.at_mid_frame_ns(), units.circle_ns);
  const double start_ns = own.track.at(-0.5) - own.track.at_mid_frame_ns();  // from mid-frame
  estimate.has_values = true;
  estimate.acceleration_mps2 = acceleration_of(own.track.quadratic_ns, units.length_ns);
  // tau = D (1 + beta) in the pattern's clock; times `scale` it is in the clock that is right.
  estimate.delay_ns = fold_on(delay_ns * (1 + beta), units.circle_ns) * units.scale;
  // Light that comes back at mid-frame met the target half a delay before.
  estimate.velocity_mps =
      beta * speed_of_light_mps + estimate.acceleration_mps2 * estimate.delay_ns * 1e-9 / 2;
  const double curved_ns = start_ns + own.track.walk_ns / 2;
  estimate.delay_start_ns =
      fold_on(delay_ns * (1 + beta) - beta * units.length_ns + curved_ns, units.circle_ns) *
      units.scale;
  estimate.signal_per_pulse = own.signal_per_pulse;
  estimate.background_per_ns = at.model.background_per_ns;
  estimate.stop = at.stop;
  if (at.has_covariance) {
    fill_deviations(estimate, at, target, wider, units, sync, g, delay_ns);
  }
}

void fill_width(Estimate& estimate, const Maximum& at, double width_ns) {
  if (at.model.log_width == 0) return;
  const auto w = static_cast<Eigen::Index>(likelihood::width_place(at.model.count));
  estimate.pulse_sigma_ns = width_ns * std::exp(at.model.log_width);
  estimate.std_pulse_sigma_ns = std::sqrt(at.covariance(w, w)) * estimate.pulse_sigma_ns;
}

}  // namespace splid
