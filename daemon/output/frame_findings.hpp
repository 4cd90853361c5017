#pragma once

#include <optional>
#include <string>

#include "daemon/output/path_mean.hpp"
#include "daemon/output/pulse_mean.hpp"
#include "protocol/frame_json.hpp"

namespace splid {

// What the frames of a second say together, in sentences for the status: that the photons
// contradict the pattern, the configured pulse, the path or the dead time, or that frames take
// longer to compute than they last. A finding counts from half of a second's frames on: those with
// a target, or all of them where it is one of the detector. What no single frame shows is found
// over the last frames of the stream.
//
// Threads: one. Errors: none.
class FrameFindings {
 public:
  // threads: that share the frames.
  explicit FrameFindings(double threads) : threads_(threads) {}

  // A stream begins: what the frames before it have said is forgotten.
  void begin();
  void add(const FrameMessage& message);
  // The sentences below are those of the frames since the last call from here on.
  void end_second();

  // Empty where nothing is wrong.
  [[nodiscard]] const std::string& of_frames() const { return of_frames_; }
  [[nodiscard]] const std::string& of_pattern() const { return of_pattern_; }
  [[nodiscard]] const std::string& of_cost() const { return of_cost_; }
  [[nodiscard]] const std::string& of_dead_time() const { return of_dead_time_; }

 private:
  void judge_pulses();
  void judge_paths();
  void judge_cost();

  // Frames with a member, and its value in the last of them.
  struct Seen {
    int frames = 0;
    double last = 0;
    void add(const std::optional<double>& value);
    [[nodiscard]] bool is_in_half_of(int all) const;
  };

  struct Second {
    int all_frames = 0;
    int frames = 0;  // with a target
    Seen amplitude_misfit, pulse_misfit, shape_misfit, acceleration_misfit_mps2, jerk_misfit_mps3,
        signal_gap;                               // of these
    Seen dead_time_misfit_ns, afterpulse_misfit;  // of all
    int bent_paths = 0;                           // with an acceleration
    int unsure = 0;                               // ambiguous by their photons and not by the mode
    int faults = 0;  // without a target, since the photons contradict the pattern
    PatternFault pattern_fault = PatternFault::none;  // of the last such frame
    double computed_ms = 0, lasted_ms = 0;
  };

  double threads_;
  Second second_;
  PulseMean pulse_;
  SkewMean skew_;
  PathMean path_;
  std::string of_frames_, of_pattern_, of_cost_, of_dead_time_;
};

}  // namespace splid
