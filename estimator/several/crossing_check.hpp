#pragma once

#include <cstddef>
#include <optional>

#include "estimator/fold/near_set.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"
#include "estimator/several/joint_likelihood.hpp"

namespace splid {

// Tells two targets whose lines cross, or part, over the frame from one whose pulse is not what the
// configuration says. Whatever a pulse is, its light is spread alike all over the frame, and that
// of two such targets is not.
//
// Each photon has its part in the slope of the log-likelihood by the variance of one pulse on the
// mean line of the two, S h'' / (2 lambda). The correlation of these parts with the square of the
// two lines' distance at the photon's time says how surely the light parts.
//
// A path that bends or shakes, and a pulse that widens for a while, correlate with that, too. So
// the two must also explain the light: neither its mean nor its spread about them may be left with
// a slope over the frame, up to the fourth power of the time.
//
// Threads: const, any. Errors: none. No allocation.
class CrossingCheck {
 public:
  // shape, train: outlive this. false_alarm_rate: the chance, above 0, that the light of one pulse
  // is said to part.
  CrossingCheck(const PulseShape& shape, const PulseTrain& train, double false_alarm_rate)
      : shape_(shape), train_(train), false_alarm_rate_(false_alarm_rate) {}

  struct Verdict {
    double deviations = 0;   // of that correlation
    bool does_part = false;  // chance has so many deviations no more often than it may
    // What is left about the two, in squared deviations: chi squared with 7 degrees of freedom
    // where two targets have made the light.
    double left = 0;
    // The light is that of two targets which part.
    [[nodiscard]] bool are_two() const;
  };
  // How far off a target's line two of equal signals are whose light is spread as that about it is,
  // at +-(delay + travel s) at the place s in the frame; nothing where the spread is not larger at
  // the frame's ends. near: the photons about the target.
  [[nodiscard]] std::optional<DelayLine> parting_about(const NearSet& near,
                                                       const TargetParameters& target,
                                                       double background_per_ns) const;
  // near: the photons about the two targets.
  [[nodiscard]] Verdict judge(const NearSet& near, const JointParameters& at, std::size_t one,
                              std::size_t other) const;

 private:
  const PulseShape& shape_;
  const PulseTrain& train_;
  double false_alarm_rate_;
};

}  // namespace splid
