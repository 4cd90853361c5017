#include "estimator/paper/alternation.hpp"

#include <nlopt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <new>

#include "estimator/model/units.hpp"

namespace splid::paper {
namespace {

using likelihood::LogLikelihood;
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

// The gain over no target, and its derivatives by [P]'s parameters.
struct Gain {
  double nats, by_delay, by_velocity, by_signal, by_background;
};

// With g = 2 beta / (1 + beta), tau at the frame's start is the track D = tau / (1 + beta) + g t_a
// / 2 at mid-frame, with the range walk g t_a.
Gain gain_at(LogLikelihood& likelihood, const PaperParameters& p) {
  const double length_ns = likelihood.exposure().length_ns;
  const double beta = p.velocity_mps / speed_of_light_mps;
  const double walk_ns = walk_ns_at(p.velocity_mps, length_ns);
  const likelihood::Model model = likelihood::model_of(
      {p.delay_ns / (1 + beta) + walk_ns / 2, walk_ns}, p.signal_per_pulse, p.background_per_ns);
  if (!likelihood.serves(model)) {
    likelihood.collect(model, std::numeric_limits<std::size_t>::max());
  }
  likelihood::Point at;
  likelihood.evaluate(model, likelihood::free_set(1, 2), at);
  const double by_delay = at.gradient[likelihood::delay];
  const double by_walk = at.gradient[likelihood::walk];
  const double per_mps = 1 / ((1 + beta) * (1 + beta) * speed_of_light_mps);
  return {at.value - likelihood.no_target_nats(), by_delay / (1 + beta),
          ((length_ns - p.delay_ns) * by_delay + 2 * length_ns * by_walk) * per_mps,
          at.gradient[likelihood::signal], at.gradient[likelihood::background_place(1)]};
}

// Maximises over (S, b), in which the likelihood is concave, so that any start will do.
void maximize_rates(LogLikelihood& likelihood, PaperParameters& p) {
  const auto photons = static_cast<double>(likelihood.photons());
  const double t = likelihood.exposure().seen_ns;
  const double A = likelihood.exposure().amplitude;
  const double S_unit = std::sqrt(std::max(1.0, p.signal_per_pulse * A)) / A;
  const double b_unit = std::sqrt(std::max(1.0, p.background_per_ns * t)) / t;
  Surface surface;
  // The least background is a millionth of a count, as b = 0 would make a stray photon impossible.
  surface.lower = {0, 1e-6 / t / b_unit};
  surface.upper = {2 * photons / A / S_unit, 2 * photons / t / b_unit};
  surface.best = {std::clamp(p.signal_per_pulse / S_unit, surface.lower[0], surface.upper[0]),
                  std::clamp(p.background_per_ns / b_unit, surface.lower[1], surface.upper[1])};
  surface.value = [&](const Pair& at, Pair& gradient) {
    const Gain gain =
        gain_at(likelihood, {p.delay_ns, p.velocity_mps, at[0] * S_unit, at[1] * b_unit});
    gradient = {gain.by_signal * S_unit, gain.by_background * b_unit};
    return gain.nats;
  };
  maximize(surface);
  p.signal_per_pulse = surface.best[0] * S_unit;
  p.background_per_ns = surface.best[1] * b_unit;
}

// Maximises over (tau, v) with S and b as they are; returns the gain there.
double maximize_motion(LogLikelihood& likelihood, double start_ns, bool moving,
                       PaperParameters& p) {
  const double width_ns = likelihood.shape().width_ns();
  const double counts =
      std::sqrt(std::max(1.0, p.signal_per_pulse * likelihood.exposure().amplitude));
  const double delay_unit = width_ns / counts;
  const double v_unit = delay_unit * speed_of_light_mps / likelihood.exposure().length_ns;
  const PaperParameters from = p;
  const auto moved = [&](const Pair& at) {
    return PaperParameters{from.delay_ns + at[0] * delay_unit, from.velocity_mps + at[1] * v_unit,
                           from.signal_per_pulse, from.background_per_ns};
  };
  Surface surface;
  surface.dimensions = moving ? 2 : 1;
  surface.lower = {(start_ns - reach_widths * width_ns - from.delay_ns) / delay_unit,
                   (-most_speed_mps - from.velocity_mps) / v_unit};
  surface.upper = {(start_ns + reach_widths * width_ns - from.delay_ns) / delay_unit,
                   (most_speed_mps - from.velocity_mps) / v_unit};
  surface.value = [&](const Pair& at, Pair& gradient) {
    const Gain gain = gain_at(likelihood, moved(at));
    gradient = {gain.by_delay * delay_unit, gain.by_velocity * v_unit};
    return gain.nats;
  };
  maximize(surface);
  p = moved(surface.best);
  return surface.most;
}

}  // namespace

AlternationResult alternate(LogLikelihood& likelihood, const PaperParameters& start, bool moving) {
  constexpr double gain_small = 1e-10;
  AlternationResult result;
  result.parameters = start;
  if (likelihood.photons() == 0 || !(likelihood.exposure().seen_ns > 0)) return result;
  PaperParameters& p = result.parameters;
  const double delay_small = 1e-6 * likelihood.shape().width_ns();
  const double v_small = delay_small * speed_of_light_mps / likelihood.exposure().length_ns;
  result.stop = Stop::rounds_spent;
  for (int round = 0; round < max_rounds; ++round) {
    const PaperParameters before = p;
    maximize_rates(likelihood, p);
    const double gain_nats = maximize_motion(likelihood, start.delay_ns, moving, p);
    const double gained = gain_nats - result.gain_nats;
    result.gain_nats = gain_nats;
    if (round == 0) continue;
    const bool is_still = std::abs(p.delay_ns - before.delay_ns) < delay_small &&
                          std::abs(p.velocity_mps - before.velocity_mps) < v_small;
    if (is_still || gained < gain_small) {
      result.stop = is_still ? Stop::step_small : Stop::gain_small;
      break;
    }
  }
  return result;
}

}  // namespace splid::paper
