#pragma once

#include "estimator/fold/folded_frame.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid {

// How much of the pattern and of the time a frame saw. The integral of the intensity over the frame
// is S * (amplitude * (1 - g) - B) + b * seen_ns, where B is the light that came while the detector
// was dead, or 0 where that is not modelled.
//
// Design note: the pulses in a loss are counted by their mean rate. This is wrong by two pulses at
// most, where a loss starts or ends within a period, of 529,000 pulses in a frame of 50 ms.
struct Exposure {
  double amplitude = 0;  // sum of a_p over the pulses that are seen of a target at rest
  double seen_ns = 0;    // t_a less losses, less the frame's dead time; tagger's clock
  double length_ns = 0;  // t_a, pattern's clock
  double scale = 1;      // tagger's clock over pattern's clock

  Exposure() = default;
  Exposure(const FoldedFrame& frame, const PulseTrain& train)
      : amplitude(train.amplitude_per_ns / frame.scale * frame.seen_ns),
        seen_ns(frame.seen_ns - frame.dead_ns()),
        length_ns(frame.length_ns),
        scale(frame.scale) {}
};

}  // namespace splid
