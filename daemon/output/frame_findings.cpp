#include "daemon/output/frame_findings.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "daemon/base/text.hpp"
#include "daemon/stream/frame_message.hpp"

namespace splid {
namespace {

std::string dead_time_in_words(double blind_ns) {
  return fmt::format(
      "the detector seems blind after each detection, for {:.3g} ns as far as the photons tell, "
      "which biases the values: set detector.dead_time_ns to the dead time in its data sheet",
      blind_ns);
}

std::string afterpulses_in_words(double share) {
  return fmt::format(
      "some {:.2g} % of detections are followed by another without light (afterpulses), which the "
      "background counts and its deviation holds: set a longer dead time (hold-off) at the "
      "detector, and detector.dead_time_ns to it",
      100 * share);
}

std::string misfit_in_words(double pulse_misfit) {
  if (pulse_misfit < 0) {
    return fmt::format(
        "the detected pulse is {:.0f} % narrower than the configured pulse: set pulse.sigma_ps, or "
        "calibrate the pulse",
        -100 * pulse_misfit);
  }
  return fmt::format(
      "the detected pulse is {:.0f} % wider than the configured pulse, and the deviations are "
      "widened "
      "by that: set pulse.width fitted where the target is tilted, the beam wide or the air foggy, "
      "scene.targets 2 where a second surface may be close behind, scene.motion accelerating where "
      "the path may bend, or else calibrate the pulse",
      100 * pulse_misfit);
}

// What no single frame shows is in no frame's deviations. Light from two delays or more that makes
// the pulse wider by the ratio r has the spread sqrt(r^2 - 1) in units of the pulse's width.
std::string mean_in_words(const PulseMean& pulse) {
  const double ratio = 1 + pulse.excess();
  const std::string how_much = fmt::format(
      "over the last frames the detected pulse is {:.1f} +- {:.1f} % {} than the configured pulse, "
      "which single frames do not show",
      100 * std::abs(pulse.excess()), 100 * pulse.deviation(), ratio < 1 ? "narrower" : "wider");
  if (ratio < 1) {
    return how_much +
           ": set scene.targets 2 where another surface is some pulse widths behind the target, or "
           "else pulse.sigma_ps, or calibrate the pulse";
  }
  return fmt::format(
      "{}: where a second surface is close behind the target, distances are off by up to {:.1f} of "
      "a pulse width and their deviations do not say so; set pulse.width fitted where the target "
      "is tilted, the beam wide or the air foggy, or else calibrate the pulse",
      how_much, std::sqrt(ratio * ratio - 1));
}

constexpr const char* for_no_gaussian =
    "set pulse.width fixed and scene.targets 2 where another surface is close to the target, or "
    "calibrate the pulse and set pulse.shape tabulated where the detector's pulse has a tail";

// Two surfaces of which one is half as bright have the skewness 2 (d / s)^3, where d is how far the
// brighter one is from the mean and s the width of both together.
std::string mean_in_words(const SkewMean& skew) {
  return fmt::format(
      "over the last frames the detected pulse has a skewness of {:+.2f} +- {:.2f}, which single "
      "frames do not show: distances are off by some {:.1f} of the fitted width and their "
      "deviations do not say so; {}",
      skew.excess(), skew.deviation(), std::cbrt(std::abs(skew.excess()) / 2), for_no_gaussian);
}

// A path whose acceleration changes moves the velocity by 2.3 of its deviations for each deviation
// of that change, and one that bends and is taken as straight moves the distance by 1.1.
std::string mean_in_words(const PathMean& path) {
  const std::string how_much = fmt::format(
      "over the last frames the target's path is off the fitted one by {:.2g} times what chance "
      "makes (rms), which single frames do not show",
      path.excess());
  if (!path.is_of_bent_paths()) {
    return how_much +
           ": the target accelerates or vibrates, or the pattern's clock wanders, and distances or "
           "velocities are off by more than their deviations say; set scene.motion accelerating, "
           "or "
           "make frames shorter";
  }
  return fmt::format(
      "{}: its acceleration changes, and velocities are off by some {:.1f} of their deviations; "
      "make frames shorter",
      how_much, 2.3 * std::sqrt(std::max(0.0, path.excess() * path.excess() - 1)));
}

}  // namespace

void FrameFindings::Seen::add(const std::optional<double>& value) {
  if (!value) return;
  ++frames;
  last = *value;
}

// Chance makes one frame in a million show a finding.
bool FrameFindings::Seen::is_in_half_of(int all) const { return frames > 0 && 2 * frames >= all; }

void FrameFindings::begin() { *this = FrameFindings(threads_); }

void FrameFindings::add(const FrameMessage& message) {
  ++second_.all_frames;
  second_.frames += message.valid() ? 1 : 0;
  const bool by_mode = message.mode == Mode::ambiguous;
  second_.unsure += message.status == FrameStatus::ambiguous && !by_mode ? 1 : 0;
  second_.amplitude_misfit.add(message.amplitude_misfit);
  second_.pulse_misfit.add(message.pulse_misfit);
  second_.shape_misfit.add(message.shape_misfit);
  second_.acceleration_misfit_mps2.add(message.acceleration_misfit_mps2);
  second_.jerk_misfit_mps3.add(message.jerk_misfit_mps3);
  second_.signal_gap.add(message.signal_gap);
  second_.dead_time_misfit_ns.add(message.dead_time_misfit_ns);
  second_.afterpulse_misfit.add(message.afterpulse_misfit);
  if (message.valid()) {
    pulse_.add(message);
    skew_.add(message);
    path_.add(message);
    second_.bent_paths += message.acceleration_mps2 ? 1 : 0;
  }
  if (message.pattern_fault) {
    ++second_.faults;
    second_.pattern_fault = *message.pattern_fault;
  }
  second_.computed_ms += message.compute_ms.value_or(0);
  second_.lasted_ms += message.duration_ms;
}

void FrameFindings::end_second() {
  of_frames_.clear();
  judge_cost();
  const bool is_blind = second_.dead_time_misfit_ns.is_in_half_of(second_.all_frames);
  of_dead_time_ = is_blind ? dead_time_in_words(second_.dead_time_misfit_ns.last) : "";
  const bool is_contradicted = second_.faults > 0 && second_.faults >= second_.frames;
  of_pattern_ = !is_contradicted ? "" : is_blind ? of_dead_time_ : in_words(second_.pattern_fault);
  add_sentence(of_frames_, of_dead_time_);
  if (!is_blind) judge_pulses();
  judge_paths();
  if (second_.afterpulse_misfit.is_in_half_of(second_.all_frames)) {
    add_sentence(of_frames_, afterpulses_in_words(second_.afterpulse_misfit.last));
  }
  if (second_.unsure > 0 && 2 * second_.unsure >= second_.frames) {
    add_sentence(of_frames_,
                 fmt::format("{} of the last {} frames are ambiguous: their photons fit another "
                             "range nearly as well (range_odds_nats); more light, longer frames or "
                             "a pattern that fits itself less tell them apart (splid check says "
                             "how many signal photons this pattern takes)",
                             second_.unsure, second_.frames));
  }
  second_ = {};
}

// The light of the pulses against the configured ones. A detector that is blind for longer than is
// known hides pulses behind others, and makes each of them narrower: then nothing is wrong with the
// configured pulses.
void FrameFindings::judge_pulses() {
  if (second_.amplitude_misfit.is_in_half_of(second_.frames)) {
    add_sentence(of_frames_, "the pulses' light is " +
                                 fmt::format("{:.0f}", 100 * second_.amplitude_misfit.last) +
                                 " % (rms) off the pattern's amplitudes: calibrate the pattern");
  }
  if (second_.pulse_misfit.is_in_half_of(second_.frames)) {
    add_sentence(of_frames_, misfit_in_words(second_.pulse_misfit.last));
  } else if (second_.frames > 0 && pulse_.is_sure()) {
    add_sentence(of_frames_, mean_in_words(pulse_));
  }
  if (second_.shape_misfit.is_in_half_of(second_.frames)) {
    add_sentence(of_frames_,
                 fmt::format("the detected pulse is no gaussian, by {:.0f} % (rms), and the "
                             "deviations are widened by that: {}",
                             100 * second_.shape_misfit.last, for_no_gaussian));
  } else if (second_.frames > 0 && skew_.is_sure()) {
    add_sentence(of_frames_, mean_in_words(skew_));
  }
}

// The light against the path that was fitted.
void FrameFindings::judge_paths() {
  const bool is_bent = 2 * second_.bent_paths > second_.frames;
  const bool bends = second_.acceleration_misfit_mps2.is_in_half_of(second_.frames);
  const bool turns = second_.jerk_misfit_mps3.is_in_half_of(second_.frames);
  if (bends) {
    add_sentence(of_frames_,
                 fmt::format("the target accelerates by some {:.2g} m/s^2, and its path was taken "
                             "as straight: set scene.motion auto or accelerating, or make frames "
                             "shorter",
                             second_.acceleration_misfit_mps2.last));
  }
  if (turns) {
    add_sentence(of_frames_,
                 fmt::format("the target's acceleration changes by some {:.2g} m/s^3, which no "
                             "fitted path knows, and the deviations of the velocity are widened by "
                             "that: make frames shorter",
                             second_.jerk_misfit_mps3.last));
  }
  if (!bends && !turns && second_.frames > 0 && path_.is_sure()) {
    add_sentence(of_frames_, mean_in_words(path_));
  }
  if (second_.signal_gap.is_in_half_of(second_.frames)) {
    add_sentence(of_frames_,
                 fmt::format("the target's light is missing in {:.0f} % of a frame's time: the "
                             "target comes and goes, or its path bends away from {}",
                             100 * second_.signal_gap.last,
                             is_bent ? "one of constant acceleration, for which make frames shorter"
                                     : "a straight path, for which set scene.motion auto or "
                                       "accelerating"));
  }
}

// Frames of a live source come as fast as they last; where they take longer than that to compute,
// on all threads together, splid falls behind.
void FrameFindings::judge_cost() {
  of_cost_.clear();
  if (second_.computed_ms > second_.lasted_ms * threads_) {
    of_cost_ = fmt::format(
        "frames take {:.3g} times as long to compute as they last, on {:.0f} threads: lower "
        "estimator.effort or scene.max_speed_mps, or raise pipeline.estimation_threads",
        second_.computed_ms / second_.lasted_ms, threads_);
  }
}

}  // namespace splid
