#pragma once

#include "bench/studies/cells.hpp"
#include "estimator/fit/bound.hpp"

namespace splid::studies {

// What the photons of a cell can tell, before anything is estimated.
struct Expectation {
  double length_ns = 0;       // of the frame: whole pattern periods
  double signal_photons = 0;  // mean number a frame
  double background_photons = 0;
  double gain_nats = 0;            // mean log-likelihood of the truth over no target
  double gain_deviation_nats = 0;  // from frame to frame, one standard deviation
  double threshold_nats = 0;       // what chance alone gains in one of 1000 empty frames
  // Share of frames in which the truth gains less than that, or in which two periods' photons agree
  // better at another delay: about what the best of methods finds wrong peaks in, or nothing.
  double chance_lost = 0;
  Bound bound{};  // half-way into the unambiguous range
};

// Errors: as the pattern's maker.
Expectation expect(const Cell& cell);

// What few photons leave of the bound: RMSE over bound of somebody who knows which photons are
// signal. Their number and where in the frame they come differ from frame to frame, and so does
// what they tell, whose inverse has a larger mean than the inverse of its mean. 1 where there are
// many (500), and no figure at all where photons_decide() says no.
struct CountFloor {
  double delay = 1;
  double velocity = 1;
};
CountFloor count_floor(const Bound& bound);

// Less than one frame in 100 is lost. Where more are, errors and wrong peaks are no method's fault.
bool photons_decide(const Expectation& expectation);
// No frame in a million is lost.
bool is_easy(const Expectation& expectation);

}  // namespace splid::studies
