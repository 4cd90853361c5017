#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "daemon/stream/frame.hpp"

namespace splid {

// Finds time in which the instrument sent nothing although it should have. Such a silence is a run
// without syncs, photons and markers that is so long that chance makes one in 10^9 frames. An
// instrument that stops in mid-frame leaves such a run, and so the run is time that was not seen.
// Two kinds of instruments are judged differently:
//
//  - Instruments that send every sync, which shows in that more than half of the gaps between syncs
//    are one period long. A run is silence where two things hold. It is longer than syncs dropped
//    one by one can explain, by as many as are missing in the frame: from 4 periods on. And syncs
//    come right up to the run and right after it: where photons go on without syncs, only the
//    sync's cable is off, and the time was seen.
//  - Instruments that send only the syncs beside photons. A run is silence where two things hold.
//    It is longer than the distribution of the gaps' own lengths explains. And on either side, in
//    as much time as the run lasts, there are so many tags that chance would not leave out as many
//    in the run; so a scene that grows dark is no silence. In a frame with fewer than 64 gaps no
//    silence is looked for.
//
// A frame with fewer than 8 gaps is judged like the frame before it, if that frame had every sync.
// So a frame in which no tag came at all counts as not seen.
//
// Of several pixels the photons of the brightest count.
//
// Threads: one. Errors: none. No allocation.
class Silence {
 public:
  // Adds each silence that no loss covers yet to the losses of a frame whose losses are settled,
  // and settles them again. Returns how many it added. period_ps: of the pattern.
  std::size_t mark(Frame& frame, double period_ps);

 private:
  std::int64_t regular_run_ps_ =
      0;  // shortest silence, from the last frame with every sync; 0: no such frame yet
};

}  // namespace splid
