#pragma once

namespace splid::simulator {

// Logarithm and sine from plain IEEE additions, products and divisions, so that a seed gives the
// same stream on every machine: the last bit of the library's functions depends on the processor.

// x: finite, normal, > 0. The error is at most 2e-16, relative or absolute, whichever is larger.
double portable_log(double x);

// Sine and cosine of an angle in turns (1 is a full circle), to within 3e-16.
double sin_turns(double turns);
double cos_turns(double turns);

}  // namespace splid::simulator
