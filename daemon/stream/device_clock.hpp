#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "daemon/base/clock.hpp"
#include "drivers/source.hpp"

namespace splid {

// Converts times in the tagger's clock to UTC. Where a live source does not know the UTC, its first
// tag gets the host's UTC at its arrival, and from then on the conversion follows the host's clock:
// a tagger's clock that is off by 10 ppm would be off by 26 s after a month. A recording that names
// no date starts at 1970; the host's clock is never used for it, so that a replay gives the same
// times each time.
//
// Threads: one at a time. Errors: none.
class DeviceClock {
 public:
  // clock: outlives this.
  DeviceClock(const SourceInfo& info, const Clock& clock)
      : clock_(&clock),
        follows_host_(info.live && !info.start_unix_s.has_value()),
        start_unix_s_(info.start_unix_s.value_or(0)) {}

  // A tag with time_ps has just come. To be called with the first tag, and with the first tag after
  // the tagger's clock was set anew.
  void anchor(std::int64_t time_ps) {
    if (!follows_host_) return;
    start_unix_s_ = start_of(time_ps);
    second_.reset();
  }

  // The stream has just come to time_ps or a little beyond. To be called often.
  //
  // Design note: tags come with varying delays, so of each second only the tag with the least delay
  // counts. It moves the conversion by 100 ppm at most, which shows in no frame's length. If the
  // conversion is ahead of the host by more than 0.5 s, or behind by more than the 10 s that a ring
  // may hold, one of the two clocks was set, and the conversion takes over the host's UTC at once.
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

  // UTC in seconds since 1970; a double resolves a quarter of a microsecond of it.
  [[nodiscard]] double unix_s(std::int64_t time_ps) const {
    return start_unix_s_ + seconds(time_ps);
  }

 private:
  static constexpr double rate = 1e-4;
  static constexpr double ahead_s = 0.5;
  static constexpr double late_s = 10;

  struct Second {
    std::int64_t begin_ns;
    double start_unix_s;  // by the tag with the least delay
  };

  [[nodiscard]] double start_of(std::int64_t time_ps) const {
    return clock_->unix_s() - seconds(time_ps);
  }
  // Divided by 1e12 and not multiplied by 1e-12, which no double holds exactly: so 50 ms are 0.05 s
  // to the last digit.
  static double seconds(std::int64_t time_ps) { return static_cast<double>(time_ps) / 1e12; }

  const Clock* clock_;
  bool follows_host_;
  double start_unix_s_;
  std::optional<Second> second_;
};

}  // namespace splid
