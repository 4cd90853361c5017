#include "estimator/several/joint_fit.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/likelihood/small_matrix.hpp"

namespace splid {
namespace {

constexpr int most_rounds = 40;
constexpr int most_collected = 8;
constexpr double joint_margin_widths = 4;
// A signal and a background keep at least so much of themselves in one step, so that they stay
// above 0.
constexpr double least_kept_rate = 0.1;

JointParameters stepped(const JointParameters& from, const SmallVector& step) {
  JointParameters to = from;
  for (std::size_t k = 0; k < from.count; ++k) {
    const auto d = static_cast<Eigen::Index>(3 * k);
    TargetParameters& target = to.targets.at(k);
    target.line.delay_ns += step[d];
    target.line.travel_ns += step[d + 1];
    target.signal_per_pulse =
        std::max(target.signal_per_pulse + step[d + 2], least_kept_rate * target.signal_per_pulse);
  }
  to.background_per_ns = std::max(from.background_per_ns + step[step.size() - 1],
                                  least_kept_rate * from.background_per_ns);
  return to;
}

// The information in `units`, with a 1 in place of each parameter that is fixed.
template <class Fixed>
SmallMatrix information(const SmallMatrix& hessian, const SmallVector& units, const Fixed& fixed) {
  SmallMatrix J = -(units.asDiagonal() * hessian * units.asDiagonal());
  for (Eigen::Index i = 0; i < J.rows(); ++i) {
    if (!fixed.at(static_cast<std::size_t>(i))) continue;
    J.row(i).setZero();
    J.col(i).setZero();
    J(i, i) = 1;
  }
  return J;
}

}  // namespace

JointFit::JointFit(const PulseShape& shape, const PulseTrain& train, std::size_t max_photons)
    : width_ns_(shape.width_ns()),
      likelihood_(shape, train, max_photons, joint_margin_widths * shape.width_ns()) {}

// In these units the information is well conditioned. Where no photon speaks for a background, the
// likelihood falls as exp(-b t), so that the unit of b is then 1 / t.
SmallVector JointFit::units_of(const JointParameters& at, const Exposure& exposure) const {
  SmallVector units(static_cast<Eigen::Index>(at.size()));
  for (std::size_t k = 0; k < at.count; ++k) {
    const double S = at.targets.at(k).signal_per_pulse;
    units.segment<3>(static_cast<Eigen::Index>(3 * k)) << width_ns_, width_ns_, S > 0 ? S : 1;
  }
  units[units.size() - 1] = std::max(at.background_per_ns, 1 / exposure.seen_ns);
  return units;
}

void JointFit::begin(const FoldedFrame& frame, const Exposure& exposure) {
  const auto all = static_cast<double>(frame.size());
  no_target_nats_ = all * std::log(all / exposure.seen_ns) - all;
  likelihood_.forget();
}

JointMaximum JointFit::climb(const FoldedFrame& frame, const Exposure& exposure,
                             const JointParameters& start, bool moving, double to_beat_nats) {
  Fixed fixed{};
  for (std::size_t k = 0; k < start.count; ++k) fixed.at(3 * k + 1) = !moving;
  JointMaximum maximum;
  maximum.at = start;
  for (int collected = 0; collected < most_collected; ++collected) {
    likelihood_.hold(frame, maximum.at);
    climb_within(exposure, fixed, to_beat_nats, maximum);
    if (maximum.stop == Stop::beaten) return maximum;
    if (likelihood_.serves(maximum.at)) break;
  }
  add_covariance(exposure, fixed, maximum);
  return maximum;
}

// On return `point_` is the likelihood at the best place.
void JointFit::climb_within(const Exposure& exposure, const Fixed& fixed, double to_beat_nats,
                            JointMaximum& best) {
  constexpr double first_damping = 1e-3;
  constexpr double most_damping = 1e8;
  constexpr double step_small = 1e-6;  // in the units of units_of()
  constexpr double gain_small = 1e-10;
  constexpr double last_gain = 3e-3;      // nats: 0.08 deviations
  constexpr double last_if_fast = 2e-2;   // 0.2 deviations
  constexpr double left_to_gain = 3e-5;   // 0.008 deviations
  constexpr double most_of_promised = 3;  // what is gained over what a parabola promises
  likelihood_.evaluate(exposure, best.at, point_);
  double damping = 0;
  best.stop = Stop::rounds_spent;
  double gained_before = 0;  // with a whole step of Newton's method, as its parabola said
  JointPoint next;
  for (int round = 0; round < most_rounds; ++round) {
    const SmallVector units = units_of(best.at, exposure);
    SmallMatrix J = information(point_.hessian, units, fixed);
    SmallVector slope = units.asDiagonal() * point_.gradient;
    for (Eigen::Index i = 0; i < slope.size(); ++i) {
      if (fixed.at(static_cast<std::size_t>(i))) slope[i] = 0;
      J(i, i) += damping * std::max(std::abs(J(i, i)), 1.0);
    }
    const auto uphill = solution_of_positive(J, slope);
    if (!uphill) {
      damping = std::max(10 * damping, first_damping);
      if (damping > most_damping) break;
      continue;
    }
    SmallVector step = *uphill;
    const double promised = slope.dot(step) / 2;
    if (damping == 0 &&
        point_.value + most_of_promised * promised < to_beat_nats + no_target_nats_) {
      point_.value += promised;
      best.stop = Stop::beaten;
      break;
    }
    const double longest = step.cwiseAbs().maxCoeff();
    if (longest > 1) step /= longest;
    // What is left to gain on this hill. A last step that short ends a tenth of its length from the
    // top at most, so that nothing is to be seen there. One after which no more than that is left
    // if the gains go on to shrink as they did is as good.
    const double to_gain = slope.dot(step) / 2;
    const bool is_whole = damping == 0 && longest <= 1;
    const bool shrinks_fast =
        to_gain < last_if_fast && to_gain * to_gain < left_to_gain * gained_before;
    if (is_whole && (to_gain < last_gain || shrinks_fast)) {
      best.at = stepped(best.at, units.asDiagonal() * step);
      point_.value += to_gain;
      best.stop = Stop::gain_small;
      break;
    }
    next = point_;
    const JointParameters to = stepped(best.at, units.asDiagonal() * step);
    likelihood_.evaluate(exposure, to, next);
    const double gained = next.value - point_.value;
    const bool is_better = gained > -gain_small;
    gained_before = is_whole ? to_gain : 0;
    if (is_better) {
      best.at = to;
      std::swap(point_, next);
      damping = damping > first_damping ? damping / 10 : 0;
    } else {
      damping = std::max(10 * damping, first_damping);
    }
    if (longest < step_small || (is_better && gained < gain_small)) {
      best.stop = longest < step_small ? Stop::step_small : Stop::gain_small;
      break;
    }
    if (damping > most_damping || !likelihood_.serves(best.at)) break;
  }
  best.gain_nats = point_.value - no_target_nats_;
}

void JointFit::add_covariance(const Exposure& exposure, const Fixed& fixed, JointMaximum& maximum) {
  const SmallVector units = units_of(maximum.at, exposure);
  Fixed known = fixed;
  const std::size_t b = maximum.at.size() - 1;
  known.at(b) = maximum.at.background_per_ns * exposure.seen_ns < 1e-6;
  const auto inverse = inverse_of_positive(information(point_.hessian, units, known));
  if (!inverse) return;
  maximum.covariance = units.asDiagonal() * *inverse * units.asDiagonal();
  for (std::size_t i = 0; i < b; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    if (fixed.at(i)) maximum.covariance(k, k) = 0;
  }
  maximum.has_covariance = maximum.covariance.allFinite();
}

double JointFit::gain_without(std::size_t target, const Exposure& exposure,
                              const JointMaximum& of) {
  const double of_all = of.gain_nats + no_target_nats_;
  return likelihood_.best_without(target, exposure, of.at, of_all) - no_target_nats_;
}

}  // namespace splid
