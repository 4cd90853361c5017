#pragma once

#include <cstdint>

#include "drivers/simulator/fine_time.hpp"
#include "drivers/simulator/pending_times.hpp"
#include "drivers/simulator/random.hpp"
#include "protocol/options.hpp"

namespace splid::simulator {

// Periodic light that is not the pattern's: another laser, or an electrical pick-up that counts as
// light. JSON: `source`/`foreign`.
struct ForeignOptions {
  double counts_per_s = 0;     // 0: none
  double frequency_hz = 80e6;  // of its pulses, in the tagger's clock
  double sigma_ps = 100;       // standard deviation of a detection's time in its pulse

  void describe(OptionVisitor& visitor);
};

// The detections of foreign light. Its pulses are even, and their phase is drawn at the start.
//
// Threads: one. No allocation once the fullest stretch has passed.
class ForeignStream {
 public:
  ForeignStream(const ForeignOptions& options, std::uint64_t seed);

  // Makes all detections before until_ps available in pending(), and some later detections.
  void fill(std::int64_t until_ps);
  PendingTimes& pending() { return pending_; }

 private:
  void next_photon();

  double period_ps_;
  double counts_per_pulse_;  // 0: none
  double sigma_ps_;
  Random random_;
  PendingTimes pending_;
  FineTime pulse_;          // of the next detection
  double since_pulse_ = 0;  // mean detections since that pulse began: [0, counts_per_pulse_)
};

}  // namespace splid::simulator
