#pragma once

#include <cstdint>
#include <limits>

namespace splid::simulator {

inline constexpr double light_m_per_ps = 299'792'458e-12;
inline constexpr double ps_per_s = 1e12;

// A time in picoseconds since the start of the stream, to a small part of a picosecond however long
// the stream runs.
//
// Design note: after an hour a double of picoseconds resolves 0.5 ps, and a double of nanoseconds,
// the estimator's unit, does no better. The whole part is therefore an integer.
struct FineTime {
  std::int64_t ps = 0;
  double fraction_ps = 0;  // [0, 1)

  void advance(double by_ps) {
    fraction_ps += by_ps;
    // Truncation and a correction are several times faster than std::floor on processors from
    // before 2008, which a portable build must run on.
    auto whole_ps = static_cast<std::int64_t>(fraction_ps);
    whole_ps -= static_cast<double>(whole_ps) > fraction_ps ? 1 : 0;
    ps += whole_ps;
    fraction_ps -= static_cast<double>(whole_ps);
  }

  // A step of any length: the wait for a rare event may be longer than any stream.
  void advance_far(double by_ps) {
    constexpr double after_all_streams_ps = 9.2233e18;
    if (static_cast<double>(ps) + by_ps < after_all_streams_ps) {
      advance(by_ps);
    } else {
      *this = {std::numeric_limits<std::int64_t>::max(), 0};
    }
  }

  [[nodiscard]] FineTime after(double by_ps) const {
    FineTime later = *this;
    later.advance(by_ps);
    return later;
  }

  [[nodiscard]] std::int64_t rounded_ps() const { return ps + (fraction_ps >= 0.5 ? 1 : 0); }
  // The time to within a factor of 1 ± 2e-16, for what changes slowly.
  [[nodiscard]] double seconds() const {
    return (static_cast<double>(ps) + fraction_ps) / ps_per_s;
  }
};

}  // namespace splid::simulator
