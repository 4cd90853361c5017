#include "estimator/paper/alternation.hpp"

#include <nlopt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <new>

#include "estimator/model/units.hpp"

namespace splid::paper {
namespace {

using Pair = std::array<double, 2>;

constexpr int max_rounds = 40;
constexpr int max_evaluations = 200;
constexpr double reach_widths = 10;
// Design note: this is not the largest speed of the scene. Estimates near that limit would pile up
// at it and look better than the bound allows. This limit only keeps beta far below 1.
constexpr double most_speed_mps = 3e5;

// A value that is to be maximised over one or two coordinates. These are in units of about a
// standard deviation each, so that the first step of L-BFGS, the gradient itself, is about Newton's
// step.
struct Surface {
  std::function<double(const Pair& at, Pair& gradient)> value;
  unsigned dimensions = 2;
  Pair lower = {}, upper = {};
  // The best value seen. It is kept here since a return code of NLopt does not tell a stop at the
  // limit of rounding from a failure.
  Pair best = {};
  double most = 0;
};

double evaluate(unsigned dimensions, const double* x, double* gradient, void* data) {
  Surface& surface = *static_cast<Surface*>(data);
  Pair at = {};
  Pair slope = {};
  std::copy_n(x, dimensions, at.begin());
  const double value = surface.value(at, slope);
  if (gradient != nullptr) std::copy_n(slope.begin(), dimensions, gradient);
  if (value > surface.most) {
    surface.most = value;
    surface.best = at;
  }
  return value;
}

// Maximises from surface.best on.
void maximize(Surface& surface) {
  const std::unique_ptr<nlopt_opt_s, void (*)(nlopt_opt)> optimiser(
      nlopt_create(NLOPT_LD_LBFGS, surface.dimensions), nlopt_destroy);
  if (!optimiser) throw std::bad_alloc();
  nlopt_set_max_objective(optimiser.get(), evaluate, &surface);
  nlopt_set_lower_bounds(optimiser.get(), surface.lower.data());
  nlopt_set_upper_bounds(optimiser.get(), surface.upper.data());
  nlopt_set_xtol_abs1(optimiser.get(), 1e-8);
  nlopt_set_maxeval(optimiser.get(), max_evaluations);
  Pair x = surface.best;
  Pair slope = {};
  surface.most = surface.value(x, slope);
  double value = 0;
  nlopt_optimize(optimiser.get(), x.data(), &value);
}

// Maximises over (S, b) at the likelihood's tau and v. The likelihood is concave in them, so that
// any start will do.
void maximize_rates(PaperLikelihood& likelihood, PaperParameters& p) {
  const double photons = likelihood.photons();
  const double t = likelihood.seen_ns();
  const double A = likelihood.amplitude();
  const double S_unit = std::sqrt(std::max(1.0, p.signal_per_pulse * A)) / A;
  const double b_unit = std::sqrt(std::max(1.0, p.background_per_ns * t)) / t;
  Surface surface;
  // The least background is a millionth of a count, as b = 0 would make a stray photon impossible.
  surface.lower = {0, 1e-6 / t / b_unit};
  surface.upper = {2 * photons / A / S_unit, 2 * photons / t / b_unit};
  surface.best = {std::clamp(p.signal_per_pulse / S_unit, surface.lower[0], surface.upper[0]),
                  std::clamp(p.background_per_ns / b_unit, surface.lower[1], surface.upper[1])};
  surface.value = [&](const Pair& at, Pair& gradient) {
    const auto point = likelihood.evaluate(at[0] * S_unit, at[1] * b_unit);
    gradient = {point.by_signal * S_unit, point.by_background * b_unit};
    return point.gain_nats;
  };
  maximize(surface);
  p.signal_per_pulse = surface.best[0] * S_unit;
  p.background_per_ns = surface.best[1] * b_unit;
}

struct Limits {
  double least_delay_ns, largest_delay_ns;
  bool moving;
};

// Maximises over (tau, v) with S and b as they are; returns the gain there.
double maximize_motion(PaperLikelihood& likelihood, const Limits& limits, PaperParameters& p) {
  const double counts = std::sqrt(std::max(1.0, p.signal_per_pulse * likelihood.amplitude()));
  const double delay_unit = likelihood.width_ns() / counts;
  const double v_unit = delay_unit * speed_of_light_mps / likelihood.length_ns();
  const PaperParameters from = p;
  Surface surface;
  surface.dimensions = limits.moving ? 2 : 1;
  surface.lower = {(limits.least_delay_ns - from.delay_ns) / delay_unit,
                   (-most_speed_mps - from.velocity_mps) / v_unit};
  surface.upper = {(limits.largest_delay_ns - from.delay_ns) / delay_unit,
                   (most_speed_mps - from.velocity_mps) / v_unit};
  surface.value = [&](const Pair& at, Pair& gradient) {
    likelihood.move_to(from.delay_ns + at[0] * delay_unit, from.velocity_mps + at[1] * v_unit);
    const auto point = likelihood.evaluate(from.signal_per_pulse, from.background_per_ns);
    gradient = {point.by_delay * delay_unit, point.by_velocity * v_unit};
    return point.gain_nats;
  };
  maximize(surface);
  p.delay_ns = from.delay_ns + surface.best[0] * delay_unit;
  p.velocity_mps = from.velocity_mps + surface.best[1] * v_unit;
  likelihood.move_to(p.delay_ns, p.velocity_mps);
  return surface.most;
}

}  // namespace

AlternationResult alternate(PaperLikelihood& likelihood, const PaperParameters& start,
                            bool moving) {
  AlternationResult result;
  result.parameters = start;
  if (!(likelihood.photons() > 0 && likelihood.seen_ns() > 0)) return result;
  PaperParameters& p = result.parameters;
  const double width_ns = likelihood.width_ns();
  const Limits limits = {start.delay_ns - reach_widths * width_ns,
                         start.delay_ns + reach_widths * width_ns, moving};
  const double v_small = 1e-6 * width_ns * speed_of_light_mps / likelihood.length_ns();
  const double gain_small = 1e-10;
  result.stop = Stop::rounds_spent;
  likelihood.move_to(p.delay_ns, p.velocity_mps);
  for (int round = 0; round < max_rounds; ++round) {
    const PaperParameters before = p;
    maximize_rates(likelihood, p);
    const double gain_nats = maximize_motion(likelihood, limits, p);
    const double gained = gain_nats - result.gain_nats;
    result.gain_nats = gain_nats;
    if (round > 0 && std::abs(p.delay_ns - before.delay_ns) < 1e-6 * width_ns &&
        std::abs(p.velocity_mps - before.velocity_mps) < v_small) {
      result.stop = Stop::step_small;
      break;
    }
    if (round > 0 && gained < gain_small) {
      result.stop = Stop::gain_small;
      break;
    }
  }
  return result;
}

}  // namespace splid::paper
