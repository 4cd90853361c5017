#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "estimator/sync/sync_fit.hpp"
#include "protocol/options.hpp"

namespace splid {

// The options of the estimator, one structure for each section of the configuration. Their
// describe() names every key with its bounds; the configuration's reader, its schema, its manual
// and its error messages come from there.

// Whether the target may move. automatic: the photons decide, frame by frame, whether it moves and
// whether it accelerates. accelerating: its velocity changes evenly over a frame.
enum class Motion { static_target, moving, automatic, accelerating };
// search: this project's own method. paper: that of [P], for comparison.
enum class Method { search, paper };
// Whether the search halves its steps where nothing significant shows: balanced does.
enum class Effort { fast, balanced };
// The detected pulse: a gaussian, or the table of a calibrated pattern.
enum class Shape { gaussian, tabulated };

const char* to_string(Effort effort);

// A frame may have so many targets.
inline constexpr std::size_t most_targets = 4;

// What the scene may hold. JSON: `scene`.
struct SceneOptions {
  Motion motion = Motion::moving;
  double max_speed_mps = 150;          // speeds up to this are searched, towards and away
  double max_acceleration_mps2 = 100;  // with motion `accelerating` and `auto`, towards and away
  double range_offset_m = 0;  // the instrument's own, which is subtracted from each distance
  std::int64_t targets = 1;   // that a frame may have, 1 to most_targets
  bool rigid = false;         // pixels that share a velocity are estimated together
  bool pool = false;          // pixels with too few photons are estimated with their neighbours
  void describe(OptionVisitor& visitor);
};

// Whether each target's returns are compared with richer models (checks/finding.hpp).
enum class FindingsWanted { on, off };

// How a frame is estimated, and when an estimate is believed. JSON: `estimator`.
struct EstimatorOptions {
  Method method = Method::search;
  Effort effort = Effort::balanced;
  FindingsWanted findings = FindingsWanted::on;
  bool tracked = false;            // a frame first looks where the last frame found its target
  double false_alarm_rate = 1e-3;  // share of the frames without a target that report one
  double range_risk = 1e-3;        // risk of a wrong range above which a frame is ambiguous
  void describe(OptionVisitor& visitor);
  // Whether the method goes with what the scene may hold.
  [[nodiscard]] std::optional<OptionFault> validate(const SceneOptions& scene) const;
};

// Whether the pulse is as wide as configured. fitted: its width is a parameter of each frame.
enum class PulseWidth { fixed, fitted };

// The shape of the detected pulse about its time. JSON: `pulse`.
struct PulseOptions {
  Shape shape = Shape::gaussian;
  double sigma_ps = 100;  // standard deviation of a gaussian
  PulseWidth width = PulseWidth::fixed;
  void describe(OptionVisitor& visitor);
  // Whether a fitted width goes with the method.
  [[nodiscard]] std::optional<OptionFault> validate(const EstimatorOptions& estimator) const;
};

// What becomes of the detector's dead time. modelled: the likelihood knows when the detector was
// dead. flagged: frames in which the dead time would bias the values are called saturated.
enum class DeadTime { modelled, flagged };

// The detector. JSON: `detector`.
struct DetectorOptions {
  double dead_time_ns = 0;  // 0: not known; it is neither modelled nor flagged
  DeadTime dead_time = DeadTime::modelled;
  // Timing walk: waits since the detection before on the same input, ns, ascending, and by how much
  // a photon after such a wait comes late, ps. See TimingWalk in daemon/stream.
  std::vector<NumberPair> walk = {};
  void describe(OptionVisitor& visitor);
  [[nodiscard]] std::optional<OptionFault> validate() const;
};

// Whose clock is taken to be right, so that delays are in its time. tagger: the clock that stamped
// the photons. pattern: the generator's clock, which plays the pattern file's period in just that
// time.
enum class ClockReference { tagger, pattern };

// How the drift of the pattern's clock is measured, and which of the two clocks distances are in.
// JSON: `drift`.
struct DriftOptions {
  DriftMethod method = DriftMethod::regression;
  ClockReference reference = ClockReference::tagger;
  void describe(OptionVisitor& visitor);
  [[nodiscard]] std::optional<OptionFault> validate() const;
};

}  // namespace splid
