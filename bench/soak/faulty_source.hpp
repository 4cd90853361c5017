#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <random>
#include <stop_token>
#include <string>

#include "drivers/simulator/simulator_options.hpp"
#include "drivers/source.hpp"
#include "drivers/tag_writer.hpp"
#include "protocol/pattern.hpp"

namespace splid::soak {

// What goes wrong with a stream of tags. The comments say for how long, in device time.
enum class StreamFault {
  none,
  reported_loss,   // 3 ms: tags missing, and the stream says from when to when and how many
  uncounted_loss,  // 3 ms: the stream says when, but not how many
  missed_tags,     // 1 ms: the stream says how many, but not when
  gap,             // 3 ms: tags are missing, and the stream does not say so
  silence,         // 500 ms without anything, not even a heartbeat
  clock_forward,   // the clock steps 6 s ahead, and the stream does not say so
  clock_back,      // the clock steps 3 s back, and the stream does not say so
  clock_break,     // the clock steps 3 s back, and the stream says so
  stray,           // one photon 5 s ahead
  other_channel,   // 1,000 tags on an input that the configuration does not name
  dark,            // 250 ms without a photon
  no_sync,         // 200 ms without a sync
  doubled_sync,    // 10 ms with two syncs a period, 20 ns apart
  flood,           // 20,000 photons at once
};
inline constexpr std::size_t fault_count = 15;
const char* to_string(StreamFault fault);

// Counts of what was sent, and of what was left out.
struct Injected {
  std::array<std::uint64_t, fault_count> faults{};  // index: StreamFault
  std::uint64_t events = 0;                         // photons, syncs and markers sent
  std::uint64_t reported = 0;                       // left out, and said how many
  std::uint64_t late = 0;  // strays, and the first 15 tags after an unsaid step back
  std::uint64_t simulated_legs = 0;
  std::uint64_t replayed_legs = 0;
  double device_s = 0;  // time of the scene, to which the clock's steps add nothing
};

// A source that plays scenes of ten seconds end to end, one from the simulator and one from a
// recording in turn. Every two seconds, after a random pause, it injects a fault, each kind in its
// turn.
//
// Threads: as TagSource; injected() may be called once run() has returned. The source is not live:
// it waits for room in the ring, and drops nothing but what it injects.
class FaultySource final : public TagSource {
 public:
  // scene: of the simulated legs. recording: a file to be written, and replayed. seconds: of
  // device time in all, rounded up to whole legs.
  FaultySource(Pattern pattern, simulator::Options scene, std::string recording, double seconds);

  [[nodiscard]] SourceInfo info() const override { return {"soak", false, 0.0}; }
  void run(TagSink& sink, std::stop_token stop) override;
  [[nodiscard]] const Injected& injected() const { return injected_; }

 private:
  class Faults;
  void record(const std::stop_token& stop);
  void simulate(TagSink& sink, const std::stop_token& stop, std::int64_t seed) const;
  void replay(TagSink& sink, const std::stop_token& stop) const;

  Pattern pattern_;
  simulator::Options scene_;
  std::string recording_;
  std::int64_t leg_ps_;  // whole periods of the pattern, so that the legs' syncs follow each other
  double seconds_;
  Injected injected_;
};

}  // namespace splid::soak
