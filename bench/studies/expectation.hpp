#pragma once

#include "bench/studies/cells.hpp"
#include "estimator/likelihood/bound.hpp"

namespace splid::studies {

// What the photons of a cell can tell, before anything is estimated.
struct Expectation {
  double length_ns = 0;       // of the frame (frame_length_ns)
  double signal_photons = 0;  // mean number in a frame
  double background_photons = 0;
  double gain_nats = 0;            // mean log-likelihood of the truth over no target
  double gain_deviation_nats = 0;  // from frame to frame, one standard deviation
  double threshold_nats = 0;       // what chance alone gains in one of 1000 empty frames
  // The share of frames in which the truth gains less than the threshold, or in which the photons
  // of two periods agree better at another delay. In about so many frames even the best of methods
  // finds a wrong peak, or nothing.
  double chance_lost = 0;
  Bound bound{};  // at the study's delay, or half-way into the unambiguous range
};

// Errors: as the pattern's maker.
Expectation expect(const Cell& cell);

// How close to the bound few photons can come: the RMSE over the bound for an estimator that knows
// which photons are signal. The number of signal photons and their times differ from frame to
// frame, and so does their information, and the mean of its inverse is larger than the inverse of
// its mean. The ratio is 1 where photons are many (500), and means nothing where photons_decide()
// says no.
struct CountFloor {
  double delay = 1;
  double velocity = 1;
};
CountFloor count_floor(const Bound& bound);

// Whether less than three frames in 100 are lost, as in [P] Fig. 4. Where more are lost, errors and
// wrong peaks are not the fault of a method.
bool photons_decide(const Expectation& expectation);
// Whether less than one frame in a million is lost.
bool is_easy(const Expectation& expectation);

}  // namespace splid::studies
