#include "drivers/simulator/sync_stream.hpp"

namespace splid::simulator {

void SyncOptions::describe(OptionVisitor& visitor) {
  visitor.number("jitter_ps", jitter_ps, {0, 1e6}, "standard deviation of each sync's time, ps");
  visitor.number("missing_fraction", missing_fraction, {0, 1}, "syncs left out at random");
  visitor.number("doubled_fraction", doubled_fraction, {0, 1},
                 "syncs followed by a second one 1 to 50 ns later");
  visitor.number("jump_ps", jump_ps, {0, 1e6},
                 "time between the two states that the syncs jump between, ps");
  visitor.number("jump_every_ms", jump_every_ms, {1e-3, 1e6}, "mean time in a state, ms");
  visitor.flag("near_photons_only", near_photons_only,
               "only the first sync after a photon is passed on, as some instruments do");
}

SyncStream::SyncStream(const Pattern& pattern, const SyncOptions& options, DriftRate drift,
                       std::uint64_t seed)
    : options_(options), clock_(pattern, drift), random_(seed, 2) {}

void SyncStream::fill(std::int64_t until_ps) {
  pending_.compact();
  const FineTime settled =
      FineTime{until_ps, 0}.after(Random::largest_normal * options_.jitter_ps + 1);
  while (clock_.period_start().ps < settled.ps) {
    send();
    clock_.next_period();
  }
}

double SyncStream::state_ps() {
  if (!(options_.jump_ps > 0)) return 0;
  for (; next_jump_.ps <= clock_.period_start().ps; is_late_ = !is_late_) {
    next_jump_.advance(options_.jump_every_ms * 1e9 * random_.exponential());
  }
  return is_late_ ? options_.jump_ps : 0;
}

void SyncStream::send() {
  if (options_.missing_fraction > 0 && random_.uniform() < options_.missing_fraction) return;
  const double jitter_ps = options_.jitter_ps > 0 ? options_.jitter_ps * random_.normal() : 0;
  const FineTime seen = clock_.period_start().after(state_ps() + jitter_ps);
  if (seen.rounded_ps() >= 0) pending_.insert(seen.rounded_ps());
  if (options_.doubled_fraction > 0 && random_.uniform() < options_.doubled_fraction) {
    const std::int64_t second_ps = seen.after(1e3 + 49e3 * random_.uniform()).rounded_ps();
    if (second_ps >= 0) pending_.insert(second_ps);
  }
}

}  // namespace splid::simulator
