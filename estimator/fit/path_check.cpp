#include "estimator/fit/path_check.hpp"

#include <cmath>

#include "estimator/fit/small_matrix.hpp"
#include "estimator/model/units.hpp"

namespace splid {
namespace {

constexpr double path_reach_widths = 4;
// Of signal, for a bend; and of signal and background together, for a gap, so that parts of the
// frame have normal deviations.
constexpr double fewest_for_bend = 40;
constexpr double fewest_for_gap = 15;  // of signal
// Squared deviations of the bend. Chance reaches the first in one frame of a million.
constexpr double surely_bent = 24;
constexpr double surely_parted = 24;
constexpr double may_be_straight = 4;
// With fewer photons a part of the frame may be empty by chance.
constexpr double fewest_for_straight = 100;
// Of chi squared with 7 degrees of freedom: one even frame of a thousand is taken as uneven.
constexpr double most_uneven_signal = 24.3;
// Chi squared reaches this in one even frame of a million. A part of the frame is without signal
// where it has less than a quarter of the mean; fading light seldom has that in an eighth.
constexpr double surely_uneven_signal = 41;
constexpr double most_in_gap = 0.25;

}  // namespace

bool PathVerdict::bends() const { return deviations * deviations >= surely_bent; }

bool PathVerdict::is_straight() const {
  return photons >= fewest_for_straight && is_even && deviations * deviations < may_be_straight;
}

bool PathVerdict::parts() const {
  return !bends() && parting_deviations * parting_deviations >= surely_parted;
}

void PathVerdict::widen(Estimate& estimate, double scale, double length_ns) const {
  if (!bends() && !parts() && signal_gap == 0) return;
  if (bends()) estimate.acceleration_misfit_mps2 = acceleration_of_bend(bend_ns, length_ns);
  if (signal_gap > 0) estimate.signal_gap = signal_gap;
  const bool is_straight = !bends() && signal_gap == 0;
  const double delay_ns = is_straight ? 0 : off_delay_ns;
  const double travel_ns = is_straight ? 0 : off_travel_ns;
  estimate.std_delay_ns = std::hypot(estimate.std_delay_ns, delay_ns * scale);
  // The velocity of a travel is c g / (2 - g), g = travel / length.
  if (estimate.std_velocity_mps == 0) return;  // the target was taken to be at rest
  const double off_ns = std::hypot(travel_ns, parts() ? parting_ns : 0);
  estimate.std_velocity_mps =
      std::hypot(estimate.std_velocity_mps, speed_of_light_mps * off_ns / (2 * length_ns));
}

PathCheck::PathCheck(const PulseShape& shape, double closest_ns) : shape_(shape) {
  const double reach_ns = path_reach_widths * shape.width_ns();
  if (reach_ns > 0.499 * closest_ns) return;
  first_ns_ = shape.peak_offset_ns() - reach_ns;
  steps_per_ns_ = static_cast<double>(steps) / (2 * reach_ns);
}

void PathCheck::begin(double signal_per_pulse, double background_per_ns, bool sends_evenly) {
  background_per_ns_ = background_per_ns;
  sends_evenly_ = sends_evenly;
  score_.setZero();
  information_.setZero();
  moments_.setZero();
  signal_.fill(0);
  spread_ = 0;
  spread_score_.setZero();
  spread_moments_.setZero();
  curves_ = 0;
  if (steps_per_ns_ == 0) return;
  std::array<double, steps> offset{}, h{}, d1{}, d2{};
  for (std::size_t i = 0; i < steps; ++i) {
    offset[i] = first_ns_ + (static_cast<double>(i) + 0.5) / steps_per_ns_;
  }
  shape_.evaluate(offset, {h, d1, d2});
  for (std::size_t i = 0; i < steps; ++i) {
    const double lambda = background_per_ns + signal_per_pulse * h[i];
    slope_[i] = lambda > 0 ? -signal_per_pulse * d1[i] / lambda : 0;
    chance_[i] = lambda > 0 ? signal_per_pulse * h[i] / lambda : 0;
    curve_[i] = lambda > 0 ? signal_per_pulse * d2[i] / lambda / 2 : 0;
  }
}

PathVerdict PathCheck::judge(double pulses) const {
  PathVerdict verdict;
  if (steps_per_ns_ == 0) return verdict;
  // What photons of background add to the chances, evenly over the frame.
  double dark = 0;
  for (const double chance : chance_) dark += chance * background_per_ns_ * pulses / steps_per_ns_;
  double all = 0;
  for (const double photons : signal_) all += photons;
  verdict.photons = all - dark;
  if (verdict.photons < fewest_for_gap || all * all < fewest_for_bend * spread_) return verdict;
  judge_light(dark, verdict);
  if (verdict.photons >= fewest_for_bend) {
    step_to_bend(verdict);
    part(verdict);
  }
  if (verdict.signal_gap > 0) bend_away(dark, verdict);
  return verdict;
}

void PathCheck::judge_light(double dark, PathVerdict& verdict) const {
  const double mean = verdict.photons / parts;
  double squares = 0;
  int gaps = 0;
  for (const double photons : signal_) {
    const double signal = photons - dark / parts;
    squares += (signal - mean) * (signal - mean);
    gaps += signal < most_in_gap * mean ? 1 : 0;
  }
  verdict.is_even = squares < most_uneven_signal * spread_ / parts;
  const bool is_surely_uneven = squares > surely_uneven_signal * spread_ / parts;
  if (sends_evenly_ && is_surely_uneven) verdict.signal_gap = static_cast<double>(gaps) / parts;
}

void PathCheck::step_to_bend(PathVerdict& verdict) const {
  const auto inverse = inverse_of_positive(information_);
  if (!inverse) return;
  const Eigen::Matrix3d covariance = *inverse;
  const Eigen::Vector3d step = covariance * score_;
  const Eigen::Vector3d mid(1, 0, -1.0 / 12);  // the delay at mid-frame, by the three
  if (!covariance.allFinite() || !step.allFinite()) return;
  verdict.bend_ns = step[2];
  verdict.deviations = step[2] / std::sqrt(covariance(2, 2));
  verdict.off_delay_ns = std::abs(mid.dot(step));
  verdict.off_travel_ns = std::abs(step[1]);
}

// The curvature of the spread over the frame, by one step of scoring from none: two at +-(d + t s)
// have t t.
void PathCheck::part(PathVerdict& verdict) const {
  const auto inverse = inverse_of_positive(spread_moments_);
  if (!inverse || !(curves_ > 0)) return;
  const Eigen::Matrix3d solution = *inverse;
  const double photons = spread_moments_(0, 0);
  const double curvature = solution.row(2).dot(spread_score_);
  const double mean = spread_score_[0] / photons;
  const double variance = solution(2, 2) * (curves_ / photons - mean * mean);
  if (!(curvature > 0) || !(variance > 0)) return;
  verdict.parting_ns = std::sqrt(curvature * photons / curves_);
  verdict.parting_deviations = curvature / std::sqrt(variance);
}

// A line that touches a path holds the light of the part in which the path is within some three
// pulse widths of it. The signal's mean and variance over the frame tell where that part is and how
// long, and so about how much the path bends: a part of the half-length d has the variance d^2 / 3,
// and the bend 3 widths / d^2. The deviations hold twice what such a bend moves, since the estimate
// of the bend may be half of it.
void PathCheck::bend_away(double dark, PathVerdict& verdict) const {
  const Eigen::Vector2d mean = (moments_ - Eigen::Vector2d(0, dark / 12)) / verdict.photons;
  const double variance = std::max(mean[1] - mean[0] * mean[0], 1e-6);
  const double bend_ns = 2 * shape_.width_ns() / variance;
  verdict.off_delay_ns = std::hypot(verdict.off_delay_ns, bend_ns * mean[0] * mean[0]);
  verdict.off_travel_ns = std::hypot(verdict.off_travel_ns, 2 * bend_ns * mean[0]);
}

}  // namespace splid
