#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "estimator/fold/near_set.hpp"

namespace splid {

// The photons of a frame near some lines, collected once for lines that are close to each other.
// Joint fits come back to a line several times, and a row of close targets needs one set.
//
// Threads: one thread for each object. Errors: none. No allocation after construction for frames of
// up to max_photons.
class NearSets {
 public:
  // sets: how many are kept. The one that was asked for last is collected anew last.
  NearSets(std::size_t sets, std::size_t max_photons, std::size_t max_entries);

  // Another frame comes next.
  void forget();
  // A set that was collected about this line, or about one whose ends are no more than margin_ns
  // away from it: the nearest. Valid until as many other lines have been asked for as sets are
  // kept. The frame and the windows are those of the first call since forget().
  const NearSet& about(const FoldedFrame& frame, std::span<const CombWindow> windows,
                       const PulseTrain& train, DelayLine line, double margin_ns);
  // How far the end of a line is at most from that of another.
  static double ends_apart_ns(DelayLine a, DelayLine b);

 private:
  struct Kept {
    NearSet near;
    std::size_t asked = 0;  // the last call that it was asked for in; 0: not of this frame
  };
  std::vector<Kept> sets_;
  std::size_t calls_ = 0;
};

}  // namespace splid
