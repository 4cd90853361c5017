#pragma once

#include <cstddef>

#include "estimator/checks/findings.hpp"
#include "estimator/likelihood/maximizer.hpp"
#include "estimator/model/estimate.hpp"
#include "estimator/sync/sync_fit.hpp"

namespace splid {

// What turns a model, which is in the pattern's clock, into the values of a frame.
struct FrameUnits {
  double length_ns = 0;  // of the frame, pattern's clock
  double circle_ns = 0;  // delays that are equal modulo this circle are the same, pattern's clock
  double scale = 1;      // from the pattern's clock to the clock that is taken to be right
};

// Fills the estimate with the values of one of a maximum's targets, and with their standard
// deviations if the maximum has a covariance. Delay, velocity and acceleration are those at
// mid-frame. What the syncs of the frame leave uncertain of the pattern's clock adds to the
// deviations, and so does `wider`: nothing else changes them.
void fill_values(Estimate& estimate, const likelihood::Maximum& at, std::size_t target,
                 const checks::Widening& wider, const FrameUnits& units, const SyncFit& sync);

// Fills in the pulse's width where it was fitted. width_ns: as configured.
void fill_width(Estimate& estimate, const likelihood::Maximum& at, double width_ns);

}  // namespace splid
