#pragma once

namespace splid {

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
