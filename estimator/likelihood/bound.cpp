#include "estimator/likelihood/bound.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "estimator/likelihood/information.hpp"
#include "estimator/model/units.hpp"

namespace splid {
namespace {

using likelihood::Model;

// Of targets that move otherwise the frame is cut into so many slices.
constexpr int slices = 64;

struct Interval {
  double begin_ns, end_ns;
};

Eigen::Index place(std::size_t target, likelihood::OfTarget parameter) {
  return static_cast<Eigen::Index>(likelihood::place_of(target, parameter));
}

// The parts of a period, in emission phase, in which a pulse has light.
std::vector<Interval> lit_intervals(const PulseShape& shape, const Comb& comb,
                                    std::span<const CombLight> lights) {
  std::vector<Interval> all, lit;
  for (const CombLight& light : lights) {
    for (const double time_ns : comb.times_ns) {
      const double at = fold_on(time_ns + light.shift_ns, comb.period_ns);
      all.push_back(
          {at + shape.first_ns() / light.dilation, at + shape.last_ns() / light.dilation});
    }
  }
  std::sort(all.begin(), all.end(), [](auto& a, auto& b) { return a.begin_ns < b.begin_ns; });
  for (const Interval& one : all) {
    if (!lit.empty() && one.begin_ns <= lit.back().end_ns) {
      lit.back().end_ns = std::max(lit.back().end_ns, one.end_ns);
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

// The information that a ns of a segment of the train has about the delays, signals, background and
// width, with the targets' combs so much apart.
SmallMatrix information_per_ns(const PulseShape& shape, const Comb& comb,
                               std::span<const CombLight> lights, const Model& at,
                               double steps_a_width, const DeadDetector& detector) {
  const LiveFraction live(shape, comb, lights, at.background_per_ns, detector);
  std::vector<CombWindow> windows;
  for (const CombLight& light : lights) {
    windows.emplace_back(comb, shape.first_ns() / light.dilation, shape.last_ns() / light.dilation);
  }
  const auto size = static_cast<Eigen::Index>(likelihood::parameters_of(at.count));
  const double to_32 = 0x1p32 / comb.period_ns;
  SmallMatrix J = SmallMatrix::Zero(size, size);
  SmallVector by(size);
  double dark_ns = comb.period_ns * live.mean();
  for (const Interval& lit : lit_intervals(shape, comb, lights)) {
    const double length = lit.end_ns - lit.begin_ns;
    // The sum over the middles of the steps converges exponentially, as the integrand is smooth and
    // zero at both ends.
    const auto steps = static_cast<std::size_t>(std::max(
        16.0, std::ceil(length * lights.front().dilation / (shape.width_ns() / steps_a_width))));
    const double step = length / static_cast<double>(steps);
    for (std::size_t n = 0; n < steps; ++n) {
      const double place_ns = lit.begin_ns + (static_cast<double>(n) + 0.5) * step;
      const double seen = step * live.at(fold_on(place_ns, comb.period_ns));
      dark_ns -= seen;
      double lambda = at.background_per_ns;
      by.setZero();
      by[size - 1] = 1;
      for (std::size_t k = 0; k < lights.size(); ++k) {
        const auto& [shift_ns, S, dilation] = lights[k];
        const double phase = fold_on(place_ns - shift_ns, comb.period_ns);
        double density = 0, slope = 0, wider = 0;
        for (const auto& pulse : windows[k].candidates(
                 static_cast<std::uint32_t>(static_cast<std::uint64_t>(phase * to_32)))) {
          double offset = (phase - pulse.time_ns) * dilation;
          double h = 0, d1 = 0, d2 = 0;
          shape.evaluate({&offset, 1}, {{&h, 1}, {&d1, 1}, {&d2, 1}});
          density += pulse.amplitude * h;
          slope += pulse.amplitude * d1;
          wider -= pulse.amplitude * (h + offset * d1);
        }
        lambda += S * density;
        by[place(k, likelihood::delay)] = -S * slope * dilation;
        by[place(k, likelihood::signal)] = density;
        by[size - 2] += S * wider;
      }
      if (lambda > 0) J += seen / lambda * by * by.transpose();
    }
  }
  if (at.background_per_ns > 0) {
    J(size - 1, size - 1) += std::max(0.0, dark_ns) / at.background_per_ns;
  }
  return J / comb.period_ns;
}

// How much of the frame a segment of the train takes, with the means there of the products of the
// track's terms 1, s and P_2.
Eigen::Matrix3d terms_over(double from, double to) {
  Eigen::Matrix3d terms = Eigen::Matrix3d::Zero();
  const double third = std::sqrt(0.15) * (to - from);  // Gauss's points are exact to order 5
  for (const double off : {-third, 0.0, third}) {
    const double s = (from + to) / 2 + off;
    const Eigen::Vector3d of(1, s, DelayTrack::quadratic_at(s));
    terms += (off == 0 ? 8 : 5) * (to - from) / 18 * of * of.transpose();
  }
  return terms;
}

Eigen::Matrix3d terms_of(const PulseTrain& train, const PulseTrain::Segment& segment,
                         double length_ns) {
  if (train.single()) return terms_over(-0.5, 0.5);
  Eigen::Matrix3d terms = Eigen::Matrix3d::Zero();
  const auto turns = static_cast<std::size_t>(std::ceil(length_ns / train.period_ns));
  for (std::size_t n = 0; n < turns; ++n) {
    const double turn = static_cast<double>(n) * train.period_ns;
    terms += terms_over(std::min(1.0, (turn + segment.begin_ns) / length_ns) - 0.5,
                        std::min(1.0, (turn + segment.end_ns) / length_ns) - 0.5);
  }
  return terms;
}

// Adds the information of delays, and of what else there is, as one about all terms of the tracks.
void add(const SmallMatrix& each, const Eigen::Matrix3d& terms, std::size_t targets,
         SmallMatrix& J) {
  const auto term_of = [&](Eigen::Index i) -> Eigen::Index {
    const Eigen::Index of = i % static_cast<Eigen::Index>(likelihood::of_target);
    const bool is_rate = i >= static_cast<Eigen::Index>(likelihood::width_place(targets));
    return is_rate || of == likelihood::signal ? 0 : of;
  };
  const auto delay_of = [&](Eigen::Index i) { return i - term_of(i); };
  for (Eigen::Index i = 0; i < J.rows(); ++i) {
    for (Eigen::Index j = 0; j < J.cols(); ++j) {
      J(i, j) += each(delay_of(i), delay_of(j)) * terms(term_of(i), term_of(j));
    }
  }
}

Model model_of(std::span<const BoundScene> scenes) {
  Model model;
  model.background_per_ns = scenes.front().background_per_ns;
  for (const BoundScene& scene : scenes) {
    const double beta = scene.velocity_mps / speed_of_light_mps;
    model.add({{scene.delay_ns / (1 + beta), walk_ns_at(scene.velocity_mps, scene.length_ns)},
               scene.signal_per_pulse});
  }
  return model;
}

// tau = D (1 + beta) at mid-frame, less beta t_a at the start. At mid-frame the delay is half of
// the quadratic term below its mean, and at the start all of it above.
Bound bound_of(const SmallMatrix& C, const Model& at, std::size_t target, double length_ns) {
  const likelihood::Target& own = at.targets.at(target);
  const double g = own.track.walk_ns / length_ns;
  const double beta = g / (2 - g);
  const double per_walk = 2 / ((2 - g) * (2 - g) * length_ns);
  const Eigen::Index d = place(target, likelihood::delay);
  const auto deviation = [&](double by_delay, double by_walk, double by_quadratic) {
    const Eigen::Vector3d by(by_delay, by_walk, by_quadratic);
    return std::sqrt(by.dot(C.block(d, d, 3, 3) * by));
  };
  const Eigen::Index b = C.rows() - 1, q = place(target, likelihood::quadratic);
  Bound bound;
  bound.delay_ns = deviation(1 + beta, own.track.delay_ns * per_walk, -0.5);
  bound.delay_start_ns = deviation(1 + beta, (own.track.delay_ns - length_ns) * per_walk, 1);
  bound.velocity_mps = deviation(0, per_walk, 0) * speed_of_light_mps;
  bound.acceleration_mps2 = std::sqrt(C(q, q)) * acceleration_of(1, length_ns);
  bound.signal_per_pulse =
      std::sqrt(C(place(target, likelihood::signal), place(target, likelihood::signal)));
  bound.background_per_ns = std::sqrt(C(b, b));
  return bound;
}

}  // namespace

SmallMatrix expected_information(const PulseShape& shape, const PulseTrain& train,
                                 const Exposure& exposure, const Model& at,
                                 const DeadDetector& detector) {
  const auto size = static_cast<Eigen::Index>(likelihood::parameters_of(at.count));
  SmallMatrix J = SmallMatrix::Zero(size, size);
  const DelayTrack& first = at.targets.front().track;
  const bool is_rigid =
      std::all_of(at.targets.begin(), at.targets.begin() + at.count, [&](const auto& target) {
        return target.track.walk_ns == first.walk_ns &&
               target.track.quadratic_ns == first.quadratic_ns;
      });
  std::array<CombLight, most_targets> lights;
  const std::span all = std::span(lights).first(at.count);
  for (const PulseTrain::Segment& part : train.segments) {
    const auto information_at = [&](double share, double steps_a_width) {
      for (std::size_t k = 0; k < at.count; ++k) {
        const likelihood::Target& own = at.targets[k];
        lights[k] = {own.track.at(share) - first.at(share), own.signal_per_pulse,
                     exposure.scale / (1 - own.track.walk_ns / exposure.length_ns)};
      }
      return SmallMatrix(information_per_ns(shape, part.comb, all, at, steps_a_width, detector) *
                         exposure.seen_ns);
    };
    if (is_rigid) {
      add(information_at(0, 16), terms_of(train, part, exposure.length_ns), at.count, J);
      continue;
    }
    const double of_part = (part.end_ns - part.begin_ns) / train.period_ns;
    for (int slice = 0; slice < slices; ++slice) {
      const double from = static_cast<double>(slice) / slices - 0.5;
      add(information_at(from + 0.5 / slices, 8), of_part * terms_over(from, from + 1.0 / slices),
          at.count, J);
    }
  }
  return J;
}

std::vector<Bound> joint_bound(const Pattern& pattern, const PulseShape& shape,
                               std::span<const BoundScene> scenes) {
  const PulseTrain train(pattern);
  const BoundScene& frame = scenes.front();
  Exposure exposure;
  exposure.amplitude = train.amplitude_per_ns * frame.seen_ns;
  exposure.seen_ns = frame.seen_ns;
  exposure.length_ns = frame.length_ns;
  const Model at = model_of(scenes);
  const std::size_t terms = frame.accelerating ? 3 : frame.moving ? 2 : 1;
  likelihood::FreeSet free = likelihood::free_set(at.count, terms, frame.width_unknown);
  for (std::size_t k = 0; k < at.count && !frame.moving; ++k) {
    free.reset(likelihood::place_of(k, likelihood::walk));
  }
  const SmallMatrix J = expected_information(shape, train, exposure, at, frame.detector);
  const auto C = likelihood::covariance_of(-J, at, exposure, shape.width_ns(), free);
  const double infinite = std::numeric_limits<double>::infinity();
  std::vector<Bound> bounds(scenes.size(),
                            {infinite, infinite, infinite, infinite, infinite, infinite, infinite});
  for (std::size_t k = 0; C && k < scenes.size(); ++k) {
    bounds[k] = bound_of(*C, at, k, frame.length_ns);
    if (!frame.width_unknown) continue;
    const auto w = static_cast<Eigen::Index>(likelihood::width_place(at.count));
    bounds[k].pulse_sigma_ns = shape.width_ns() * std::sqrt((*C)(w, w));
  }
  return bounds;
}

Bound cramer_rao_bound(const Pattern& pattern, const PulseShape& shape, const BoundScene& scene) {
  return joint_bound(pattern, shape, {&scene, 1}).front();
}

}  // namespace splid
