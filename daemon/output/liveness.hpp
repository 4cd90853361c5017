#pragma once

#include <algorithm>
#include <cstdint>

namespace splid {

// What is_alive() looks at.
struct WorkSeen {
  std::uint64_t frames = 0;        // published
  std::uint64_t ring_touches = 0;  // by the source's thread
  bool ring_is_empty = true;
  // A source that is not live waits for room in the ring, and touches the ring when there is room.
  bool source_is_live = true;
};

// Whether the daemon's work goes on, which is what feeds the watchdog. It goes on while frames come
// out, and also while no tag comes in and the source shows that it is at work by touching the ring.
// It does not where a stage hangs, since tags then wait in the ring, nor where the source hangs,
// since nobody then touches the ring.
//
// Threads: one.
class Liveness {
 public:
  // How long a source may leave the ring untouched. Connecting to a bridge that does not answer
  // takes a second.
  static constexpr double source_patience_ns = 3e9;
  static constexpr double least_frame_patience_ms = 2000;

  explicit Liveness(double frame_length_ms)
      : frame_patience_ns_(std::max(least_frame_patience_ms, 4 * frame_length_ms) * 1e6) {}

  bool is_alive(const WorkSeen& seen, std::int64_t now_ns) {
    const double quiet_ns = touches_.unchanged_ns(seen.ring_touches, now_ns);
    if (frames_.unchanged_ns(seen.frames, now_ns) < frame_patience_ns_) return true;
    return seen.ring_is_empty && (!seen.source_is_live || quiet_ns < source_patience_ns);
  }

 private:
  struct Count {
    bool known = false;
    std::uint64_t value = 0;
    std::int64_t since_ns = 0;

    // Nanoseconds since it last changed, or since it was first asked.
    double unchanged_ns(std::uint64_t now, std::int64_t now_ns) {
      if (!known || value != now) *this = {true, now, now_ns};
      return static_cast<double>(now_ns - since_ns);
    }
  };

  double frame_patience_ns_;
  Count frames_;
  Count touches_;
};

}  // namespace splid
