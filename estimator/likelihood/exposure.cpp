#include "estimator/likelihood/exposure.hpp"

#include "estimator/fold/dead_intervals.hpp"

namespace splid {

Exposure::Exposure(const FoldedFrame& frame, const PulseTrain& train)
    : amplitude(train.amplitude_per_ns / frame.scale * frame.seen_ns),
      seen_ns(frame.seen_ns),
      length_ns(frame.length_ns),
      scale(frame.scale) {
  if (frame.dead != nullptr) seen_ns -= frame.dead->dead_ns;
}

}  // namespace splid
