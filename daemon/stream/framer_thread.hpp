#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "config/config.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/stream/channel_map.hpp"
#include "daemon/stream/device_clock.hpp"
#include "daemon/stream/effort_governor.hpp"
#include "daemon/stream/framer.hpp"
#include "daemon/stream/lane.hpp"
#include "daemon/stream/ring.hpp"
#include "daemon/stream/tag_tap.hpp"

namespace splid {

using Lanes = std::vector<std::unique_ptr<Lane>>;

// Count by count.
FramerTotals added_up(const FramerTotals& a, const FramerTotals& b);

// The framer's thread: takes tags from the ring, cuts them into frames and deals these out to the
// lanes in turn.
//
// Threads: run() on one of its own; the atomics and totals_so_far() may be read from any; totals()
// and diagnosis() once run() has returned, diagnosis() also once diagnosed is true. Errors: none
// after construction. No lock and no allocation in run().
class FramerThread : private FrameSink {
 public:
  FramerThread(const Config& config, const SourceInfo& source, const Clock& clock, TagRing& ring,
               Lanes& lanes);

  // Until the ring has ended; patience_ms after a stop request the tags left in it are discarded.
  void run(const std::stop_token& stop, int patience_ms);

  // Gives every tag that it frames from now on to `recording` too; null: to none. The one before is
  // finished, on the framer's thread. One thread at a time, before run() or while it runs.
  void record_into(TagTap* recording);
  // Until the last record_into() is what is done: 100 ms at most, while run() runs or after it.
  void wait_for_recording() const;

  // The publisher has released a slot.
  void notify_released() { released_.notify(); }

  std::atomic<std::size_t> highest_fill{0};  // tags in the ring; whoever reads it sets it to 0
  std::atomic<std::int64_t> last_arrival_ns{0};
  std::atomic<bool> diagnosed{false};
  std::atomic<Effort> configured_effort;  // from the next frame on

  [[nodiscard]] const FramerTotals& totals() const { return framer_.totals(); }
  // Up to the last batch of tags; any thread. Each count is true, but two of them may be a batch
  // apart.
  [[nodiscard]] FramerTotals totals_so_far() const;
  [[nodiscard]] const std::optional<SyncDiagnosis>& diagnosis() const {
    return framer_.diagnosis();
  }
  // Any thread.
  [[nodiscard]] std::uint64_t discarded() const {
    return discarded_.load(std::memory_order_relaxed);
  }

 private:
  Frame& open() override;
  void close() override;
  void take(std::span<const Tag> some);
  void change_recording();
  void show_totals();
  [[nodiscard]] bool out_of_patience(const std::stop_token& stop, int patience_ms);

  const Clock& host_;
  TagRing& ring_;
  Lanes& lanes_;
  TagTap* recording_ = nullptr;                       // framer only
  std::uint64_t recordings_taken_ = 0;                // likewise
  std::atomic<TagTap*> next_recording_{nullptr};      // written before the count of those asked for
  std::atomic<std::uint64_t> recordings_asked_{0};    // record_into() calls
  std::atomic<std::uint64_t> recordings_changed_{0};  // of these, done
  ChannelMap channels_;
  Framer framer_;
  DeviceClock device_clock_;
  EffortGovernor effort_;
  bool waited_ = false;  // for the slot of the open frame
  Wake released_;
  std::size_t lane_ = 0;  // of the open frame
  LaneSlot* slot_ = nullptr;
  bool anchored_ = false;
  std::int64_t last_end_ps_ = 0;  // of the frame before; valid from the second on
  std::optional<std::int64_t> stop_seen_ns_;
  std::atomic<std::uint64_t> discarded_{0};
  std::array<std::atomic<std::uint64_t>, sizeof(FramerTotals) / sizeof(std::uint64_t)> shown_{};
};

}  // namespace splid
