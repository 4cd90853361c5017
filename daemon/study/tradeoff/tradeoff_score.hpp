#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "config/config.hpp"
#include "daemon/study/tradeoff/tradeoff_frames.hpp"
#include "estimator/fit/bound.hpp"
#include "estimator/model/estimate.hpp"
#include "protocol/truth.hpp"

namespace splid {

// What a setting made of one frame.
struct FrameResult {
  double compute_ms = 0;   // its thread's processor time
  bool has_value = false;  // with a range that is sure
  double delay_ns = 0;     // at mid-frame, wrapped to the pattern's range
  double velocity_mps = 0;
  double signal_per_pulse = 0;
  double background_per_ns = 0;
};

// range_risk: chance of a wrong range above which a frame has no value; EstimatorOptions has it.
FrameResult frame_result(const Estimate& estimate, double range_risk, double compute_ms);

// What results are compared with, one state a frame; absent where nothing is known.
struct Reference {
  std::vector<std::optional<TargetState>> states;
  // Variance of a state over that of a single result: 0 for a truth.
  double noise_share = 0;
};

Reference truth_reference(std::span<const KeptFrame> frames);

// What errors are measured in.
struct Yardstick {
  double circle_ns = 0;  // delays are alike modulo this, by the pattern's clock
  double period_ps = 0;  // of the pattern, by its own clock
  double width_ns = 0;   // of the pulse
  double length_ns = 0;  // of a frame
  Bound bound;           // zero where not known
  bool moving = true;    // velocity is estimated

  // A frame is on a wrong peak if its delay at mid-frame is off by more than five pulse widths and
  // five bounds, or its velocity by as much over the length of the frame.
  //
  // Design note: five widths are the reach of a pulse, beyond which a maximum is made of other
  // photons. TruthScore asks for ten published deviations instead, which a fit on a wrong peak
  // states too large, and which a target that accelerates within long frames passes on the right
  // one.
  [[nodiscard]] double wrong_delay_ns() const { return 5 * (width_ns + bound.delay_ns); }
  [[nodiscard]] double wrong_velocity_mps() const;
};

// The bound at the scene's own constants if those are known, otherwise at the medians of the
// results.
Yardstick make_yardstick(const Config& config, const std::optional<SceneTruth>& constants,
                         std::span<const KeptFrame> frames, std::span<const FrameResult> results);

// Without a truth: for each frame the cubic through the results of its two neighbours on either
// side, (-1, 4, 4, -1) / 6 of them, so that neither position, speed, acceleration nor jerk of the
// target counts as an error; its own variance is 34/36 of a result's. Absent beside gaps, frames
// without a value and neighbours that do not agree with one another.
Reference neighbour_reference(std::span<const KeptFrame> frames,
                              std::span<const FrameResult> results, const Yardstick& unit);

// What a setting's results are worth. The first frame of a run is in none of these.
struct Accuracy {
  std::size_t frames = 0;
  std::size_t no_value = 0;     // of those
  std::size_t compared = 0;     // with a value and a reference
  std::size_t wrong_peaks = 0;  // of those compared
  // Of those compared that are on no wrong peak; absent where there are none.
  std::optional<double> delay_rmse_ns;
  std::optional<double> velocity_rmse_mps;  // absent too where velocity is not estimated
};

// reference_results: those that a neighbour_reference() was made of; any for a truth. Where there
// are fewer results than frames, the rest counts as not measured.
Accuracy score(std::span<const KeptFrame> frames, std::span<const FrameResult> results,
               const Reference& reference, std::span<const FrameResult> reference_results,
               const Yardstick& unit);

}  // namespace splid
