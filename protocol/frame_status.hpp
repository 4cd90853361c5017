#pragma once

#include <array>
#include <cstddef>

namespace splid {

// The status of a frame. The estimator decides it, and the frame's JSON carries its name.
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

}  // namespace splid
