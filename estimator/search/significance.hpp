#pragma once

namespace splid {

// The part of the plane of delay and range walk that a target is looked for in; for a target that
// may accelerate, of the space of delay, range walk and quadratic term (DelayTrack).
struct SearchVolume {
  double period_ns = 0;         // delays: all of it, it is circular
  double max_walk_ns = 0;       // range walks: -max to max; 0 for a target at rest
  double width_ns = 0;          // of the pulse
  double max_quadratic_ns = 0;  // quadratic terms: -max to max; 0 for a straight path
};

// The gain over no target, in nats, that a frame without a target exceeds somewhere in the volume
// with the probability false_alarm_rate (above 0, to 0.5).
//
// Source: sqrt(2 gain) of a known pulse at an unknown place is a smooth field of unit variance. Its
// excursions above u have the mean sum_d R_d rho_d(u) (Adler and Taylor 2007). Its gradient's
// variance is 1 / (2 width^2) in delay, a twelfth in range walk, a fifth in the quadratic term.
double significance_threshold_nats(const SearchVolume& volume, double false_alarm_rate);

}  // namespace splid
