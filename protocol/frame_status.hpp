#pragma once

#include <array>
#include <cstddef>

namespace splid {

// What can be said of a frame. The estimator decides it, and the frame's JSON carries its name.
enum class FrameStatus {
  not_run,     // no frame that is published has this status
  ok,          // all values hold
  no_target,   // the significance is below what the false-alarm rate asks for
  ambiguous,   // as ok, but the mode, or the photons of this frame, cannot tell which range
  incomplete,  // less than frame.min_seen_fraction of the frame was seen
  no_sync,     // too few pattern syncs to place the pattern in time
  saturated,   // so many photons that the detector's dead time would bias the values
};

// The names in JSON, in the order of the enumerators.
inline constexpr std::array<const char*, 7> frame_status_names = {
    "not_run", "ok", "no_target", "ambiguous", "incomplete", "no_sync", "saturated"};

inline const char* to_string(FrameStatus status) {
  return frame_status_names.at(static_cast<std::size_t>(status));
}

// In what way a frame's photons contradict the pattern in use, so that no delay can be a target's.
enum class PatternFault {
  none,
  dark_pulses,   // most pulses of the pattern get no light where the others get some
  stray_pulses,  // most light comes in pulses that the pattern does not have
};

}  // namespace splid
