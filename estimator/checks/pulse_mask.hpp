#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "estimator/fold/folded_frame.hpp"
#include "estimator/model/comb.hpp"
#include "estimator/model/estimate.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid {

// Which photons of a frame come within the pulses of the targets that an estimate has, to within
// six pulse widths. A path that bends is taken as straight.
//
// Threads: one thread for each object. Errors: none. mark() allocates nothing for frames of up to
// max_photons.
class PulseMask {
 public:
  PulseMask(const PulseTrain& train, const PulseShape& shape, std::size_t max_photons);

  // One entry for each of `count` photons from `first` on, in the frame's order: 1 within a pulse,
  // else 0. Empty where there is no target, or the pattern has several rates. to_reference: from
  // the pattern's clock to that of the estimate. Valid until the next call.
  std::span<const std::uint8_t> mark(const FoldedFrame& photons, std::size_t first,
                                     std::size_t count, double to_reference,
                                     const Estimate& estimate);

 private:
  void mark_line(const FoldedFrame& photons, std::size_t first, DelayLine line);

  std::optional<CombWindow> window_;  // none: the pattern has several rates
  double period_ns_;                  // of the comb
  std::vector<std::uint8_t> is_in_pulse_;
};

}  // namespace splid
