#include "estimator/checks/path_check.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/likelihood/small_matrix.hpp"
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
constexpr double surely_turned = 24;
constexpr double surely_parted = 24;
// From these squared deviations on, deviations hold a bend or a turn that is likely and not sure.
// Chance reaches them in one frame of 22 and in one of 370. A turn moves the velocity by more of
// its deviations than a bend moves the distance, and is asked for more.
constexpr double likely_bent = 4;
constexpr double likely_turned = 9;
constexpr double may_be_straight = 4;
// With fewer photons a part of the frame may be empty by chance.
constexpr double fewest_for_straight = 100;
// Of chi squared with 7 degrees of freedom: one even frame of a thousand is taken as uneven.
constexpr double most_uneven_signal = 24.3;
// Gaps are told in eighths of the frame.
constexpr std::size_t eighths = 8;
// Light beside the pulse is looked for so far from its peak.
constexpr double beside_widths = 5, most_beside_widths = 8, least_beside_widths = 1;
// Chance has such light in three frames of a million, and then as much left over in one of twenty.
constexpr double surely_beside = 4.5;
constexpr double degrees_left = 7;
constexpr double most_left = 14.07;
// What is left is taken to be that of so many of these seven, as large as what the fit has taken
// for a delay and a travel.
constexpr double modes_like_these = 3;
// Chi squared reaches this in one even frame of a million. A part of the frame is without signal
// where it has less than a quarter of the mean; fading light seldom has that in an eighth.
constexpr double surely_uneven_signal = 41;
constexpr double most_in_gap = 0.25;

}  // namespace

bool PathVerdict::bends() const { return deviations * deviations >= surely_bent; }

bool PathVerdict::is_straight() const {
  return photons >= fewest_for_straight && is_even && deviations * deviations < may_be_straight;
}

bool PathVerdict::turns() const { return turn_deviations * turn_deviations >= surely_turned; }

bool PathVerdict::parts() const {
  return !bends() && !(is_bent && turns()) &&
         parting_deviations * parting_deviations >= surely_parted;
}

bool PathVerdict::is_met(bool has_pulse_misfit) const {
  const bool is_other = has_pulse_misfit || beside_deviations > surely_beside;
  return !bends() && !parts() && signal_gap == 0 && is_other && left > most_left;
}

// The velocity of a travel is c g / (2 - g), g = travel / length.
void PathVerdict::widen_velocity(Estimate& estimate, double length_ns, double off_ns) const {
  if (estimate.std_velocity_mps == 0) return;  // the target was taken to be at rest
  estimate.std_velocity_mps =
      std::hypot(estimate.std_velocity_mps, speed_of_light_mps * off_ns / (2 * length_ns));
}

void PathVerdict::widen(Estimate& estimate, double scale, double length_ns,
                        bool has_pulse_misfit) const {
  if (is_met(has_pulse_misfit)) {
    const double more = std::sqrt(1 + (left - degrees_left) / modes_like_these);
    estimate.std_delay_ns *= more;
    estimate.std_velocity_mps *= more;
  }
  if (!bends() && !parts() && signal_gap == 0) return;
  if (bends()) estimate.acceleration_misfit_mps2 = acceleration_of_bend(bend_ns, length_ns);
  if (signal_gap > 0) estimate.signal_gap = signal_gap;
  const bool is_right = !bends() && signal_gap == 0;
  const double delay_ns = is_right ? 0 : off_delay_ns;
  const double travel_ns = is_right ? 0 : off_travel_ns;
  estimate.std_delay_ns = std::hypot(estimate.std_delay_ns, delay_ns * scale);
  widen_velocity(estimate, length_ns, std::hypot(travel_ns, parts() ? parting_ns : 0));
}

void PathVerdict::say_excess(Estimate& estimate) const {
  if (photons < fewest_for_bend) return;
  const double squares = deviations * deviations + turn_deviations * turn_deviations +
                         swing_deviations * swing_deviations;
  estimate.path_excess = std::sqrt(squares / 3);
}

void PathVerdict::widen_if_accelerating(Estimate& estimate, double scale, double length_ns,
                                        bool has_pulse_misfit) const {
  if (photons < fewest_for_bend) return;
  const double bent = deviations * deviations, turned = turn_deviations * turn_deviations;
  estimate.path_excess = is_bent ? std::abs(turn_deviations) : std::sqrt((bent + turned) / 2);
  if (turns()) {
    if (!bends() && !is_met(has_pulse_misfit)) {
      estimate.jerk_misfit_mps3 = jerk_of_turn(turn_ns, length_ns);
    }
    widen_velocity(estimate, length_ns, turn_travel_ns);
  }
  if (signal_gap > 0) return;
  if (!is_bent && !bends() && bent >= likely_bent) {
    estimate.std_delay_ns = std::hypot(estimate.std_delay_ns, off_delay_ns * scale);
  }
  if (!turns() && turned >= likely_turned) widen_velocity(estimate, length_ns, turn_travel_ns);
}

