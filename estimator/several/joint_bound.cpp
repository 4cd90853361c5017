#include "estimator/several/joint_bound.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/likelihood/small_matrix.hpp"
#include "estimator/model/units.hpp"

namespace splid {
namespace {

constexpr int slices = 64;
constexpr double steps_a_width = 8;

// The targets' light over one period of a comb, on a grid of phases.
struct Light {
  std::size_t steps;
  double step_ns;
  std::array<std::vector<double>, most_targets> density, slope;

  Light(const Comb& comb, double width_ns, std::size_t count)
      : steps(static_cast<std::size_t>(std::ceil(comb.period_ns * steps_a_width / width_ns))),
        step_ns(comb.period_ns / static_cast<double>(steps)) {
    for (std::size_t k = 0; k < count; ++k) {
      density.at(k).resize(steps);
      slope.at(k).resize(steps);
    }
  }

  [[nodiscard]] bool is_dark(std::size_t step, std::size_t targets) const {
    for (std::size_t k = 0; k < targets; ++k) {
      if (density.at(k)[step] != 0 || slope.at(k)[step] != 0) return false;
    }
    return true;
  }
  // Adds a target's comb, moved by shift_ns.
  void put(std::size_t target, const PulseShape& shape, const Comb& comb, double shift_ns,
           double dilation) {
    std::vector<double>& h = density.at(target);
    std::vector<double>& d = slope.at(target);
    std::fill(h.begin(), h.end(), 0.0);
    std::fill(d.begin(), d.end(), 0.0);
    const auto all = static_cast<std::int64_t>(steps);
    for (std::size_t p = 0; p < comb.times_ns.size(); ++p) {
      const double at = comb.times_ns[p] + shift_ns;
      const auto first = std::llround((at + shape.first_ns() / dilation) / step_ns);
      const auto last = std::llround((at + shape.last_ns() / dilation) / step_ns);
      for (std::int64_t n = first; n <= last; ++n) {
        double offset = ((static_cast<double>(n) + 0.5) * step_ns - at) * dilation;
        double value = 0, d1 = 0, d2 = 0;
        shape.evaluate({&offset, 1}, {{&value, 1}, {&d1, 1}, {&d2, 1}});
        const auto cell = static_cast<std::size_t>(((n % all) + all) % all);
        h[cell] += comb.amplitudes[p] * value;
        d[cell] += comb.amplitudes[p] * d1;
      }
    }
  }
};

// The information of a ns of a comb at the place s in the frame, from -1/2 to 1/2.
SmallMatrix information_per_ns(const Light& light, double s, const JointParameters& at,
                               double dilation) {
  const auto size = static_cast<Eigen::Index>(at.size());
  SmallMatrix J = SmallMatrix::Zero(size, size);
  SmallVector by(size);
  std::size_t dark = 0;  // steps without any target's light, which tell of the background alone
  for (std::size_t n = 0; n < light.steps; ++n) {
    if (light.is_dark(n, at.count)) {
      ++dark;
      continue;
    }
    double lambda = at.background_per_ns;
    by.setZero();
    for (std::size_t k = 0; k < at.count; ++k) {
      const double S = at.targets.at(k).signal_per_pulse;
      const double to_delay = -S * light.slope.at(k)[n] * dilation;
      lambda += S * light.density.at(k)[n];
      by.segment<3>(static_cast<Eigen::Index>(3 * k)) << to_delay, to_delay * s,
          light.density.at(k)[n];
    }
    by[size - 1] = 1;
    if (lambda > 0) J += by * by.transpose() / lambda;
  }
  if (at.background_per_ns > 0) {
    J(size - 1, size - 1) += static_cast<double>(dark) / at.background_per_ns;
  }
  return J / static_cast<double>(light.steps);
}

}  // namespace

SmallMatrix joint_information(const PulseShape& shape, const PulseTrain& train,
                              const Exposure& exposure, const JointParameters& at) {
  const auto size = static_cast<Eigen::Index>(at.size());
  SmallMatrix J = SmallMatrix::Zero(size, size);
  for (const PulseTrain::Stretch& stretch : train.stretches) {
    const Comb& comb = stretch.comb;
    const double share = (stretch.end_ns - stretch.begin_ns) / train.period_ns;
    Light light(comb, shape.width_ns(), at.count);
    for (int slice = 0; slice < slices; ++slice) {
      const double s = (slice + 0.5) / slices - 0.5;
      for (std::size_t k = 0; k < at.count; ++k) {
        const DelayLine& line = at.targets.at(k).line;
        light.put(k, shape, comb, line.delay_ns + line.travel_ns * s, exposure.scale);
      }
      J += information_per_ns(light, s, at, exposure.scale) * (share * exposure.seen_ns / slices);
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
  JointParameters at;
  at.background_per_ns = frame.background_per_ns;
  SmallVector units(static_cast<Eigen::Index>(3 * scenes.size() + 1));
  for (const BoundScene& scene : scenes) {
    const double beta = scene.velocity_mps / speed_of_light_mps;
    units.segment<3>(static_cast<Eigen::Index>(3 * at.count)) << shape.width_ns(), shape.width_ns(),
        scene.signal_per_pulse;
    at.add({{scene.delay_ns / (1 + beta), 2 * beta / (1 + beta) * scene.length_ns},
            scene.signal_per_pulse});
  }
  units[units.size() - 1] = std::max(at.background_per_ns, 1 / frame.seen_ns);
  SmallMatrix J =
      units.asDiagonal() * joint_information(shape, train, exposure, at) * units.asDiagonal();
  const auto know = [&](Eigen::Index i) {
    J.row(i).setZero();
    J.col(i).setZero();
    J(i, i) = 1;
  };
  if (!(at.background_per_ns > 0)) know(J.rows() - 1);
  for (std::size_t k = 0; k < at.count; ++k) {
    if (!frame.moving) know(static_cast<Eigen::Index>(3 * k + 1));
  }
  const auto inverse = inverse_of_positive(J);
  const double infinite = std::numeric_limits<double>::infinity();
  if (!inverse) {
    const Bound none = {infinite, infinite, infinite, infinite, infinite, infinite};
    return std::vector<Bound>(scenes.size(), none);
  }
  const SmallMatrix C = units.asDiagonal() * *inverse * units.asDiagonal();
  std::vector<Bound> bounds(scenes.size());
  for (std::size_t k = 0; k < scenes.size(); ++k) {
    // tau = D (1 + beta); d beta / d travel = 2 / ((2 - g)^2 t_a), with g = 2 beta / (1 + beta).
    const double beta = scenes[k].velocity_mps / speed_of_light_mps;
    const double per_travel = (1 + beta) * (1 + beta) / 2 / frame.length_ns;
    const auto d = static_cast<Eigen::Index>(3 * k);
    const auto deviation = [&](double by_delay, double by_travel) {
      return std::sqrt(by_delay * by_delay * C(d, d) + 2 * by_delay * by_travel * C(d, d + 1) +
                       by_travel * by_travel * C(d + 1, d + 1));
    };
    const double delay_ns = at.targets.at(k).line.delay_ns;
    bounds[k].delay_ns = deviation(1 + beta, frame.moving ? delay_ns * per_travel : 0);
    bounds[k].delay_start_ns =
        deviation(1 + beta, frame.moving ? (delay_ns - frame.length_ns) * per_travel : 0);
    bounds[k].velocity_mps = frame.moving ? deviation(0, per_travel) * speed_of_light_mps : 0;
    bounds[k].signal_per_pulse = std::sqrt(C(d + 2, d + 2));
    if (at.background_per_ns > 0) {
      bounds[k].background_per_ns = std::sqrt(C(C.rows() - 1, C.rows() - 1));
    }
  }
  return bounds;
}

}  // namespace splid
