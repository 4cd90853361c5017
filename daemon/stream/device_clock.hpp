#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "daemon/base/clock.hpp"
#include "drivers/source.hpp"

namespace splid {

// UTC of times in the tagger's clock. Where the source does not know it, a live source's first tag
// is as old as the host's clock says when it comes, and from then on the host's clock is followed:
// a tagger that is off by 10 ppm would be off by 26 s after a month. Anything else, a recording
// that names no date, starts at 1970, so that a replay repeats itself and never looks at the host's
// clock.
//
// Threads: one at a time. Errors: none.
class DeviceClock {
 public:
  // clock: outlives this.
  DeviceClock(const SourceInfo& info, const Clock& clock)
      : clock_(&clock),
        follows_host_(info.live && !info.start_unix_s.has_value()),
        start_unix_s_(info.start_unix_s.value_or(0)) {}

  // A tag of time_ps has just come; to be called with the first, and after the clock was set back.
  void anchor(std::int64_t time_ps) {
    if (!follows_host_) return;
    start_unix_s_ = start_of(time_ps);
    second_.reset();
  }

  // The stream has come to time_ps, or went past it a moment ago.
  //
  // Design note: what comes late says less than what comes at once, so the least late of a second
  // counts. It moves the clock by 100 ppm at most, which no frame's length shows. A clock that is
  // ahead of the host by more than tags can be early, or behind by more than the ring holds, was
  // set, one of the two: it is taken as it is.
  void follow(std::int64_t time_ps) {
    if (!follows_host_) return;
    const std::int64_t now_ns = clock_->steady_ns();
    if (!second_) second_ = Second{now_ns, start_of(time_ps)};
    second_->start_unix_s = std::min(second_->start_unix_s, start_of(time_ps));
    const double took_s = static_cast<double>(now_ns - second_->begin_ns) / 1e9;
    if (took_s < 1) return;
    const double behind_s = second_->start_unix_s - start_unix_s_;
    const bool was_set = behind_s < -ahead_s || behind_s > late_s;
    start_unix_s_ += was_set ? behind_s : std::clamp(behind_s, -rate * took_s, rate * took_s);
    second_.reset();
  }

  // Seconds; a double holds a quarter of a microsecond of UTC.
  [[nodiscard]] double unix_s(std::int64_t time_ps) const {
    return start_unix_s_ + seconds(time_ps);
  }

 private:
  static constexpr double rate = 1e-4;
  static constexpr double ahead_s = 0.5;
  static constexpr double late_s = 10;

  struct Second {
    std::int64_t begin_ns;
    double start_unix_s;  // by what came least late
  };

  [[nodiscard]] double start_of(std::int64_t time_ps) const {
    return clock_->unix_s() - seconds(time_ps);
  }
  // Divided, not multiplied by 1e-12, which is no double: 50 ms are 0.05 s to the last digit.
  static double seconds(std::int64_t time_ps) { return static_cast<double>(time_ps) / 1e12; }

  const Clock* clock_;
  bool follows_host_;
  double start_unix_s_;
  std::optional<Second> second_;
};

}  // namespace splid
