#pragma once

#include <cstdint>

namespace splid::simulator {

inline constexpr double light_m_per_ps = 299'792'458e-12;
inline constexpr double ps_per_s = 1e12;

// A time in picoseconds since the start of the stream, to a small part of one however long it runs.
//
// Design note: after an hour a double of picoseconds resolves 0.5 ps and one of nanoseconds, the
// estimator's unit, no better; the whole part is therefore an integer.
struct FineTime {
  std::int64_t ps = 0;
  double fraction_ps = 0;  // [0, 1)

  void advance(double by_ps) {
    fraction_ps += by_ps;
    // Truncation and a correction: several times faster than std::floor on processors before 2008,
    // which a portable build is for.
    auto whole_ps = static_cast<std::int64_t>(fraction_ps);
    whole_ps -= static_cast<double>(whole_ps) > fraction_ps ? 1 : 0;
    ps += whole_ps;
    fraction_ps -= static_cast<double>(whole_ps);
  }

  [[nodiscard]] FineTime after(double by_ps) const {
    FineTime later = *this;
    later.advance(by_ps);
    return later;
  }

  [[nodiscard]] std::int64_t rounded_ps() const { return ps + (fraction_ps >= 0.5 ? 1 : 0); }
  // For what changes slowly: within 2e-16 of the time itself.
  [[nodiscard]] double seconds() const {
    return (static_cast<double>(ps) + fraction_ps) / ps_per_s;
  }
};

}  // namespace splid::simulator
