#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <vector>

#include "estimator/fold/dead_intervals.hpp"
#include "estimator/fold/folded_frame.hpp"
#include "estimator/likelihood/model.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid::test {

// A frame of a few targets, folded, with a model that is near the truth and not at it.
struct ModelScene {
  FrameMaker made;
  FrameMaker::Frame frame;
  PulseTrain train;
  FoldedFrame folded;
  DeadIntervals dead;
  std::unique_ptr<PulseShape> shape;
  likelihood::Model model;

  explicit ModelScene(const FrameMaker& maker, const std::vector<FrameMaker>& others = {},
                      std::unique_ptr<PulseShape> pulse = make_gaussian(0.1),
                      const std::vector<Loss>& losses = {})
      : made(maker),
        frame(seen(others.empty() ? made.make(5) : made.make_with(others, 5), losses)),
        train(made.pattern),
        folded(train, frame.photons_ps.size(), 3),
        dead(train, std::max(made.dead_time_ns, 1.0), static_cast<std::size_t>(made.inputs),
             frame.photons_ps.size(), 3),
        shape(std::move(pulse)) {
    folded.fold(frame.view(), train);
    if (made.dead_time_ns > 0) {
      dead.find(frame.view(), train);
      folded.dead = &dead;
    }
    add(made);
    for (const FrameMaker& other : others) add(other);
    model.background_per_ns = made.background_per_ns * 1.1;
  }
  // Of this scene's pattern, with so many photons a pulse that a test has enough of them in 0.5 ms.
  static FrameMaker maker(Pattern pattern) {
    FrameMaker of;
    of.pattern = std::move(pattern);
    of.length_ms = 0.5;
    of.velocity_mps = 31;
    of.signal_per_pulse = 0.05;
    of.background_per_ns = 1e-3;
    return of;
  }
  [[nodiscard]] DelayTrack track_of(const FrameMaker& target) const {
    const double beta = target.velocity_mps / 299792458.0;
    const double per_frame_ns = folded.length_ns * 1e-9;
    return {2 * target.distance_m / 0.299792458 / (1 + beta) / folded.scale,
            2 * beta / (1 + beta) * folded.length_ns,
            target.acceleration_mps2 * per_frame_ns * per_frame_ns / 0.299792458 / 6};
  }

 private:
  // A frame without what comes in its losses; detectors share the light evenly.
  static FrameMaker::Frame seen(FrameMaker::Frame frame, const std::vector<Loss>& losses) {
    frame.losses = losses;
    frame.photons_of_input.clear();
    std::erase_if(frame.photons_ps, [&](std::int64_t t) {
      return std::any_of(losses.begin(), losses.end(),
                         [&](const Loss& loss) { return t >= loss.begin_ps && t < loss.end_ps; });
    });
    return frame;
  }
  void add(const FrameMaker& target) {
    DelayTrack track = track_of(target);
    track.delay_ns += 0.03;
    track.walk_ns -= 0.02;
    track.quadratic_ns += 0.01;
    model.add({track, target.signal_per_pulse * 0.9});
  }
};

}  // namespace splid::test
