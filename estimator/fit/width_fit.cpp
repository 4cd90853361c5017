#include "estimator/fit/width_fit.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "estimator/likelihood/small_matrix.hpp"
#include "estimator/model/units.hpp"

namespace splid {
namespace {

// A pulse of the largest width is seen to six of its deviations. Light beyond is background.
constexpr double seen_sigmas = 6;
constexpr double margin_sigmas = 4;
constexpr int most_width_rounds = 60;
constexpr double longest_log_step = 0.3;
constexpr double most_uncertain = 0.5;

// NearSet gathers very many photons in cells of an eighth of the width that it is given, at their
// mean. This takes the variance inside a cell from that of the pulse (Sheppard).
constexpr double cell_variance = 1.0 / (8 * 8 * 12);

struct WidthHill {
  Eigen::Vector3d slope;      // by (delay, travel) in widths, and by the logarithm of the width
  Eigen::Matrix3d curvature;  // of -l, with S and b at their best
};

WidthHill width_hill(const WidthPoint& point, const FrameParameters& at, double width_ns,
                     bool moving) {
  const int kept[] = {delay_index, travel_index, log_width_index};
  const Eigen::Vector3d unit(width_ns, width_ns, 1);
  const Eigen::Vector2d rate_unit(at.signal_per_pulse, at.background_per_ns);
  WidthHill hill;
  Eigen::Matrix<double, 3, 2> cross;
  for (int i = 0; i < 3; ++i) {
    hill.slope[i] = point.gradient[kept[i]] * unit[i];
    for (int j = 0; j < 3; ++j) {
      hill.curvature(i, j) = -point.hessian(kept[i], kept[j]) * unit[i] * unit[j];
    }
    for (int j = 0; j < 2; ++j) {
      cross(i, j) = -point.hessian(kept[i], signal_index + j) * unit[i] * rate_unit[j];
    }
  }
  Eigen::Matrix2d rates =
      -(rate_unit.asDiagonal() * point.hessian.block<2, 2>(signal_index, signal_index) *
        rate_unit.asDiagonal());
  const double trace = rates.trace();
  if (trace > 0) {
    rates += Eigen::Matrix2d::Identity() * (1e-12 * trace);
    if (rates.determinant() > 0) hill.curvature -= cross * rates.inverse() * cross.transpose();
  }
  if (!moving) {
    hill.slope[1] = 0;
    hill.curvature.row(1).setZero();
    hill.curvature.col(1).setZero();
    hill.curvature(1, 1) = 1;
  }
  return hill;
}

// Newton's step. Along directions in which the surface is no hill, or nearly flat, it is a step up
// the slope. No side is longer than a width, nor than longest_log_step.
Eigen::Vector3d width_step(const WidthHill& hill) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> parts(hill.curvature);
  const Eigen::Vector3d along = parts.eigenvectors().transpose() * hill.slope;
  Eigen::Vector3d scaled;
  for (int i = 0; i < 3; ++i) {
    scaled[i] = along[i] / std::max(parts.eigenvalues()[i], std::abs(along[i]) + 1e-30);
  }
  Eigen::Vector3d step = parts.eigenvectors() * scaled;
  const double longest =
      std::max(step.head<2>().cwiseAbs().maxCoeff(), std::abs(step[2]) / longest_log_step);
  if (longest > 1) step /= longest;
  return step;
}

double apart_ns(DelayLine a, DelayLine b) {
  return std::abs(a.delay_ns - b.delay_ns) + std::abs(a.travel_ns - b.travel_ns) / 2;
}

}  // namespace

WidthFit::WidthFit(double sigma_ns, const PulseTrain& train, std::size_t max_photons)
    : train_(train),
      sigma_ns_(sigma_ns),
      margin_ns_(margin_sigmas * sigma_ns),
      windows_(comb_windows(train, -(seen_sigmas * most_ratio + margin_sigmas) * sigma_ns,
                            (seen_sigmas * most_ratio + margin_sigmas) * sigma_ns)),
      near_(max_photons, max_photons * widest_overlap(windows_)),
      likelihood_(sigma_ns, max_photons * widest_overlap(windows_)) {}

WidthFit::State WidthFit::at(const Exposure& exposure, DelayLine line, double log_ratio,
                             double about_fraction) {
  const double limit = std::log(most_ratio);
  State state;
  state.log_ratio = std::clamp(log_ratio, -limit, limit);
  likelihood_.set_sigma_ns(sigma_ns_ * std::exp(state.log_ratio));
  state.best = likelihood_.profile(near_, exposure, line, about_fraction);
  return state;
}

