#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "config/config.hpp"
#include "daemon/study/tradeoff/tradeoff_frames.hpp"
#include "daemon/study/tradeoff/tradeoff_interval.hpp"
#include "estimator/likelihood/bound.hpp"
#include "estimator/model/estimate.hpp"
#include "protocol/truth.hpp"

namespace splid::tradeoff {

// The configured shape of a detected pulse.
std::unique_ptr<PulseShape> pulse_shape(const Config& config);

// The result of a setting for one frame.
struct FrameResult {
  double compute_ms = 0;   // processor time of the estimating thread
  bool has_value = false;  // there is a value, and its range is sure
  double delay_ns = 0;     // at mid-frame, wrapped to the pattern's range
  double velocity_mps = 0;
  double signal_per_pulse = 0;
  double background_per_ns = 0;
};

// range_risk: the chance of a wrong range above which a frame counts as without a value, as in
// EstimatorOptions.
FrameResult frame_result(const Estimate& estimate, double range_risk, double compute_ms);

// What results are compared with: one state for each frame, absent where none is known.
struct Reference {
  std::vector<std::optional<TargetState>> states;
  // The variance of a state over the variance of a single result; 0 for a truth.
  double noise_share = 0;
};

Reference truth_reference(std::span<const KeptFrame> frames);

// The sizes that errors are judged by.
struct Yardstick {
  double circle_ns = 0;  // delays count modulo this time, by the pattern's clock
  double period_ps = 0;  // of the pattern, by its own clock
  double width_ns = 0;   // of the pulse
  double length_ns = 0;  // of a frame
  Bound bound;           // 0 where not known
  bool moving = true;    // velocity is estimated

  // A frame is on a wrong peak if its delay at mid-frame is off by more than five pulse widths plus
  // five bounds, or its velocity by as much over the length of the frame.
  //
  // Design note: beyond five widths of a pulse, a maximum is made of other photons. TruthScore
  // instead asks for ten of the published standard deviations. That would not do here: a fit on a
  // wrong peak states them too large, and a target that accelerates within a long frame is off by
  // more than ten of them even on the right peak.
  [[nodiscard]] double wrong_delay_ns() const { return 5 * (width_ns + bound.delay_ns); }
  [[nodiscard]] double wrong_velocity_mps() const;
};

// The bound is that at the scene's own constants if these are known, otherwise at the medians of
// the results.
Yardstick make_yardstick(const Config& config, const std::optional<SceneTruth>& constants,
                         std::span<const KeptFrame> frames, std::span<const FrameResult> results);

// The reference where no truth is known. For each frame it is the cubic through the results of the
// two neighbours on either side, with the weights (-1, 4, 4, -1) / 6. So neither the target's
// position, speed, acceleration nor jerk counts as an error. The reference's variance is 34/36 of a
// result's. It is absent beside gaps, beside frames without a value, and where the neighbours do
// not agree with one another.
Reference neighbour_reference(std::span<const KeptFrame> frames,
                              std::span<const FrameResult> results, const Yardstick& unit);

// How accurate a setting's results are. The first frame of a run is not counted in any member.
struct Accuracy {
  std::size_t frames = 0;
  std::size_t no_value = 0;     // frames without a value
  std::size_t compared = 0;     // frames with a value and a reference
  std::size_t wrong_peaks = 0;  // compared frames on a wrong peak
  // Of the compared frames on no wrong peak; absent where there are none.
  std::optional<double> delay_rmse_ns;
  std::optional<double> velocity_rmse_mps;  // absent also where velocity is not estimated
  // Of 95 %, as factors of the RMSE.
  std::optional<Interval> delay_interval;
  std::optional<Interval> velocity_interval;
};

// reference_results: the results that a neighbour_reference() was made from; not used for a truth.
// Where there are fewer results than frames, the other frames count as not measured.
Accuracy score(std::span<const KeptFrame> frames, std::span<const FrameResult> results,
               const Reference& reference, std::span<const FrameResult> reference_results,
               const Yardstick& unit);

}  // namespace splid::tradeoff
