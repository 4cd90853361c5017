#pragma once

#include <vector>

#include "estimator/calibration/fold_model.hpp"

namespace splid::calibration {

// The photons of all pulses by their offset from the time of their pulse, as far to either side as
// a pulse may reach. Value j holds the photons whose offset is within half a step of offset_ps(j).
struct StackedPhotons {
  double first_ps = 0;  // the offset of value 0
  double step_ps = 0;
  std::vector<double> net;       // photons, less background and neighbouring pulses
  std::vector<double> variance;  // of net: the number of photons before anything is taken off

  [[nodiscard]] double offset_ps(std::size_t j) const {
    return first_ps + static_cast<double>(j) * step_ps;
  }
};

// Stacks the photons of the model's fold, with background and neighbours by the model's values. The
// step is what the error of a quadratic spline asks for: half a width at 10^4 photons, falling as
// N^(-1/7); at most half a width, and at least an eighth of a width and two bins.
StackedPhotons stack_photons(FoldModel& model);

// Gives the model the shape that all its pulses have in common, by the model's times, counts and
// background. All photons are stacked; the stack is cut where no run of values stands out of the
// background by five deviations, and improved by improve_shape(). Offsets are from the model's
// times. The density is in 1/ps, and its sum times the step is 1.
void stack_shape(FoldModel& model);

// Brings the model's table, whose ends stay, to the table whose spline has the largest likelihood,
// by expectation maximisation; a plain histogram, read as a spline, would be wider than the pulse
// by its own steps.
void improve_shape(FoldModel& model);

// The point of the model's shape that is taken as the pulse's time: the mean of t weighted with
// h(t)^2. For a gaussian this is its centre, known to 1.24 sigma / sqrt(N). A tail of half the
// photons and three widths' length moves it by 0.54 widths, where it moves the mean by 1.5.
double pulse_point_ps(const FoldModel& model);

// The standard deviation of that point by the photons' noise, ps.
double std_pulse_point_ps(FoldModel& model);

// The standard deviation of each value of the model's table by the photons' noise, 1/ps.
std::vector<double> std_density(FoldModel& model);

}  // namespace splid::calibration
