#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "protocol/pattern.hpp"

namespace splid {

// h and its first two derivatives at n offsets; each array has n values.
struct ShapeValues {
  std::span<double> h;   // 1/ns
  std::span<double> d1;  // 1/ns^2
  std::span<double> d2;  // 1/ns^3
};

// The detected pulse: density h of a photon's arrival about its pulse's time, integral 1 ([P] Eq.
// 1).
//
// Threads: const, any. Errors: none; h is 0 and log_h -infinity outside the support of a table.
class PulseShape {
 public:
  virtual ~PulseShape() = default;
  // values.h.size() >= offsets_ns.size(), likewise d1 and d2.
  virtual void evaluate(std::span<const double> offsets_ns, const ShapeValues& values) const = 0;
  // log h, good where h itself underflows (a gaussian beyond 38 sigma).
  [[nodiscard]] virtual double log_h(double offset_ns) const = 0;
  // Beyond these offsets h is below 1e-22 of its peak (a gaussian at 10 sigma) or zero. With the
  // background free, a photon is better explained by it from about 6 sigma on.
  [[nodiscard]] virtual double first_ns() const = 0;  // < last
  [[nodiscard]] virtual double last_ns() const = 0;
  // Width that sets the steps of searches: standard deviation of a gaussian with the same peak.
  [[nodiscard]] virtual double width_ns() const = 0;
  [[nodiscard]] virtual double peak_offset_ns() const = 0;
};

// sigma_ns > 0.
std::unique_ptr<PulseShape> make_gaussian(double sigma_ns);

// Interpolates the table by a quadratic B-spline through its density, so that the derivatives that
// refinement needs are continuous. Normalised here. Errors: none for a valid table.
std::unique_ptr<PulseShape> make_tabulated(const TabulatedPulse& table);

// The three pieces of a quadratic B-spline that overlap at a place: what the coefficients before,
// at and after the nearest knot weigh there. offset: from that knot, in steps, -1/2 to 1/2.
struct SplineWeights {
  double before, at, after;  // sum 1

  explicit SplineWeights(double offset)
      : before(0.5 * (0.5 - offset) * (0.5 - offset)),
        at(0.75 - offset * offset),
        after(0.5 * (0.5 + offset) * (0.5 + offset)) {}
};

}  // namespace splid
