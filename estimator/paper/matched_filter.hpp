#pragma once

#include <complex>
#include <vector>

#include "estimator/model/pulse_shape.hpp"
#include "estimator/paper/corrected_times.hpp"
#include "estimator/paper/emission_times.hpp"

namespace splid::paper {

// Finds the delay with the largest sum_j log(b~ + S~ sum_p a_p h(T_j - tau - t_p)), S~ = 1 and
// b~ = 1e-3 / ns ([P] Eq. 8): a target at rest. Candidates are a quarter to half of a pulse width
// apart, or a 2^21th of the period if that is wider.
//
// The sum is a correlation of two functions on the circle of the pattern period, the photons and
// log(1 + S~ / b~ sum_p a_p h), and is done by FFT: B log B for B candidates, however many photons
// and pulses. Threads: const, any.
class MatchedFilter {
 public:
  MatchedFilter(const EmissionTimes& emission, const PulseShape& shape);

  // In [0, pattern period), in the pattern's clock.
  [[nodiscard]] double delay_ns(const CorrectedTimes& frame) const;

 private:
  std::vector<std::complex<double>> waves_;  // spectrum of the filter
};

// Signal and background by counting, for a target at delay_ns that may move at up to max_speed_mps:
// photons within windows of t_win = 4 sigma + 4 v_max t_a / c about each pulse are signal and
// background, those outside background alone ([P] Eq. 9, 10).
//
// Where the windows leave less than 1 % of the time (at 50 ms and 150 m/s they are 100 ns wide, 40
// of them in 3780 ns), there is nothing to count the background in, and half of the photons count
// as either: the refinement of S and b, which has a single maximum, does not depend on it.
struct Counting {
  double signal_per_pulse = 0;   // of a pulse of amplitude 1; >= 0
  double background_per_ns = 0;  // of the pattern's clock; >= 0
};
Counting count_signal(const CorrectedTimes& frame, const EmissionTimes& emission, double width_ns,
                      double delay_ns, double max_speed_mps);

}  // namespace splid::paper
