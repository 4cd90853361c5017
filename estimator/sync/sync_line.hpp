#pragma once

#include <cstdint>
#include <vector>

#include "estimator/sync/sync_clock.hpp"

namespace splid {

// The pattern period over a whole recording: the least-squares line through the pattern starts that
// the frames' own sync fits give. Periods are counted from frame to frame; where a gap is too long
// to say how many there were, or the clock was set anew, a new line of the same slope begins.
//
// Threads: one. Errors: none. Grows by 40 bytes a frame. Source: [P] Eq. 19, by regression.
class SyncLine {
 public:
  // Frames that are not locked are passed over.
  void add(const SyncFit& fit);
  // The generator began again: the next frame is no whole number of periods after the last one.
  void cut() { is_cut_ = true; }

  struct Period {
    double period_ps = 0;      // tagger's clock; 0 before any locked frame
    double std_period_ps = 0;  // what the clocks' wander about the line adds is in it
  };
  [[nodiscard]] Period period() const;

 private:
  // A pattern start, relative to the stretch's first and the first frame's period.
  struct Start {
    std::uint32_t stretch;
    double k;          // periods since the stretch's first start
    double excess_ps;  // later than k first periods
    double weight;     // 1 / variance, 1/ps^2
  };

  std::vector<Start> starts_;
  SyncFit last_;
  bool is_cut_ = false;
  double first_period_ps_ = 0;
  double first_std_period_ps_ = 0;
};

}  // namespace splid