PathCheck::PathCheck(const PulseShape& shape, double closest_ns) : shape_(shape) {
  const double reach_ns = path_reach_widths * shape.width_ns();
  if (reach_ns > 0.499 * closest_ns) return;
  first_ns_ = shape.peak_offset_ns() - reach_ns;
  steps_per_ns_ = static_cast<double>(steps) / (2 * reach_ns);
  const double last_ns = std::min(most_beside_widths * shape.width_ns(), 0.499 * closest_ns);
  const double least_ns = (beside_widths + least_beside_widths) * shape.width_ns();
  if (last_ns < least_ns) return;
  beside_first_ns_ = beside_widths * shape.width_ns();
  beside_last_ns_ = last_ns;
}

void PathCheck::begin(double signal_per_pulse, double background_per_ns, bool sends_evenly) {
  background_per_ns_ = background_per_ns;
  sends_evenly_ = sends_evenly;
  score_.setZero();
  information_.setZero();
  moments_.setZero();
  parts_.fill({});
  beside_ = 0;
  spread_ = 0;
  spread_score_.setZero();
  spread_moments_.setZero();
  curves_ = 0;
  if (steps_per_ns_ == 0) return;
  const double peak_ns = shape_.peak_offset_ns();
  const std::array ends_ns = {peak_ns - beside_last_ns_, peak_ns - beside_first_ns_,
                              peak_ns + beside_first_ns_, peak_ns + beside_last_ns_};
  std::array<double, 4> come{};
  shape_.integrate(ends_ns, come);
  light_beside_ = signal_per_pulse * (come[1] - come[0] + come[3] - come[2]);
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

PathVerdict PathCheck::judge(double pulses, bool is_bent) const {
  PathVerdict verdict;
  verdict.is_bent = is_bent;
  if (steps_per_ns_ == 0) return verdict;
  // What photons of background add to the chances, evenly over the frame.
  double dark = 0;
  for (const double chance : chance_) dark += chance * background_per_ns_ * pulses / steps_per_ns_;
  double all = 0;
  for (const Part& part : parts_) all += part.signal;
  verdict.photons = all - dark;
  if (verdict.photons < fewest_for_gap || all * all < fewest_for_bend * spread_) return verdict;
  judge_light(dark, verdict);
  if (verdict.photons >= fewest_for_bend) {
    step_to_bend(verdict);
    step_to_turn(verdict);
    part(verdict);
    verdict.left = left_over(dark, verdict.photons);
    verdict.beside_deviations = deviations_beside(pulses);
  }
  if (verdict.signal_gap > 0) bend_away(dark, verdict);
  return verdict;
}

void PathCheck::judge_light(double dark, PathVerdict& verdict) const {
  const double mean = verdict.photons / eighths;
  double squares = 0;
  int gaps = 0;
  for (std::size_t eighth = 0; eighth < eighths; ++eighth) {
    double signal = -dark / eighths;
    for (std::size_t i = 0; i < parts / eighths; ++i) {
      signal += parts_[eighth * parts / eighths + i].signal;
    }
    squares += (signal - mean) * (signal - mean);
    gaps += signal < most_in_gap * mean ? 1 : 0;
  }
  verdict.is_even = squares < most_uneven_signal * spread_ / eighths;
  const bool is_surely_uneven = squares > surely_uneven_signal * spread_ / eighths;
  if (sends_evenly_ && is_surely_uneven) verdict.signal_gap = static_cast<double>(gaps) / eighths;
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

// The cube of the time is taken less its first slope, as the bend is taken less its mean. The
// photons of a part of the frame are taken to be at its middle, which loses nothing.
void PathCheck::step_to_turn(PathVerdict& verdict) const {
  constexpr double first_slope = 3.0 / 20;
  Eigen::Vector4d score = Eigen::Vector4d::Zero();
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  double squares = 0, lit = 0;
  for (std::size_t i = 0; i < parts; ++i) {
    if (!(parts_[i].slopes > 0)) continue;
    squares += parts_[i].slope * parts_[i].slope / parts_[i].slopes;
    lit += 1;
    const double s = (static_cast<double>(i) + 0.5) / parts - 0.5;
    const Eigen::Vector4d by(1, s, s * s - 1.0 / 12, s * (s * s - first_slope));
    score += parts_[i].slope * by;
    information += parts_[i].slopes * by * by.transpose();
  }
  const auto inverse = inverse_of_positive(information);
  if (!inverse) return;
  const Eigen::Matrix4d covariance = *inverse;
  const Eigen::Vector4d step = covariance * score;
  if (!covariance.allFinite() || !step.allFinite()) return;
  verdict.turn_ns = step[3];
  verdict.turn_deviations = step[3] / std::sqrt(covariance(3, 3));
  verdict.turn_travel_ns = std::abs(step[1] - first_slope * step[3]);
  // What is left of chi squared without these four, which has two for each degree of freedom as
  // its variance.
  const double degrees = lit - 4;
  if (!(degrees > 1)) return;
  verdict.swing_deviations = (squares - score.dot(step) - degrees) / std::sqrt(2 * degrees);
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

// Slopes up to the fourth power of the time, by polynomials of Legendre. A fit leaves no mean and
// no first slope of the offsets' mean; the mean of their spread is that of the pulse, which may be
// another than the configured one.
double PathCheck::left_over(double dark, double photons) const {
  constexpr std::size_t powers = 4;
  Part all;
  for (const Part& part : parts_) {
    all.slopes += part.slopes, all.curve += part.curve, all.products += part.products;
  }
  // A late photon of a pulse with a tail is far from its peak, too.
  const double of_slope = all.slopes > 0 ? all.products / all.slopes : 0;
  const double of_signal = all.curve / photons;
  std::array<double, powers> mean{}, means{}, spread{}, spreads{};
  for (std::size_t i = 0; i < parts; ++i) {
    const Part& part = parts_[i];
    const double x = (2.0 * static_cast<double>(i) + 1) / parts - 1;
    const std::array<double, powers> p = {x, (3 * x * x - 1) / 2, (5 * x * x - 3) * x / 2,
                                          ((35 * x * x - 30) * x * x + 3) / 8};
    const double signal = part.signal - dark / parts;
    const double own = part.curve - of_signal * signal - of_slope * part.slope;
    const double squares = part.curves + of_slope * (of_slope * part.slopes - 2 * part.products);
    for (std::size_t k = 0; k < powers; ++k) {
      mean[k] += part.slope * p[k], means[k] += part.slopes * p[k] * p[k];
      spread[k] += own * p[k], spreads[k] += squares * p[k] * p[k];
    }
  }
  double left = 0;
  for (std::size_t k = 0; k < powers; ++k) {
    if (k > 0 && means[k] > 0) left += mean[k] * mean[k] / means[k];
    if (spreads[k] > 0) left += spread[k] * spread[k] / spreads[k];
  }
  return left;
}

double PathCheck::deviations_beside(double pulses) const {
  if (beside_last_ns_ == 0) return 0;
  const double dark = background_per_ns_ * 2 * (beside_last_ns_ - beside_first_ns_);
  const double expected = pulses * (dark + light_beside_);
  return (beside_ - expected) / std::sqrt(std::max(expected, 1.0));
}

// A line that touches a path holds the light of the part in which the path is within some three
// pulse widths of it. The signal's mean and variance over the frame tell where that part is and how
// long, and so about how much the path bends: a part of the half-length d has the variance d^2 / 3,
// and the bend 3 widths / d^2. The deviations hold twice what such a bend moves, since the estimate
// of the bend may be half of it.
//
// A parabola that touches a path whose acceleration changes holds the light of a part in the same
// way, of which the turn is some 3 widths / d^3.
void PathCheck::bend_away(double dark, PathVerdict& verdict) const {
  const Eigen::Vector2d mean = (moments_ - Eigen::Vector2d(0, dark / 12)) / verdict.photons;
  const double variance = std::max(mean[1] - mean[0] * mean[0], 1e-6);
  const double off = std::abs(mean[0]);
  if (verdict.is_bent) {
    const double turn_ns = 6 * shape_.width_ns() / std::pow(3 * variance, 1.5);
    verdict.off_delay_ns = std::hypot(verdict.off_delay_ns, turn_ns * off * (off * off + variance));
    verdict.off_travel_ns =
        std::hypot(verdict.off_travel_ns, 3 * turn_ns * std::max(off * off, variance));
    return;
  }
  const double bend_ns = 2 * shape_.width_ns() / variance;
  verdict.off_delay_ns = std::hypot(verdict.off_delay_ns, bend_ns * off * off);
  verdict.off_travel_ns = std::hypot(verdict.off_travel_ns, 2 * bend_ns * off);
}

}  // namespace splid
