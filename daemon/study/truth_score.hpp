#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "protocol/frame_json.hpp"
#include "protocol/truth.hpp"

namespace splid {

struct FrameError {
  double distance_m = 0;    // measured less true, at mid-frame
  double velocity_mps = 0;  // measured less true, at mid-frame
  bool wrong_peak = false;  // too large for noise; see FrameScore
};

// The largest errors that a measurement may have.
struct TruthLimits {
  std::optional<double> max_distance_rmse_mm;
  std::optional<double> max_velocity_rmse_cmps;
  [[nodiscard]] bool any() const { return max_distance_rmse_mm || max_velocity_rmse_cmps; }
};

// Compares frames with the target's true state. Frames that are not valid, frames that are
// ambiguous by their range odds, and frames for which the true state is not known are counted but
// not compared. Frames on a wrong peak are counted and left out of the RMSE.
//
// Threads: one. Errors: none.
class FrameScore {
 public:
  // against: where the true state comes from, such as "the truth". wrong_peak_m: a frame whose
  // distance is further off than this is on a wrong peak; absent: a frame whose distance is off by
  // more than ten of its standard deviations is.
  FrameScore(std::string against, std::optional<double> wrong_peak_m)
      : against_(std::move(against)), wrong_peak_m_(wrong_peak_m) {}

  // state: the true one at mid-frame, where known. Returns the frame's errors, or nothing where
  // there is nothing to compare.
  std::optional<FrameError> take(const FrameMessage& message,
                                 const std::optional<SceneTruth::State>& state);

  [[nodiscard]] std::uint64_t frames() const { return frames_; }
  [[nodiscard]] std::uint64_t lost() const { return lost_; }  // gaps in the sequence
  [[nodiscard]] std::uint64_t valid() const { return valid_; }
  [[nodiscard]] std::uint64_t compared() const { return compared_; }
  [[nodiscard]] std::uint64_t wrong_peaks() const { return wrong_; }
  // RMSE of the compared frames that are on no wrong peak; absent where there are none.
  [[nodiscard]] std::optional<double> distance_rmse_mm() const;
  [[nodiscard]] std::optional<double> velocity_rmse_cmps() const;

  [[nodiscard]] std::string summary() const;

  // Absent where the measurement keeps to the limits; otherwise a sentence about the first limit
  // that is broken. With any limit given, at least one frame has to be compared, none may be lost
  // or on a wrong peak, and nine of ten have to be valid.
  [[nodiscard]] std::optional<std::string> broken(const TruthLimits& limits) const;

 private:
  [[nodiscard]] bool is_wrong_peak(const FrameError& error, const FrameMessage& message) const;
  [[nodiscard]] std::optional<double> rms(double sum_of_squares) const;

  std::string against_;
  std::optional<double> wrong_peak_m_;
  std::optional<std::uint64_t> last_sequence_;
  std::uint64_t frames_ = 0;
  std::uint64_t lost_ = 0;
  std::uint64_t valid_ = 0;
  std::uint64_t unsure_ = 0;
  std::uint64_t compared_ = 0;
  std::uint64_t wrong_ = 0;
  double distance_squares_ = 0;
  double velocity_squares_ = 0;
};

// Compares frames of a simulated scene with the scene's own truth.
class TruthScore : public FrameScore {
 public:
  explicit TruthScore(SceneTruth truth)
      : FrameScore("the truth", std::nullopt), truth_(std::move(truth)) {}

  std::optional<FrameError> take(const FrameMessage& message);

 private:
  SceneTruth truth_;
};

// Compares frames with the encoder's reference that they carry. A frame is on a wrong peak if it is
// off by more than half a metre. Ten standard deviations would not do here: they are less than the
// few millimetres by which an encoder's zero may be wrong.
class EncoderScore : public FrameScore {
 public:
  EncoderScore() : FrameScore("the encoder", 0.5) {}

  std::optional<FrameError> take(const FrameMessage& message);
};

}  // namespace splid
