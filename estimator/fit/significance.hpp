#pragma once

namespace splid {

// What is looked through in a frame for a target.
struct SearchVolume {
  double period_ns = 0;      // delays: all of it, it is circular
  double max_travel_ns = 0;  // travels: -max to max; 0 for a target at rest
  double width_ns = 0;       // of the pulse
};

// The log-likelihood gain over no target, in nats, that a frame without a target exceeds somewhere
// in the volume with probability false_alarm_rate (0 to 0.5).
//
// Source: sqrt(2 gain) of a known pulse at unknown place is a smooth unit-variance random field;
// the number of its excursions above u has the mean sum_d R_d rho_d(u) (Adler and Taylor 2007, the
// expected Euler characteristic), which is the probability where it is small. A gaussian matched
// filter's field has gradient variance 1 / (2 width^2) in delay and a twelfth of that in travel.
double significance_threshold_nats(const SearchVolume& volume, double false_alarm_rate);

}  // namespace splid
