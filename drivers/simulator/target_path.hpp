#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/simulator/motion_state.hpp"
#include "drivers/simulator/room.hpp"
#include "protocol/options.hpp"

namespace splid::simulator {

enum class MotionKind { linear, sinusoid, points };

// How the target moves. JSON: `source`/`target`.
//
// Design note: the default is a card that is carried to and fro at up to 1.26 m/s. An estimator
// that takes the velocity of a 50 ms frame as constant is off at mid-frame by a t^2 / 24, and the
// largest acceleration here, 0.39 m/s^2, makes that 0.04 mm, a fifteenth of the bound on its own
// error
// ([P]'s set-up: 0.62 mm).
struct TargetOptions {
  struct Point {
    double time_s = 0;
    double distance_m = 0;
  };

  MotionKind motion = MotionKind::sinusoid;
  double distance_m = 284.5;  // at the start (linear), mean (sinusoid)
  double velocity_mps = 0;    // linear
  double amplitude_m = 4;     // sinusoid
  double period_s = 20;       // sinusoid
  double phase_turns = 0;     // sinusoid: 0 starts at the mean, going away
  std::vector<Point> points;  // straight lines between them, forwards, backwards, and so on
  double depth_m = 0;         // the light comes from distance_m to depth_m behind it: evenly, or
  double edge_period_s = 0;   // where this is above 0, from the two ends of the depth alone
  std::optional<RoomSight> room = std::nullopt;  // in the place of the motion; no key

  void describe(OptionVisitor& visitor);
  [[nodiscard]] std::optional<OptionFault> validate() const;
};

// The largest speed along the line of sight that a scene may have. Up to this speed the solution
// for the meeting point gains four digits a step.
inline constexpr double max_speed_mps = 30'000;
inline constexpr double max_distance_m = 1e9;

// A target's path for all times of the tagger's clock. Negative times are before the stream's
// start: light that met the target then comes in after the start.
//
// Threads: any. Errors: none. No allocation after construction.
class TargetPath {
 public:
  // options: valid. clock_rate: the seconds that the tagger counts in a true second.
  explicit TargetPath(TargetOptions options, double clock_rate = 1);
  // tagger_s: in the tagger's clock. The state is in true metres and seconds.
  [[nodiscard]] MotionState at(double tagger_s) const;
  [[nodiscard]] double clock_rate() const { return clock_rate_; }
  [[nodiscard]] double depth_m() const { return options_.depth_m; }
  // How far behind the target's distance a photon is sent back that comes in at tagger_s. chance:
  // uniform in (0, 1).
  [[nodiscard]] double behind_m(double tagger_s, double chance) const;

 private:
  [[nodiscard]] MotionState on_sinusoid(double time_s) const;
  [[nodiscard]] MotionState between_points(double time_s) const;

  TargetOptions options_;
  double clock_rate_;
};

}  // namespace splid::simulator
