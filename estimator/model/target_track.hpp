#pragma once

#include <cstdint>

namespace splid {

// Where a target was when it was last seen, so that the next frame can look there first. A target
// is followed for 20 frames at most before the whole range is searched again: what looks like it at
// a wrong place (a comb fits itself in part) cannot hold on for longer than that.
struct TargetTrack {
  bool valid = false;
  std::int64_t mid_ps = 0;  // of the frame, tagger's clock
  double delay_ns = 0;      // round trip at mid_ps
  double velocity_mps = 0;
  double nats_per_ns = 0;   // log-likelihood gained by the frame of the last search, per time seen
  double odds_per_nat = 0;  // of that frame's range, over the same
  int followed = 0;         // frames since that search
};

}  // namespace splid
