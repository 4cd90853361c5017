#pragma once

#include "estimator/model/estimate.hpp"
#include "estimator/model/frame_view.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "protocol/pattern.hpp"

namespace splid::studies {

// [P]'s initialiser for a frame of one MRR pattern period, with the robust Chinese remainder
// theorem of Wang et al. 2015 in place of the mixed-integer program: [P] Fig. 5's comparison. The
// periods are rounded to whole nanoseconds. Not refined: no refinement moves by another turn.
//
// The frame must begin with its pattern, in the pattern's own clock. Threads: any.
Estimate estimate_by_wang(const Pattern& pattern, const PulseShape& shape, const FrameView& frame,
                          double max_speed_mps);

}  // namespace splid::studies
