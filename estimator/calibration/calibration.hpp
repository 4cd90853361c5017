#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "estimator/calibration/fold_model.hpp"
#include "estimator/calibration/phase_histogram.hpp"
#include "protocol/pattern.hpp"

// The room calibration/ measures the pulses of a pattern in a recording of a target at rest. Open
// this file first. Its parts:
//   phase_histogram.hpp   the photons of a recording, folded on the pattern period
//   pulse_finder.hpp      where in the fold there are pulses, and how wide, when nobody knows
//   fold_model.hpp        what the fold should hold: background, and pulses of one shape, whose
//                         times and counts are fitted by maximum likelihood
//   shape_stack.hpp       the shape of all pulses together, their times given
//   calibration.hpp       both in turn, until no time moves; and how one input of a detector sees
//                         the pulses of another
//   rest_check.hpp        whether the target was at rest, and where its photons went if it was not
//   side_lobes.hpp        the delays that a pattern's photons can take for the right one

namespace splid::calibration {

struct CalibratedPulse {
  double time_ps = 0;      // in [0, period), tagger's clock, after the pattern start
  double std_time_ps = 0;  // by the photons, the syncs, and the point of the shape
  double amplitude = 0;    // relative: the mean of all pulses is 1
  double std_amplitude = 0;
};

// A pattern as a target at rest shows it. Standard deviations are those of Poisson noise.
struct Calibration {
  double period_ps = 0;  // tagger's clock
  double std_period_ps = 0;
  std::vector<CalibratedPulse> pulses;  // ascending in time
  TabulatedPulse shape;                 // density in 1/ps; its pulse_point_ps() is at 0
  std::vector<double> std_density;      // 1/ps
  double width_ps = 0;                  // of a gaussian whose peak is as high as the shape's
  std::uint64_t photons = 0;            // in the fold
  double signal_photons = 0;
  double background_per_ps = 0;  // photons of the whole fold in a ps of the pattern period
  double seconds = 0;            // of recording
  bool settled = false;  // false: the times still moved when the rounds were spent, by a small part
                         // of a width
};

// Finds pulse times, amplitudes and the shape by maximum likelihood of the folded photons: in turn
// the shape, from all pulses laid upon each other, and a fit with that shape, until no time moves
// by more than a thousandth of the width. Absent where no pulse stands out of the background.
//
// fold: that of a target at rest. width_ps: standard deviation of a detected pulse, to within a
// factor of two; see find_pulses(). Allocates; takes some seconds for folds of 10^7 bins.
std::optional<Calibration> calibrate(const PhaseHistogram& fold, double width_ps);

// The model of the fold that a calibration came from, by the calibration's values.
FoldModel model_of(const PhaseHistogram& fold, const Calibration& calibration);

// How well pulses have to be known.
struct Goal {
  double std_time_ps = 5;
  double std_amplitude = 0.02;  // of the mean pulse
};

// The factor by which the number of photons has to grow until every pulse is known so well. At 1 or
// less they are.
double photons_wanted(const Calibration& calibration, const Goal& goal);

// How the pulses of a second input of a detector lie to those of the first.
struct InputShift {
  double shift_ps = 0;  // how much later the second's pulses come; within half a period about 0
  double std_ps = 0;    // one standard deviation of the shift
  double rms_ps = 0;    // distance that is left between the pulses after the shift
};

// The shift that brings the second input's pulses onto those of the first. Absent where the inputs
// do not have the same number of pulses, or where at no shift all pulses fall on one another, to
// within a pulse width or five of their own deviations. Of shifts that are equally good,
// as an even comb has them, the smallest is taken.
std::optional<InputShift> shift_between(const Calibration& first, const Calibration& second);

}  // namespace splid::calibration
