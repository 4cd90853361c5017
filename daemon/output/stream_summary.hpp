#pragma once

#include <array>
#include <cstdint>
#include <exception>
#include <optional>
#include <string>

#include "daemon/stream/frame_message.hpp"
#include "daemon/stream/framer.hpp"
#include "protocol/frame_json.hpp"

namespace splid {

// What came of a stream.
struct StreamSummary {
  std::array<std::uint64_t, 7> frames_by_status{};  // index: FrameStatus
  std::uint64_t frames = 0;
  std::uint64_t valid_frames = 0;
  std::uint64_t contradicted_frames = 0;  // their photons contradict the pattern
  std::string pattern_advice;             // of the last such frame
  double computed_ms = 0;                 // estimation of all frames together
  double lasted_ms = 0;                   // all frames together
  std::uint64_t locked_frames = 0;        // syncs gave the pattern's clock
  FramerTotals tags;
  std::uint64_t lost_tags = 0;       // known count, of all frames
  std::uint64_t discarded_tags = 0;  // in the ring when a stop request's time was up
  std::optional<SyncDiagnosis> diagnosis;
  std::exception_ptr fault;       // of the source; null where the stream ended or was stopped
  std::uint64_t ring_needed = 0;  // for the fullest frame without room for its photons; 0: none
  bool paused = false;            // ended by a pause, and for no other reason

  // Counts a frame that was published. computed_ms: of its estimation; locked: to its syncs.
  void add(const FrameMessage& message, double frame_computed_ms, bool locked) {
    ++frames;
    ++frames_by_status[static_cast<std::size_t>(message.status)];
    if (message.valid()) ++valid_frames;
    computed_ms += frame_computed_ms;
    lasted_ms += message.duration_ms;
    if (const auto* pattern = pattern_finding(message)) {
      ++contradicted_frames;
      pattern_advice = pattern->advice;
    }
    if (locked) ++locked_frames;
  }
};

}  // namespace splid
