#include "estimator/fit/bound.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "estimator/likelihood/small_matrix.hpp"
#include "estimator/model/units.hpp"

namespace splid {
namespace {

struct Interval {
  double begin_ns, end_ns;
};

// The parts of a period, in emission phase, in which a pulse has light. dilation: see Exposure.
std::vector<Interval> lit_intervals(const PulseShape& shape, const Comb& comb, double dilation) {
  std::vector<Interval> lit;
  for (const double time : comb.times_ns) {
    const Interval one = {time + shape.first_ns() / dilation, time + shape.last_ns() / dilation};
    if (!lit.empty() && one.begin_ns <= lit.back().end_ns) {
      lit.back().end_ns = one.end_ns;
    } else {
      lit.push_back(one);
    }
  }
  // An interval that reaches over the period's end goes on at the period's begin. Where this meets
  // the first interval, all of the period is lit.
  if (lit.back().end_ns - lit.front().begin_ns >= comb.period_ns) {
    return {{lit.front().begin_ns, lit.front().begin_ns + comb.period_ns}};
  }
  return lit;
}

// The information that a ns of a stretch of the train has, by (delay, signal, background, width). A
// gaussian's derivative by its width is the width times its second derivative by the offset.
Eigen::Matrix4d information_per_ns(const PulseShape& shape, const Comb& comb, double dilation,
                                   double S, double b, const BlindDetector& detector) {
  const AliveFraction alive(shape, comb, dilation, S, b, detector);
  const CombWindow window(comb, shape.first_ns() / dilation, shape.last_ns() / dilation);
  const double to_32 = 0x1p32 / comb.period_ns;
  Eigen::Matrix4d J = Eigen::Matrix4d::Zero();
  double dark_ns = comb.period_ns * alive.mean();
  for (const Interval& lit : lit_intervals(shape, comb, dilation)) {
    const double length = lit.end_ns - lit.begin_ns;
    // The sum over the middles of the steps converges exponentially, as the integrand is smooth and
    // zero at both ends.
    const auto steps = static_cast<std::size_t>(
        std::max(16.0, std::ceil(length * dilation / (shape.width_ns() / 16))));
    const double step = length / static_cast<double>(steps);
    for (std::size_t n = 0; n < steps; ++n) {
      double phase = lit.begin_ns + (static_cast<double>(n) + 0.5) * step;
      phase -= comb.period_ns * std::floor(phase / comb.period_ns);
      const double seen = step * alive.at(phase);
      dark_ns -= seen;
      double density = 0, slope = 0, bend = 0;
      for (const auto& pulse : window.candidates(
               static_cast<std::uint32_t>(static_cast<std::uint64_t>(phase * to_32)))) {
        double offset = (phase - pulse.time_ns) * dilation;
        double h = 0, d1 = 0, d2 = 0;
        shape.evaluate({&offset, 1}, {{&h, 1}, {&d1, 1}, {&d2, 1}});
        density += pulse.amplitude * h;
        slope += pulse.amplitude * d1;
        bend += pulse.amplitude * d2;
      }
      const double lambda = b + S * density;
      if (lambda <= 0) continue;
      const Eigen::Vector4d by(-S * slope * dilation, density, 1, S * shape.width_ns() * bend);
      J += seen / lambda * by * by.transpose();
    }
  }
  if (b > 0) J(2, 2) += std::max(0.0, dark_ns) / b;
  return J / comb.period_ns;
}

// The share of the frame that a stretch of the train takes, and the first two moments of where in
// the frame that is, from -1/2 to 1/2.
struct Moments {
  double share = 0, first = 0, second = 0, third = 0, fourth = 0;

