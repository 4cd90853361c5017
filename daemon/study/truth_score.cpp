#include "daemon/study/truth_score.hpp"

#include <fmt/core.h>

#include <cmath>

#include "daemon/base/text.hpp"
#include "estimator/model/units.hpp"

namespace splid {
namespace {

// Design note: noise exceeds ten sigma once in 1e23 frames. The nearest wrong peak of a pattern
// whose pulses are 9 ns apart is 1.3 m away, which is thousands of sigma.
constexpr double wrong_peak_sigmas = 10;

bool is_beyond(double error, const std::optional<double>& sigma) {
  return sigma && std::abs(error) > wrong_peak_sigmas * *sigma;
}

std::string limit_sentence(const char* what, const std::optional<double>& value, double limit,
                           const char* unit) {
  return fmt::format("{} RMSE is {:.4g} {}, more than the {:.4g} {} allowed", what,
                     value.value_or(0), unit, limit, unit);
}

}  // namespace

std::optional<FrameError> FrameScore::take(const FrameMessage& message,
                                           const std::optional<SceneTruth::State>& state) {
  ++frames_;
  if (last_sequence_ && message.sequence > *last_sequence_ + 1) {
    lost_ += message.sequence - *last_sequence_ - 1;
  }
  last_sequence_ = message.sequence;
  if (!message.valid() || !message.distance_m || !message.velocity_mps) return std::nullopt;
  ++valid_;
  // An ambiguous frame says itself that its range may be wrong, so it is not compared. In mode
  // ambiguous every frame has this status, and then the frames are compared.
  if (message.status == FrameStatus::ambiguous && message.mode != Mode::ambiguous) {
    ++unsure_;
    return std::nullopt;
  }
  if (!state) return std::nullopt;
  ++compared_;
  FrameError error{*message.distance_m - state->distance_m,
                   *message.velocity_mps - state->velocity_mps, false};
  error.wrong_peak = is_wrong_peak(error, message);
  if (error.wrong_peak) {
    ++wrong_;
  } else {
    distance_squares_ += error.distance_m * error.distance_m;
    velocity_squares_ += error.velocity_mps * error.velocity_mps;
  }
  return error;
}

bool FrameScore::is_wrong_peak(const FrameError& error, const FrameMessage& message) const {
  if (wrong_peak_m_) return std::abs(error.distance_m) > *wrong_peak_m_;
  return is_beyond(error.distance_m, message.std_distance_m) ||
         is_beyond(error.velocity_mps, message.std_velocity_mps);
}

std::optional<FrameError> TruthScore::take(const FrameMessage& message) {
  const auto half_ps = static_cast<std::int64_t>(message.duration_ms / 2 * ps_per_ms);
  return FrameScore::take(message, truth_.at(message.start_ps + half_ps));
}

std::optional<FrameError> EncoderScore::take(const FrameMessage& message) {
  std::optional<SceneTruth::State> state;
  const auto& reference = message.reference;
  if (reference && reference->distance_m && reference->velocity_mps) {
    state = SceneTruth::State{*reference->distance_m, *reference->velocity_mps};
  }
  return FrameScore::take(message, state);
}

std::optional<double> FrameScore::rms(double sum_of_squares) const {
  if (compared_ == wrong_) return std::nullopt;
  return std::sqrt(sum_of_squares / static_cast<double>(compared_ - wrong_));
}

std::optional<double> FrameScore::distance_rmse_mm() const {
  const auto value_m = rms(distance_squares_);
  return value_m ? std::optional(*value_m * 1e3) : std::nullopt;
}

std::optional<double> FrameScore::velocity_rmse_cmps() const {
  const auto value_mps = rms(velocity_squares_);
  return value_mps ? std::optional(*value_mps * 1e2) : std::nullopt;
}

std::string FrameScore::summary() const {
  std::string text = fmt::format(
      "{} frames, {} lost, {} valid, {} compared with {}, {} wrong peaks (more than {:g} {} off)",
      grouped(frames_), grouped(lost_), grouped(valid_), grouped(compared_), against_,
      grouped(wrong_), wrong_peak_m_.value_or(wrong_peak_sigmas), wrong_peak_m_ ? "m" : "sigma");
  if (unsure_ > 0) text += "; " + grouped(unsure_) + " not sure of their range (ambiguous)";
  if (const auto rmse_mm = distance_rmse_mm())
    text += fmt::format("; distance RMSE {:.3f} mm", *rmse_mm);
  if (const auto rmse = velocity_rmse_cmps())
    text += fmt::format(", velocity RMSE {:.3f} cm/s", *rmse);
  return text;
}

std::optional<std::string> FrameScore::broken(const TruthLimits& limits) const {
  if (!limits.any()) return std::nullopt;
  if (compared_ == 0) return "no valid frame within the truth's time came";
  if (lost_ > 0) return grouped(lost_) + " frames are missing from the sequence";
  if (wrong_ > 0) return grouped(wrong_) + " frames are on a wrong peak";
  if ((valid_ - unsure_) * 10 < frames_ * 9) {
    return fmt::format("only {} of {} frames are valid and sure of their range",
                       grouped(valid_ - unsure_), grouped(frames_));
  }
  const auto rmse_mm = distance_rmse_mm();
  if (limits.max_distance_rmse_mm && !(rmse_mm <= *limits.max_distance_rmse_mm)) {
    return limit_sentence("distance", rmse_mm, *limits.max_distance_rmse_mm, "mm");
  }
  const auto rmse_cmps = velocity_rmse_cmps();
  if (limits.max_velocity_rmse_cmps && !(rmse_cmps <= *limits.max_velocity_rmse_cmps)) {
    return limit_sentence("velocity", rmse_cmps, *limits.max_velocity_rmse_cmps, "cm/s");
  }
  return std::nullopt;
}

}  // namespace splid
