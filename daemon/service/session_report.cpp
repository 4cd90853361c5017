#include "daemon/service/session_report.hpp"

#include <fmt/core.h>

#include <cstddef>

#include "daemon/base/log.hpp"
#include "daemon/base/text.hpp"
#include "daemon/stream/frame_message.hpp"
#include "daemon/stream/frame_plan.hpp"
#include "protocol/error.hpp"

namespace splid {

std::string in_words(const FrameMessage& message) {
  std::string text =
      fmt::format("frame {}, {}", grouped(message.sequence), to_string(message.status));
  if (message.distance_m) text += fmt::format(", {:.4f} m", *message.distance_m);
  if (message.velocity_mps) text += fmt::format(", {:+.3f} m/s", *message.velocity_mps);
  return text;
}

std::string in_words(const StreamSummary& summary) {
  std::string text = grouped(summary.frames) + " frames";
  const char* separator = ": ";
  for (std::size_t i = 0; i < summary.frames_by_status.size(); ++i) {
    if (summary.frames_by_status[i] == 0) continue;
    text += separator + grouped(summary.frames_by_status[i]) + " " +
            to_string(static_cast<FrameStatus>(i));
    separator = ", ";
  }
  const FramerTotals& tags = summary.tags;
  text += "; " + grouped(tags.events) + " tags: " + grouped(tags.photons) + " photons, " +
          grouped(tags.syncs) + " syncs, " + grouped(tags.ignored) + " on channels not used; " +
          grouped(summary.lost_tags + summary.discarded_tags) + " lost";
  if (tags.outside > 0) text += ", " + grouped(tags.outside) + " outside the scan's dwells";
  if (tags.uncounted > 0) {
    text += ", and nobody knows how many in " + grouped(tags.uncounted) +
            (tags.uncounted == 1 ? " loss" : " losses");
  }
  if (summary.ring_needed > 0) text += "; " + advice_on_room(summary.ring_needed);
  return text;
}

void check_locked(const StreamSummary& summary) {
  check_locked({summary.frames, summary.locked_frames, summary.tags.syncs},
               summary.diagnosis ? &*summary.diagnosis : nullptr);
}

void check_cost(const StreamSummary& summary, double threads) {
  if (!(summary.computed_ms > summary.lasted_ms * threads)) return;
  log_warning(
      "frames took {:.3g} times as long to compute as they last, on {} threads: an instrument that "
      "is read live would not be kept up with; lower estimator.effort or scene.max_speed_mps, or "
      "raise pipeline.estimation_threads",
      summary.computed_ms / summary.lasted_ms, threads);
}

void check_pattern(const StreamSummary& summary) {
  if (summary.contradicted_frames == 0) return;
  const std::string sentence =
      "in " + grouped(summary.contradicted_frames) + " of " + grouped(summary.frames) +
      " frames the photons contradict the pattern: " + summary.pattern_advice;
  constexpr std::uint64_t by_far = 5;
  if (summary.contradicted_frames > by_far * summary.valid_frames) {
    throw Error(Fault::data, sentence);
  }
  log_warning(sentence);
}

}  // namespace splid