  // Those with the bend's s^2 - 1/12: alone, times s, and squared.
  [[nodiscard]] double bend() const { return second - share / 12; }
  [[nodiscard]] double first_bend() const { return third - first / 12; }
  [[nodiscard]] double bend_squared() const { return fourth - second / 6 + share / 144; }
};

Moments moments_of(const PulseTrain& train, const PulseTrain::Stretch& stretch, double length_ns) {
  if (train.single()) return {1, 0, 1.0 / 12, 0, 1.0 / 80};
  Moments m;
  const auto turns = static_cast<std::size_t>(std::ceil(length_ns / train.period_ns));
  for (std::size_t n = 0; n < turns; ++n) {
    const double turn = static_cast<double>(n) * train.period_ns;
    const double from = std::min(1.0, (turn + stretch.begin_ns) / length_ns) - 0.5;
    const double to = std::min(1.0, (turn + stretch.end_ns) / length_ns) - 0.5;
    m.share += to - from;
    m.first += (to * to - from * from) / 2;
    m.second += (to * to * to - from * from * from) / 3;
    m.third += (std::pow(to, 4) - std::pow(from, 4)) / 4;
    m.fourth += (std::pow(to, 5) - std::pow(from, 5)) / 5;
  }
  return m;
}

using Matrix6d = Eigen::Matrix<double, 6, 6>;
// After those of ParameterIndex; see BentFit for the bend.
constexpr int bend_index = 4;
constexpr int width_index = 5;

Matrix6d information_of_all(const PulseShape& shape, const PulseTrain& train,
                            const Exposure& exposure, const FrameParameters& at,
                            const BlindDetector& detector) {
  const double one_less_g = 1 - at.line.travel_ns / exposure.length_ns;
  const double dilation = exposure.scale / one_less_g;
  Matrix6d J = Matrix6d::Zero();
  for (const PulseTrain::Stretch& part : train.stretches) {
    const Eigen::Matrix4d each = information_per_ns(shape, part.comb, dilation, at.signal_per_pulse,
                                                    at.background_per_ns, detector) *
                                 exposure.seen_ns;
    const Moments m = moments_of(train, part, exposure.length_ns);
    // A change of the travel moves a photon at position s of the frame by s times that change. Its
    // effect on the rate and on the pulse's width is 1e-6 of that, and is left out.
    Eigen::Matrix<double, 6, 4> to = Eigen::Matrix<double, 6, 4>::Zero();
    to(delay_index, 0) = to(signal_index, 1) = to(background_index, 2) = to(width_index, 3) = 1;
    J += m.share * (to * each * to.transpose());
    J(travel_index, travel_index) += m.second * each(0, 0);
    J(delay_index, travel_index) += m.first * each(0, 0);
    J(travel_index, signal_index) += m.first * each(0, 1);
    J(travel_index, background_index) += m.first * each(0, 2);
    J(travel_index, width_index) += m.first * each(0, 3);
    J(delay_index, bend_index) += m.bend() * each(0, 0);
    J(travel_index, bend_index) += m.first_bend() * each(0, 0);
    J(signal_index, bend_index) += m.bend() * each(0, 1);
    J(background_index, bend_index) += m.bend() * each(0, 2);
    J(bend_index, width_index) += m.bend() * each(0, 3);
    J(bend_index, bend_index) += m.bend_squared() * each(0, 0);
  }
  J.triangularView<Eigen::StrictlyLower>() = J.transpose();
  return J;
}

}  // namespace

Eigen::Matrix4d fisher_information(const PulseShape& shape, const PulseTrain& train,
                                   const Exposure& exposure, const FrameParameters& at,
                                   const BlindDetector& detector) {
  return information_of_all(shape, train, exposure, at, detector).topLeftCorner<4, 4>();
}

Bound cramer_rao_bound(const Pattern& pattern, const PulseShape& shape, const BoundScene& scene) {
  const PulseTrain train(pattern);
  const double beta = scene.velocity_mps / speed_of_light_mps;
  const double g = 2 * beta / (1 + beta);
  Exposure exposure;
  exposure.amplitude = train.amplitude_per_ns * scene.seen_ns;
  exposure.seen_ns = scene.seen_ns;
  exposure.length_ns = scene.length_ns;
  const FrameParameters at = {{scene.delay_ns / (1 + beta), g * scene.length_ns},
                              scene.signal_per_pulse,
                              scene.background_per_ns};
  const Matrix6d J = information_of_all(shape, train, exposure, at, scene.detector);

  // In units that make the matrix well conditioned. Parameters that are known have no row.
  const double width = shape.width_ns();
  Eigen::Vector<double, 6> unit;
  unit << width, width, at.signal_per_pulse, std::max(at.background_per_ns, 1 / scene.seen_ns),
      width, width;
  Matrix6d scaled = unit.asDiagonal() * J * unit.asDiagonal();
  const auto know = [&](int index) {
    scaled.row(index).setZero();
    scaled.col(index).setZero();
    scaled(index, index) = 1;
  };
  if (!scene.moving) know(travel_index);
  if (!scene.accelerating) know(bend_index);
  if (!scene.width_unknown) know(width_index);
  if (!(at.background_per_ns > 0)) know(background_index);
  const double infinite = std::numeric_limits<double>::infinity();
  const auto inverse = inverse_of_positive(scaled);
  if (!inverse) {
    return {infinite, infinite, infinite, infinite, infinite, infinite, infinite};
  }
  Matrix6d C = unit.asDiagonal() * *inverse * unit.asDiagonal();
  if (!scene.moving) C(travel_index, travel_index) = 0;
  if (!scene.accelerating) C(bend_index, bend_index) = 0;

  // tau = D (1 + beta) at mid-frame, less beta t_a at the start; d beta / d travel = 2 / ((2 - g)^2
  // t_a).
  const double per_travel = 2 / ((2 - g) * (2 - g) * scene.length_ns);
  // At mid-frame the delay is 1/12 of the bend below its mean, and at the start 1/6 above it.
  const auto deviation = [&](double by_delay, double by_travel, double by_bend) {
    Eigen::Vector<double, 6> by;
    by << by_delay, by_travel, 0, 0, by_bend, 0;
    return std::sqrt(by.dot(C * by));
  };
  Bound bound;
  bound.delay_ns = deviation(1 + beta, at.line.delay_ns * per_travel, -1.0 / 12);
  bound.delay_start_ns =
      deviation(1 + beta, (at.line.delay_ns - scene.length_ns) * per_travel, 1.0 / 6);
  bound.velocity_mps = deviation(0, per_travel, 0) * speed_of_light_mps;
  bound.acceleration_mps2 = std::sqrt(C(bend_index, bend_index)) * speed_of_light_mps * 1e9 /
                            (scene.length_ns * scene.length_ns);
  if (scene.width_unknown) bound.pulse_sigma_ns = std::sqrt(C(width_index, width_index));
  bound.signal_per_pulse = std::sqrt(C(signal_index, signal_index));
  if (at.background_per_ns > 0) {
    bound.background_per_ns = std::sqrt(C(background_index, background_index));
  }
  return bound;
}

}  // namespace splid
