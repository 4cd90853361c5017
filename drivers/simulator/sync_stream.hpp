#pragma once

#include <cstdint>

#include "drivers/simulator/emission.hpp"
#include "drivers/simulator/pending_times.hpp"
#include "drivers/simulator/random.hpp"
#include "protocol/options.hpp"

namespace splid::simulator {

// How the tagger sees the pattern's syncs. JSON: `source`/`sync`.
struct SyncOptions {
  double jitter_ps = 10;           // gaussian; 9.4 to 11 were measured on a real tagger
  double missing_fraction = 0;     // of all syncs, at random
  double doubled_fraction = 0;     // of the others: a second sync comes 1 to 50 ns later
  double jump_ps = 0;              // by which syncs are later in every second state
  double jump_every_ms = 10;       // mean time in a state, exponential
  bool near_photons_only = false;  // the instrument passes only the first sync after a photon

  void describe(OptionVisitor& visitor);
};

// The syncs: one at the start of each pattern period.
//
// Threads: one. No allocation once the fullest stretch has passed.
class SyncStream {
 public:
  SyncStream(const Pattern& pattern, const SyncOptions& options, DriftRate drift,
             std::uint64_t seed);

  // Makes all syncs before until_ps available in pending(), and some later syncs.
  void fill(std::int64_t until_ps);
  PendingTimes& pending() { return pending_; }

 private:
  void send();
  double state_ps();

  SyncOptions options_;
  GeneratorClock clock_;
  Random random_;
  FineTime next_jump_;
  bool is_late_ = false;
  PendingTimes pending_;
};

}  // namespace splid::simulator
