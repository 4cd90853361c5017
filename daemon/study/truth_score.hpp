#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "protocol/messages.hpp"
#include "protocol/truth.hpp"

namespace splid {

struct FrameError {
  double distance_m = 0;    // measured less true, at mid-frame
  double velocity_mps = 0;  // likewise
  bool wrong_peak = false;  // see FrameScore; not noise
};

// What a measurement must keep to.
struct TruthLimits {
  std::optional<double> max_distance_rmse_mm;
  std::optional<double> max_velocity_rmse_cmps;
  [[nodiscard]] bool any() const { return max_distance_rmse_mm || max_velocity_rmse_cmps; }
};

// Compares frames with where the target was. Frames that are not valid, those that are ambiguous by
// their range odds, and those of which nobody knows where it was, are counted and not compared;
// those on a wrong peak are counted and left out of the RMSE.
//
// Threads: one. Errors: none.
class FrameScore {
 public:
  // against: who says where the target was, such as "the truth". wrong_peak_m: a distance that is
  // further off is on a wrong peak; absent: one that is more than ten standard deviations off.
  FrameScore(std::string against, std::optional<double> wrong_peak_m)
      : against_(std::move(against)), wrong_peak_m_(wrong_peak_m) {}

  // state: of the target at mid-frame, where known. Null where there is nothing to compare.
  std::optional<FrameError> take(const FrameMessage& message,
                                 const std::optional<SceneTruth::State>& state);

  [[nodiscard]] std::uint64_t frames() const { return frames_; }
  [[nodiscard]] std::uint64_t lost() const { return lost_; }  // gaps in the sequence
  [[nodiscard]] std::uint64_t valid() const { return valid_; }
  [[nodiscard]] std::uint64_t compared() const { return compared_; }
  [[nodiscard]] std::uint64_t wrong_peaks() const { return wrong_; }
  // Of the frames compared that are on no wrong peak; absent where there are none.
  [[nodiscard]] std::optional<double> distance_rmse_mm() const;
  [[nodiscard]] std::optional<double> velocity_rmse_cmps() const;

  [[nodiscard]] std::string summary() const;

  // Null where all limits hold; otherwise the first that does not, in a sentence. Besides the RMSE
  // it wants at least one frame compared, none lost, none on a wrong peak and nine of ten valid.
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

// Compares frames of a simulated scene with where its target really was.
class TruthScore : public FrameScore {
 public:
  explicit TruthScore(SceneTruth truth)
      : FrameScore("the truth", std::nullopt), truth_(std::move(truth)) {}

  std::optional<FrameError> take(const FrameMessage& message);

 private:
  SceneTruth truth_;
};

// Compares frames with the encoder's reference in them. A wrong peak is half a metre off or more:
// an encoder whose zero is some millimetres wrong is ten standard deviations off.
class EncoderScore : public FrameScore {
 public:
  EncoderScore() : FrameScore("the encoder", 0.5) {}

  std::optional<FrameError> take(const FrameMessage& message);
};

}  // namespace splid
