#pragma once

#include <cstddef>

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

// What a target's findings add to its deviations, pattern's clock. Shifts that the findings imply
// add to the variances; a larger deviation that the photons themselves show takes their place.
struct Widening {
  double off_delay_ns = 0, off_walk_ns = 0;
  double least_delay_ns = 0, least_walk_ns = 0;
  double off_signal = 0, off_background = 0;  // parts of themselves
};

// Fills the estimate with the values of one of a maximum's targets, and with their standard
// deviations if the maximum has a covariance. Delay, velocity and acceleration are those at
// mid-frame. What the syncs of the frame leave uncertain of the pattern's clock adds to the
// deviations, and so does `wider`: nothing else changes them.
//
// Threads: any. Errors: none. No allocation.
void fill_values(Estimate& estimate, const likelihood::Maximum& at, std::size_t target,
                 const Widening& wider, const FrameUnits& units, const SyncFit& sync);

}  // namespace splid
