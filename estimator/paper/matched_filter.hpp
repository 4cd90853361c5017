#pragma once

#include "estimator/fold/folded_frame.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"
#include "estimator/paper/alternation.hpp"

namespace splid::paper {

// The delay with the largest sum_j log(b~ + S~ sum_p a_p h(T_j - tau - t_p)), for a target at rest,
// with S~ = 1 and b~ = 1e-3 / ns, among delays a quarter to half of a pulse width apart, or a
// 2^21th of the period where that is wider; in [0, pattern period), in the pattern's clock. The sum
// is a correlation on the circle of the period, by FFT: B log B for B delays, however many photons
// there are. train: of a random pattern, which has one segment. Source: [P] Eq. 8.
double matched_delay_ns(const FoldedFrame& frame, const PulseTrain& train, const PulseShape& shape);

// A target at rest at delay_ns, with its signal and background by counting, where it may move at up
// to max_speed_mps: within windows of t_win = 4 sigma + 4 v_max t_a / c about each pulse both,
// outside background alone. Where the windows leave less than 1 % of the time, as 40 of 100 ns do
// in 3780 ns, half of the photons count as signal; the refinement does not depend on it. Source:
// [P] Eq. 9 and 10.
PaperParameters count_signal(const FoldedFrame& frame, const PulseTrain& train, double width_ns,
                             double delay_ns, double max_speed_mps);

}  // namespace splid::paper
