#pragma once

#include <cstdint>
#include <memory>

#include "estimator/fold/folded_frame.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"
#include "estimator/model/units.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid::test {

// [P]'s simulated scene: 0.5 ms, 0.018 counts a pulse, 1e-3 of background a ns, sigma 0.1 ns.
inline FrameMaker simulated_scene(const Pattern& pattern, double velocity_mps) {
  FrameMaker made;
  made.pattern = pattern;
  made.length_ms = 0.5;
  made.distance_m = 140;
  made.velocity_mps = velocity_mps;
  made.signal_per_pulse = 0.018;
  made.background_per_ns = 1e-3;
  return made;
}

// A frame as the parts of method `paper` take it.
struct PaperScene {
  FrameMaker made;
  FrameMaker::Frame frame;
  PulseTrain train;
  FoldedFrame folded;
  std::unique_ptr<PulseShape> shape;

  PaperScene(const FrameMaker& made_in, std::uint64_t seed)
      : PaperScene(made_in, made_in.make(seed)) {}
  PaperScene(const FrameMaker& made_in, const FrameMaker::Frame& frame_in)
      : made(made_in),
        frame(frame_in),
        train(made.pattern),
        folded(train, frame.photons_ps.size()),
        shape(make_gaussian(made.sigma_ns)) {
    folded.fold(frame.view(), train);
  }

  // Round trip at the frame's start, in the pattern's clock.
  [[nodiscard]] double delay_start_ns() const {
    const double length_ns = static_cast<double>(frame.end_ps - frame.start_ps) * ns_per_ps;
    const double start_m = made.distance_m - made.velocity_mps * length_ns * 1e-9 / 2;
    return 2 * start_m / speed_of_light_mps * 1e9 / folded.scale;
  }
};

}  // namespace splid::test
