#include "daemon/output/last_second.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "daemon/base/text.hpp"
#include "daemon/stream/frame_message.hpp"

namespace splid {
namespace {

constexpr const char* no_signal = "no_signal";

std::string measurement_of(const FrameMessage& message) {
  if (const auto* pattern = pattern_finding(message)) return pattern->name;
  const bool is_dark = message.photons && *message.photons == 0;
  if (message.status == FrameStatus::no_target && is_dark) return no_signal;
  return to_string(message.status);
}

}  // namespace

void LastSecond::add(const FrameMessage& message, const Findings& recent) {
  ++now_.frames;
  now_.valid += message.valid() ? 1 : 0;
  const bool by_mode = message.mode == Mode::ambiguous;
  now_.unsure += message.status == FrameStatus::ambiguous && !by_mode ? 1 : 0;
  ++now_.measurements[measurement_of(message)];
  for (const FrameMessage::Finding& finding : message.findings) {
    Seen& seen = now_.findings[finding.name];
    ++seen.frames;
    seen.valid += message.valid() ? 1 : 0;
    seen.last = finding;
  }
  if (!recent.empty()) now_.recent = recent;
  if (const auto* pattern = pattern_finding(message)) now_.pattern_name = pattern->name;
  now_.computed_ms += message.compute_ms.value_or(0);
  now_.lasted_ms += message.duration_ms;
}

void LastSecond::end() {
  judge_measurement();
  judge_findings();
  explain();
  was_empty_ = now_.frames == 0;
  now_ = {};
}

void LastSecond::look() {
  if (!was_empty_ || now_.frames == 0) return;
  judge_measurement();
  explain();
}

void LastSecond::judge_measurement() {
  auto frames_of = now_.measurements;
  const std::string ok = to_string(FrameStatus::ok);
  if (2 * frames_of[ok] <= now_.frames && frames_of.size() > 1) frames_of.erase(ok);
  const auto most = std::max_element(frames_of.begin(), frames_of.end(),
                                     [](auto& a, auto& b) { return a.second < b.second; });
  measurement_ = now_.frames == 0 ? none : most->first;
  contradicts_pattern_ = now_.frames > 0 && measurement_ == now_.pattern_name;
}

void LastSecond::judge_findings() {
  findings_.clear();
  for (const auto& [name, seen] : now_.findings) {
    const bool stands =
        seen.valid > 0 ? 2 * seen.valid >= now_.valid : 2 * seen.frames >= now_.frames;
    if (stands || (contradicts_pattern_ && name == now_.pattern_name)) {
      findings_.push_back(seen.last);
    }
  }
  for (const FrameMessage::Finding& finding : now_.recent) {
    const bool is_there = std::any_of(findings_.begin(), findings_.end(),
                                      [&](const auto& f) { return f.name == finding.name; });
    if (!is_there) findings_.push_back(finding);
  }
  std::stable_sort(findings_.begin(), findings_.end(),
                   [](const auto& a, const auto& b) { return a.gain_nats > b.gain_nats; });
}

std::string LastSecond::why_ambiguous() const {
  if (2 * now_.unsure < now_.measurements.at(measurement_)) {
    return "the pattern's mode is ambiguous: distances repeat with its period; a pattern of mode "
           "interleaved, random or mrr tells the range";
  }
  return fmt::format(
      "{} of the last {} frames are ambiguous: their photons fit another range nearly as well "
      "(range_odds_nats); more light, longer frames or a pattern with lower side lobes tell them "
      "apart (splid check says how many signal photons this pattern takes)",
      now_.unsure, now_.valid);
}

void LastSecond::explain() {
  why_.clear();
  of_cost_.clear();
  if (contradicts_pattern_) {
    why_ = "the photons contradict the pattern: " + now_.findings[now_.pattern_name].last.advice;
  } else if (measurement_ == none) {
    why_ = no_frame;
  } else if (measurement_ == to_string(FrameStatus::ambiguous)) {
    why_ = why_ambiguous();
  } else if (measurement_ == no_signal) {
    why_ = "the last frames have no photon: look at channels.photon and at the detector";
  } else if (measurement_ == to_string(FrameStatus::no_target)) {
    why_ =
        "the last frames show no target: look at the alignment, at scene.max_speed_mps and at "
        "pattern.file";
  }
  if (now_.computed_ms > now_.lasted_ms * threads_) {
    of_cost_ = fmt::format(
        "frames take {:.3g} times as long to compute as they last, on {:.0f} threads: lower "
        "estimator.effort or scene.max_speed_mps, or raise pipeline.estimation_threads",
        now_.computed_ms / now_.lasted_ms, threads_);
  }
}

}  // namespace splid
