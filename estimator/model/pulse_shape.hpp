#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "estimator/model/options.hpp"
#include "protocol/pattern.hpp"

namespace splid {

// Where h and its first two derivatives at n offsets go; each array has n values.
struct ShapeValues {
  std::span<double> h;   // 1/ns
  std::span<double> d1;  // 1/ns^2
  std::span<double> d2;  // 1/ns^3
};

// From so many widths on the background explains a photon better than a gaussian pulse does.
inline constexpr double pulse_reach_widths = 6;
// To either side of the peak: 95 % of a gaussian pulse, and not much background.
inline constexpr double half_pulse_widths = 2;

// The detected pulse: the density h of a photon's arrival about its pulse's time, of integral 1
// ([P] Eq. 1).
//
// Errors: none; h is 0 and log_h -infinity outside the support of a table.
class PulseShape {
 public:
  virtual ~PulseShape() = default;
  // Each array of values must be at least as long as offsets_ns.
  virtual void evaluate(std::span<const double> offsets_ns, const ShapeValues& values) const = 0;
  // Writes the integral of h from far before up to each offset, in [0, 1]. integrals: at least as
  // long as offsets_ns.
  virtual void integrate(std::span<const double> offsets_ns, std::span<double> integrals) const = 0;
  // The logarithm of h; it holds where h itself underflows (a gaussian beyond 38 sigma), too.
  [[nodiscard]] virtual double log_h(double offset_ns) const = 0;
  // Outside [first_ns, last_ns] h is zero, or below 1e-22 of its peak (a gaussian at 10 sigma).
  [[nodiscard]] virtual double first_ns() const = 0;  // < last
  [[nodiscard]] virtual double last_ns() const = 0;
  // The width that sets the steps of searches: the standard deviation of a gaussian whose peak is
  // as high.
  [[nodiscard]] virtual double width_ns() const = 0;
  // Where the peak is, from the pulse's time.
  [[nodiscard]] virtual double peak_offset_ns() const = 0;
};

// sigma_ns > 0.
std::unique_ptr<PulseShape> make_gaussian(double sigma_ns);

// A shape that interpolates the table by a quadratic B-spline, so that h' is continuous, as the
// likelihood needs. The table is scaled to an integral of 1. Errors: none for a valid table.
std::unique_ptr<PulseShape> make_tabulated(const TabulatedPulse& table);

// The detected pulse that the configuration asks for. Errors: Error(Fault::usage) where it asks for
// the table of a pattern that has none.
std::unique_ptr<PulseShape> configured_pulse(const Pattern& pattern, const PulseOptions& options);

// The weights of a quadratic B-spline's coefficients at a place: of the coefficient at the nearest
// knot, and of those before and after it. offset: of the place from that knot, in steps, -1/2 to
// 1/2.
struct SplineWeights {
  double before, at, after;  // sum 1

  explicit SplineWeights(double offset)
      : before(0.5 * (0.5 - offset) * (0.5 - offset)),
        at(0.75 - offset * offset),
        after(0.5 * (0.5 + offset) * (0.5 + offset)) {}
};

}  // namespace splid