std::optional<FittedWidth> WidthFit::climb(const FoldedFrame& frame, const Exposure& exposure,
                                           const Fit& start, bool moving) {
  DelayLine line = start.parameters.line;
  State state;
  Stop stop = Stop::not_run;
  for (int collected = 0; collected < 8; ++collected) {
    near_.collect(frame, windows_, train_, line, sigma_ns_);
    state = at(exposure, line, state.log_ratio, -1);
    stop = climb_within(exposure, moving, line, state);
    if (apart_ns(state.best.parameters.line, line) <= margin_ns_) break;
    line = state.best.parameters.line;
  }
  return with_covariance(exposure, moving, state, stop);
}

Stop WidthFit::climb_within(const Exposure& exposure, bool moving, DelayLine collected_at,
                            State& state) {
  constexpr double step_small = 1e-6;
  constexpr double gain_small = 1e-10;
  for (int round = 0; round < most_width_rounds; ++round) {
    likelihood_.set_sigma_ns(sigma_ns_ * std::exp(state.log_ratio));
    const FrameParameters& from = state.best.parameters;
    const WidthPoint point = likelihood_.evaluate(near_, exposure, from);
    Eigen::Vector3d step = width_step(width_hill(point, from, sigma_ns_, moving));
    State next;
    double gained = 0;
    for (int halving = 0; halving < 30; ++halving) {
      const DelayLine line = {from.line.delay_ns + step[0] * sigma_ns_,
                              from.line.travel_ns + step[1] * sigma_ns_};
      next = at(exposure, line, state.log_ratio + step[2], state.best.signal_fraction);
      gained = next.best.gain_nats - state.best.gain_nats;
      if (gained > -gain_small || step.cwiseAbs().maxCoeff() < step_small) break;
      step *= 0.5;
    }
    if (gained > -gain_small) state = next;
    if (step.cwiseAbs().maxCoeff() < step_small) return Stop::step_small;
    if (gained < gain_small) return Stop::gain_small;
    if (apart_ns(state.best.parameters.line, collected_at) > margin_ns_) break;
  }
  return Stop::rounds_spent;
}

std::optional<FittedWidth> WidthFit::with_covariance(const Exposure& exposure, bool moving,
                                                     const State& state, Stop stop) {
  if (std::abs(state.log_ratio) > std::log(most_ratio) - 1e-3) return std::nullopt;
  const FrameParameters& p = state.best.parameters;
  likelihood_.set_sigma_ns(sigma_ns_ * std::exp(state.log_ratio));
  const WidthPoint point = likelihood_.evaluate(near_, exposure, p);
  const double b_unit = std::max(p.background_per_ns, 1 / exposure.seen_ns);
  Eigen::Vector<double, 5> unit;
  unit << sigma_ns_, sigma_ns_, p.signal_per_pulse, b_unit, 1;
  Eigen::Matrix<double, 5, 5> information =
      -(unit.asDiagonal() * point.hessian * unit.asDiagonal());
  const auto know = [&](int index) {
    information.row(index).setZero();
    information.col(index).setZero();
    information(index, index) = 1;
  };
  if (!moving) know(travel_index);
  if (p.background_per_ns * exposure.seen_ns < 1e-6) know(background_index);
  const auto inverse = inverse_of_positive(information);
  if (!inverse) return std::nullopt;
  const Eigen::Matrix<double, 5, 5> C = unit.asDiagonal() * *inverse * unit.asDiagonal();
  const double uncertain = std::sqrt(C(log_width_index, log_width_index));
  if (!C.allFinite() || !(uncertain < most_uncertain)) return std::nullopt;

  FittedWidth fitted;
  fitted.fit.parameters = p;
  fitted.fit.gain_nats = state.best.gain_nats;
  fitted.fit.covariance = C.topLeftCorner<4, 4>();
  if (!moving) fitted.fit.covariance(travel_index, travel_index) = 0;
  fitted.fit.has_covariance = true;
  fitted.fit.stop = stop;
  const bool is_gathered = static_cast<double>(near_.photons()) < near_.near_photons;
  const double sigma_ns = sigma_ns_ * std::exp(state.log_ratio);
  fitted.sigma_ns =
      is_gathered ? std::hypot(sigma_ns, sigma_ns_ * std::sqrt(cell_variance)) : sigma_ns;
  fitted.std_sigma_ns = uncertain * fitted.sigma_ns;
  return fitted;
}

std::unique_ptr<WidthFit> make_width_fit(const PulseOptions& pulse, const PulseTrain& train,
                                         std::size_t max_photons) {
  if (pulse.width == PulseWidth::fixed) return nullptr;
  return std::make_unique<WidthFit>(pulse.sigma_ps * ns_per_ps, train, max_photons);
}

}  // namespace splid
