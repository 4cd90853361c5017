#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <stop_token>

#include "daemon/base/clock.hpp"
#include "daemon/stream/frame_dealer.hpp"
#include "daemon/stream/framer.hpp"
#include "daemon/stream/ring.hpp"
#include "daemon/stream/scan_cutter.hpp"
#include "daemon/stream/tag_tap.hpp"

namespace splid {

// Adds count to count.
FramerTotals& operator+=(FramerTotals& sum, const FramerTotals& more);

// The framer's thread: takes tags from the ring, gives them to the tap and cuts them into frames.
//
// Threads: run() on a thread of its own; tap_into() and wait_for_tap() on one other; the rest from
// any. diagnosis() may be read once diagnosed() is true or run() has returned. Errors: none after
// construction. No lock and no allocation in run().
class FramerThread {
 public:
  // ring, dealer, clock: outlive this.
  FramerThread(const FramerOptions& options, const ChannelMap& channels, const Clock& clock,
               TagRing& ring, FrameDealer& dealer);

  // Until the ring has ended; what the ring still holds patience_ms after a stop request is
  // discarded and counted.
  void run(const std::stop_token& stop, int patience_ms);

  // Gives every tag that is framed from now on to `tap` too; null: to nobody. The tap before it is
  // finished, on the framer's thread. Before run(), or while it runs.
  void tap_into(TagTap* tap);
  // Waits until the last tap_into() has taken effect: 100 ms at most while run() runs.
  void wait_for_tap() const;

  // The highest number of tags in the ring since the last call.
  [[nodiscard]] std::size_t take_highest_fill() { return highest_fill_.exchange(0); }
  // When the last tag or heartbeat came, steady clock; 0: none yet.
  [[nodiscard]] std::int64_t last_arrival_ns() const { return last_arrival_ns_; }
  // Up to the last batch of tags. Each count is true, but two of them may be a batch apart.
  [[nodiscard]] FramerTotals totals() const;
  // Events that were discarded after a stop request.
  [[nodiscard]] std::uint64_t discarded() const {
    return discarded_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] bool diagnosed() const { return diagnosed_.load(std::memory_order_acquire); }
  [[nodiscard]] const std::optional<SyncDiagnosis>& diagnosis() const {
    return framer_.diagnosis();
  }

 private:
  void take(std::span<const Tag> some);
  void change_tap();
  void show_totals();
  [[nodiscard]] bool out_of_patience(const std::stop_token& stop, int patience_ms);

  const Clock& host_;
  TagRing& ring_;
  FrameDealer& dealer_;
  Framer framer_;
  std::optional<ScanCutter> cutter_;  // where the frames are a scan's dwells
  bool begun_ = false;                // a first tag has come
  std::optional<std::int64_t> stop_seen_ns_;
  TagTap* tap_ = nullptr;                       // run() only
  std::uint64_t taps_taken_ = 0;                // run() only
  std::atomic<TagTap*> next_tap_{nullptr};      // written before the count of those asked for
  std::atomic<std::uint64_t> taps_asked_{0};    // calls of tap_into()
  std::atomic<std::uint64_t> taps_changed_{0};  // of these, those that have taken effect
  std::atomic<std::size_t> highest_fill_{0};
  std::atomic<std::int64_t> last_arrival_ns_{0};
  std::atomic<bool> diagnosed_{false};
  std::atomic<std::uint64_t> discarded_{0};
  std::array<std::atomic<std::uint64_t>, sizeof(FramerTotals) / sizeof(std::uint64_t)> shown_{};
};

}  // namespace splid
