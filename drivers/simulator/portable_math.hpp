#pragma once

namespace splid::simulator {

// Logarithm and sine from plain IEEE additions, products and divisions, so that a seed gives the
// same stream on every machine: the last bit of the library's own depends on the processor.

// x: finite, normal, > 0. To within 2e-16 relative of the logarithm or 2e-16 absolute.
double portable_log(double x);

// Sine and cosine of an angle in turns (1 is a full circle), to within 3e-16.
double sin_turns(double turns);
double cos_turns(double turns);

}  // namespace splid::simulator
