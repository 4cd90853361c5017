#pragma once

#include "estimator/fit/refinement.hpp"
#include "estimator/model/estimate.hpp"
#include "estimator/sync/sync_fit.hpp"

namespace splid {

// What turns a fit, which is in the pattern's clock, into the values of a frame.
struct FrameUnits {
  double length_ns = 0;  // of the frame, pattern's clock
  double circle_ns = 0;  // delays that are equal modulo this circle are the same, pattern's clock
  double scale = 1;      // from the pattern's clock to the clock that is taken to be right
};

// Fills the estimate with the delay, velocity, signal and background of a fit, and with their
// standard deviations if the fit has a covariance.
//
// sync: of the frame; what the syncs leave uncertain of the pattern's clock adds to the deviations.
// bend_ns: how far the path bends over the frame; 0 for a straight path.
//
// Threads: any. Errors: none. No allocation.
void fill_values(Estimate& estimate, const Fit& fit, const FrameUnits& units, const SyncFit& sync,
                 double bend_ns);

}  // namespace splid
