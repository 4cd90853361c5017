#pragma once

#include <vector>

#include "estimator/calibration/fold_model.hpp"

namespace splid {

// All pulses' photons by their offset from their pulse's time, as far to either side as a pulse may
// reach.
struct StackedPhotons {
  double first_ps = 0;  // offset of value 0; value j holds offsets within half a step of its own
  double step_ps = 0;
  std::vector<double> net;       // photons less background and neighbours
  std::vector<double> variance;  // of net: the photons themselves

  [[nodiscard]] double offset_ps(std::size_t j) const {
    return first_ps + static_cast<double>(j) * step_ps;
  }
};

// Background and neighbours by the model's values. The step follows the counts N, as the error of a
// quadratic spline asks: half a width at 10^4 photons, falling as N^(-1/7), at most a half and at
// least an eighth of a width.
StackedPhotons stack_photons(FoldModel& model);

// Gives the model the shape that all its pulses have in common, by its times, counts and
// background: every pulse's photons laid upon each other, cut where no stretch stands out of the
// background by five deviations, and improved (below). Offsets are from the pulse times that the
// model has. Density in 1/ps, sum times step 1.
void stack_shape(FoldModel& model);

// Brings the model's table, where it begins and ends as it is, to the one whose spline has the
// largest likelihood (expectation maximisation; a histogram would be wider than the pulse by its
// own steps). Where photons are few, as in a tail, values are means over as many steps as agree
// with each other within noise.
void improve_shape(FoldModel& model);

// The point of a shape that is its pulse's time: the mean of t weighted with h(t)^2.
//
// Design note: for a gaussian that is its centre. A tail moves it little: one of half the photons
// and three widths' length moves the mean by 1.5 widths and this by 0.54. And it is known well: to
// 1.24 sigma / sqrt(N), where the mean of what lies above half the peak is known to 1.85.
double pulse_point_ps(const FoldModel& model);

// Standard deviation of that point by the photons' noise, ps.
double std_pulse_point_ps(FoldModel& model);

// Standard deviation of each value of the model's table by the photons' noise, 1/ps.
std::vector<double> std_density(FoldModel& model);

}  // namespace splid
