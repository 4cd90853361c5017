#include "estimator/bound.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace splid {
namespace {

struct Stretch {
  double begin_ns, end_ns;
};

// The parts of a period, in emission phase, in which pulses shine.
std::vector<Stretch> lit_stretches(const PulseShape& shape, const Comb& comb, double stretch) {
  std::vector<Stretch> lit;
  for (const double time : comb.times_ns) {
    const Stretch one = {time + shape.first_ns() / stretch, time + shape.last_ns() / stretch};
    if (!lit.empty() && one.begin_ns <= lit.back().end_ns) {
      lit.back().end_ns = one.end_ns;
    } else {
      lit.push_back(one);
    }
  }
  // What reaches over the period's end is the beginning of the next one.
  if (lit.back().end_ns - lit.front().begin_ns >= comb.period_ns) {
    return {{lit.front().begin_ns, lit.front().begin_ns + comb.period_ns}};
  }
  return lit;
}

}  // namespace

Eigen::Matrix4d fisher_information(const PulseShape& shape, const Comb& comb,
                                   const Exposure& exposure, const FrameParameters& at) {
  const double one_less_g = 1 - at.line.drift_ns / exposure.length_ns;
  const double stretch = exposure.scale / one_less_g;
  const double S = at.signal_per_pulse;
  const double b = at.background_per_ns;
  // Arrivals of one emitted period take period * stretch of the tagger's time.
  const double periods = exposure.seen_ns / (comb.period_ns * stretch);
  const CombWindow window(comb, shape.first_ns() / stretch, shape.last_ns() / stretch);
  const double to_32 = 0x1p32 / comb.period_ns;

  Eigen::Matrix4d J = Eigen::Matrix4d::Zero();
  double dark_ns = comb.period_ns;
  for (const Stretch& lit : lit_stretches(shape, comb, stretch)) {
    const double length = lit.end_ns - lit.begin_ns;
    dark_ns -= length;
    // The middle of each step: exponentially exact for a smooth integrand that ends in zero.
    const auto steps = static_cast<std::size_t>(
        std::max(16.0, std::ceil(length * stretch / (shape.width_ns() / 16))));
    const double step = length / static_cast<double>(steps);
    for (std::size_t n = 0; n < steps; ++n) {
      double phase = lit.begin_ns + (static_cast<double>(n) + 0.5) * step;
      phase -= comb.period_ns * std::floor(phase / comb.period_ns);
      double density = 0, slope = 0;
      for (const auto& pulse : window.candidates(
               static_cast<std::uint32_t>(static_cast<std::uint64_t>(phase * to_32)))) {
        double offset = (phase - pulse.time_ns) * stretch;
        double h = 0, d1 = 0, d2 = 0;
        shape.evaluate({&offset, 1}, {{&h, 1}, {&d1, 1}, {&d2, 1}});
        density += pulse.amplitude * h;
        slope += pulse.amplitude * d1;
      }
      const double lambda = b + S * density;
      if (lambda <= 0) continue;
      const double weight = step * stretch * periods / lambda;
      const double d_delay = -S * slope * stretch;
      J(0, 0) += weight * d_delay * d_delay;
      J(0, 2) += weight * d_delay * density;
      J(0, 3) += weight * d_delay;
      J(2, 2) += weight * density * density;
      J(2, 3) += weight * density;
      J(3, 3) += weight;
    }
  }
  if (b > 0) J(3, 3) += std::max(0.0, dark_ns) * stretch * periods / b;
  // The drift moves a photon at position s in [-1/2, 1/2] of the frame by s: mean 0, mean square
  // 1/12. What it does to the rate and the pulse's width is 1e-6 of that and is left out.
  J(1, 1) = J(0, 0) / 12;
  J.triangularView<Eigen::StrictlyLower>() = J.transpose();
  return J;
}

}  // namespace splid
