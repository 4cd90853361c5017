#pragma once

#include <cstddef>

#include "estimator/fold/near_set.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"
#include "estimator/several/joint_likelihood.hpp"

namespace splid {

// Tells a target that moves through the light beside another one from any light that stays there.
// Whatever a pulse is, its light lies alike about its line all over the frame.
//
// The photons' intensity with the target, where its line has it, is set against that with the same
// light spread over all the places beside the other line where the target has been. Were the light
// one that stays, then at each offset from the other line the mean over the frame of the ratio of
// the two would be 1, whatever the shape of the light; so the product of the ratios over the
// photons exceeds e^n by chance no more often than in one of e^n frames (Ville's inequality), if
// the target's line has not been chosen by the same photons.
//
// A path that bends or shakes, and a pulse that widens for a while, do not stay either. So the
// targets must also explain the light, as in CrossingCheck.
//
// Threads: const, any. Errors: none. No allocation.
class MovingLight {
 public:
  // shape, train: outlive this.
  MovingLight(const PulseShape& shape, const PulseTrain& train) : shape_(shape), train_(train) {}

  struct Verdict {
    double nats = 0;  // by which the light is likelier to move with the target than to stay
    double left = 0;  // about all targets, see CrossingCheck::Verdict
    [[nodiscard]] bool does_move(double least_nats) const;
  };
  // near: the photons about the target, which is up to 8 pulse widths from the other one at
  // mid-frame; their lines part by 1 to 12 over the frame. Nothing is said elsewhere.
  [[nodiscard]] Verdict judge(const NearSet& near, const JointParameters& at, std::size_t target,
                              std::size_t other) const;

 private:
  const PulseShape& shape_;
  const PulseTrain& train_;
};

}  // namespace splid
