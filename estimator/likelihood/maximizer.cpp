#include "estimator/likelihood/maximizer.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/likelihood/information.hpp"

namespace splid::likelihood {
namespace {

constexpr int most_rounds = 40;
constexpr int most_collected = 32;
// A rate keeps at least so much of itself in one step, so that it stays above 0.
constexpr double least_kept = 0.01;

Model stepped(const Model& from, const SmallVector& step, double most_log_width) {
  const auto kept = [](double rate, double by) { return std::max(rate + by, least_kept * rate); };
  Model to = from;
  for (std::size_t k = 0; k < from.count; ++k) {
    Target& target = to.targets[k];
    const auto d = static_cast<Eigen::Index>(of_target * k);
    target.track.delay_ns += step[d + delay];
    target.track.walk_ns += step[d + walk];
    target.track.quadratic_ns += step[d + quadratic];
    target.signal_per_pulse = kept(target.signal_per_pulse, step[d + signal]);
  }
  const Eigen::Index w = static_cast<Eigen::Index>(width_place(from.count));
  to.log_width = std::clamp(from.log_width + step[w], -most_log_width, most_log_width);
  to.background_per_ns = kept(from.background_per_ns, step[w + 1]);
  return to;
}

// Gathered photons stand at the mean of their cell, which takes the variance inside a cell from
// that of the pulse (Sheppard): what that adds to the logarithm of the width.
double spread_of_cells(const Model& model) {
  constexpr double cell_variance = 1 / (12 * NearSet::cells_a_width * NearSet::cells_a_width);
  return 0.5 * std::log1p(cell_variance * std::exp(-2 * model.log_width));
}

// The longest part of a step in units, of rates left out: these are kept above 0 by themselves.
double longest_of(const SmallVector& step) {
  double longest = 0;
  for (Eigen::Index i = 0; i + 1 < step.size(); ++i) {
    if (i % of_target != signal) longest = std::max(longest, std::abs(step[i]));
  }
  return longest;
}

// The damping of the next try, after one that did not gain.
double more_damping(double damping) { return std::max(10 * damping, 1e-3); }
double less_damping(double damping) { return damping > 1e-3 ? damping / 10 : 0; }

// Newton's step, in units, damped; empty where the damped surface is not concave.
std::optional<SmallVector> step_of(SmallMatrix information, const SmallVector& slope,
                                   double damping) {
  for (Eigen::Index i = 0; i < slope.size(); ++i) {
    information(i, i) += damping * std::max(std::abs(information(i, i)), 1.0);
  }
  return solution_of_positive(information, slope);
}

}  // namespace

Maximizer::Maximizer(const PulseShape& shape, const PulseTrain& train, std::size_t max_photons,
                     const Scope& scope)
    : width_ns_(shape.width_ns()),
      most_log_width_(std::log(scope.most_width)),
      likelihood_(shape, train, max_photons, scope) {}

// Signals of 0 become what the photons within two widths of a track show beyond the background.
Model Maximizer::with_rates(const Model& start) const {
  Model model = start;
  const Exposure& exposure = likelihood_.exposure();
  const NearPhotons& near = likelihood_.near();
  const double all = static_cast<double>(likelihood_.photons());
  const double dark = all * likelihood_.train().pulses_per_ns * 2 * half_pulse_widths * width_ns_;
  double signal_photons = 0;
  for (std::size_t k = 0; k < model.count; ++k) {
    Target& target = model.targets[k];
    if (!(target.signal_per_pulse > 0)) {
      const double photons = near.count_within(k, target.track, half_pulse_widths * width_ns_);
      target.signal_per_pulse = std::max(photons - dark, 1.0) / exposure.amplitude;
    }
    signal_photons += target.signal_per_pulse * exposure.amplitude;
  }
  if (!(model.background_per_ns > 0)) {
    model.background_per_ns = std::max(all - signal_photons, 0.5) / exposure.seen_ns;
  }
  return model;
}

// Design note: where photons are gathered anyway, a first maximum of cells of more photons leads
// to that of cells of few; see NearSet.
Maximum Maximizer::maximize(const Model& start, const Aim& aim) {
  Maximum best;
  best.model = start;
  maximize_gathered(aim, NearSet::gathered_roughly_from, best);
  const NearPhotons& near = likelihood_.near();
  const bool is_exact = !near.gathers() || near.likely_near() >= NearSet::gathered_from;
  if (!is_exact && best.stop != Stop::beaten) {
    maximize_gathered(aim, NearSet::gathered_from, best);
  }
  if (best.stop == Stop::beaten) return best;
  add_covariance(aim.free, best);
  if (near.gathers() && aim.free[width_place(1)])
    best.model.log_width += spread_of_cells(best.model);
  return best;
}

void Maximizer::add_covariance(const FreeSet& free, Maximum& at) const {
  const std::optional<SmallMatrix> C =
      covariance_of(point_.hessian, at.model, likelihood_.exposure(), width_ns_, free);
  at.has_covariance = C.has_value();
  if (C) at.covariance = *C;
}

Maximum Maximizer::judge(const Model& at, const FreeSet& free) {
  if (!likelihood_.serves(at)) likelihood_.collect(at, NearSet::gathered_from);
  likelihood_.evaluate(at, free, point_);
  Maximum maximum;
  maximum.model = at;
  maximum.gain_nats = point_.value - likelihood_.no_target_nats();
  if (std::isfinite(maximum.gain_nats)) add_covariance(free, maximum);
  return maximum;
}

void Maximizer::maximize_gathered(const Aim& aim, std::size_t gather_from, Maximum& best) {
  for (int collected = 0; collected < most_collected; ++collected) {
    likelihood_.collect(best.model, gather_from);
    best.model = with_rates(best.model);
    maximize_within(aim, best);
    if (best.stop == Stop::beaten || likelihood_.serves(best.model)) return;
  }
}

// On return point_ is the likelihood at the best place, or at the place before a last short step.
void Maximizer::maximize_within(const Aim& aim, Maximum& best) {
  constexpr double gain_small = 1e-10;
  const double none_nats = likelihood_.no_target_nats();
  likelihood_.evaluate(best.model, aim.free, point_);
  double damping = 0;
  best.stop = Stop::rounds_spent;
  for (int round = 0; round < most_rounds; ++round) {
    const FreeSet free = known_free(aim.free, best.model, likelihood_.exposure());
    const SmallVector units = units_of(best.model, likelihood_.exposure(), width_ns_);
    SmallVector slope = units.asDiagonal() * point_.gradient;
    for (Eigen::Index i = 0; i < slope.size(); ++i) {
      if (!free[static_cast<std::size_t>(i)]) slope[i] = 0;
    }
    const auto step = step_of(information_of(point_.hessian, units, free), slope, damping);
    if (!step) {
      damping = more_damping(damping);
      continue;
    }
    const double promised = slope.dot(*step) / 2;
    const double longest = longest_of(*step);
    if (damping == 0 && point_.value + most_nats(promised) < aim.to_beat_nats + none_nats) {
      best.stop = Stop::beaten;
      break;
    }
    const SmallVector taken = units.asDiagonal() * *step / std::max(longest, 1.0);
    const Model to = stepped(best.model, taken, most_log_width_);
    if (damping == 0 && promised < aim.enough_nats) {
      best.model = to;
      point_.value += promised;
      best.stop = Stop::gain_small;
      break;
    }
    likelihood_.evaluate(to, aim.free, next_);
    const double gained = next_.value - point_.value;
    const bool is_better = gained > -gain_small;
    if (is_better) {
      best.model = to;
      std::swap(point_, next_);
    }
    damping = is_better ? less_damping(damping) : more_damping(damping);
    if (is_better && gained < gain_small) {
      best.stop = Stop::gain_small;
      break;
    }
    if (!likelihood_.serves(best.model)) break;
  }
  best.gain_nats = point_.value - none_nats;
}

}  // namespace splid::likelihood
