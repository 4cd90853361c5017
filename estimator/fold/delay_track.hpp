#pragma once

namespace splid {

// A target's delay over a frame, in ns of the pattern's clock. At the share s of the frame, from
// -1/2 to 1/2, with u = 2 s, it is
//   x(u) = delay + walk / 2 P_1(u) + quadratic P_2(u)
// with the Legendre polynomials P_1 = u and P_2 = (3 u^2 - 1) / 2. Where the light is even over the
// frame, the three terms do not correlate.
struct DelayTrack {
  double delay_ns = 0;  // mean over the frame
  double walk_ns = 0;   // range walk: from the frame's begin to its end; above 0 moves away
  double quadratic_ns = 0;

  // P_2 at a share of the frame.
  static constexpr double quadratic_at(double share) { return 6 * share * share - 0.5; }
  [[nodiscard]] double at(double share) const {
    return delay_ns + walk_ns * share + quadratic_ns * quadratic_at(share);
  }
  [[nodiscard]] double at_mid_frame_ns() const { return delay_ns - quadratic_ns / 2; }
  bool operator==(const DelayTrack&) const = default;
  DelayTrack operator-(const DelayTrack& from) const {
    return {delay_ns - from.delay_ns, walk_ns - from.walk_ns, quadratic_ns - from.quadratic_ns};
  }
};

}  // namespace splid
