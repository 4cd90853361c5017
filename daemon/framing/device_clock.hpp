#pragma once

#include <cstdint>

#include "daemon/clock.hpp"
#include "drivers/source.hpp"

namespace splid {

// UTC of times in the tagger's clock. Where the source does not know it, a live source's first tag
// is as old as the host's clock says when it comes; anything else starts at 1970, so that a replay
// repeats itself and never looks at the host's clock.
//
// Threads: one at a time. Errors: none.
class DeviceClock {
 public:
  // clock: outlives this.
  DeviceClock(const SourceInfo& info, const Clock& clock)
      : clock_(&clock),
        follows_host_(info.live && !info.start_unix_s.has_value()),
        start_unix_s_(info.start_unix_s.value_or(0)) {}

  // A tag of time_ps has just come; to be called with the first, and after the clock was set anew.
  void anchor(std::int64_t time_ps) {
    if (follows_host_) start_unix_s_ = clock_->unix_s() - seconds(time_ps);
  }

  // Seconds; a double holds a quarter of a microsecond of UTC.
  [[nodiscard]] double unix_s(std::int64_t time_ps) const {
    return start_unix_s_ + seconds(time_ps);
  }

 private:
  // Divided, not multiplied by 1e-12, which is no double: 50 ms are 0.05 s to the last digit.
  static double seconds(std::int64_t time_ps) { return static_cast<double>(time_ps) / 1e12; }

  const Clock* clock_;
  bool follows_host_;
  double start_unix_s_;
};

}  // namespace splid
