#pragma once

#include "protocol/pattern.hpp"

namespace splid {

// How far two patterns have the same pulses, if each pattern is turned around its own period. The
// result is the largest share, 0 to 1, of the pulses of the pattern with more pulses that lie on a
// pulse of the other pattern at the same turn, to within window_ps in all. A calibrated pattern is
// turned against the nominal pattern by the way to the target that it was calibrated with.
//
// 0 where the periods differ by more than 100 ppm, or where the segments of several differ in
// number or in repeats; 1 where a pattern has more than 2,000 pulses and as many as the other,
// since nobody looked.
//
// Threads: any. Errors: none. Time: P Q log(P Q) for P and Q pulses.
double share_of_same_pulses(const Pattern& a, const Pattern& b, double window_ps = 600);

}  // namespace splid
