#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "daemon/stream/frame.hpp"

namespace splid {

// Finds the time in which the instrument said nothing although it should have: a run of missing
// syncs without a photon or marker in it, longer than chance makes one in 10^9 frames. An
// instrument that falls silent in mid-frame looks like that, and so the run is time that was not
// seen. Two kinds of instruments differ:
//
//  - Those that send every sync, which half of the gaps between syncs being one period tells: a run
//    is silence where it is longer than the gaps' mean times the logarithm of the odds, which is
//    far longer than syncs dropped one by one explain, and where syncs come right up to it and
//    right after it. Where photons go on without syncs, the sync's cable is off, and the time was
//    seen.
//  - Those that send only the syncs beside photons: a run is silence where it is longer than the
//    tail of the gaps' own lengths explains, and so many tags came in as much time on either side
//    of it as chance does not leave out in between, so that a scene that grows dark is none. A
//    frame with fewer than 64 gaps does not tell.
//
// A frame with fewer than 8 syncs is judged as the one before, if that had every sync: so a frame
// in which nothing at all came was not seen.
//
// Threads: one. Errors: none. No allocation.
class Silence {
 public:
  // Adds what it finds, and no loss says yet, to the losses of a frame whose losses are settled,
  // and settles them again. Returns how many runs it added. period_ps: of the pattern.
  std::size_t mark(Frame& frame, double period_ps);

 private:
  std::int64_t regular_run_ps_ = 0;  // of the last frame that had every sync; 0: none had
};

}  // namespace splid
