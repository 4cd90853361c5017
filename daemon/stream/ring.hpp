#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <semaphore>
#include <span>
#include <stop_token>
#include <utility>
#include <vector>

#include "drivers/source.hpp"
#include "protocol/tag.hpp"

namespace splid {

// The lock-free ring that carries tags from the source's thread to the framer's thread: one
// producer, one consumer; blocks of tags are written and read in place.
//
// Threads: claim, wait_claim, publish, touch and close are the producer's; peek, wait, consume and
// ended are the consumer's; fill, touches and capacity are for any thread. Errors: none after
// construction. Timeouts: claim and peek return at once; wait and wait_claim return when they have
// something to return, when the time is up, at the end of the stream, or within 20 ms of a stop
// request, whichever comes first.
//
// Design note: a side that finds nothing to do looks 128 times more (about 5 us, in which at 50 M
// tags/s the next block comes). Then it sleeps on a semaphore, which the other side posts only if
// it sees the sleeper's flag, so that a running pair makes no system call. Flag and index are
// sequentially consistent: the sleeper writes the flag and then reads the index, the waker writes
// the index and then reads the flag, so at least one of them sees what the other wrote. A sleep
// lasts at most 20 ms at a time, so that a stop request is seen.
class TagRing {
 public:
  // capacity: tags, a power of two. Errors: Error(Fault::usage).
  explicit TagRing(std::size_t capacity);

  // Free room in tags, contiguous or not. Reads the consumer's index only if less than `wanted` was
  // free when it was last read.
  std::size_t room(std::size_t wanted);
  // Contiguous free room for 1 to max_count tags, which ends at the ring's wrap; empty when the
  // ring is full.
  std::span<Tag> claim(std::size_t max_count);
  // As claim, but waits until there is room; empty only after a stop request. If the ring is full,
  // it waits until a quarter of the ring is free, so that the two threads seldom take turns.
  std::span<Tag> wait_claim(std::size_t max_count, const std::stop_token& stop);
  // The first `count` tags of the last claim are written and may be read; `count` may be 0.
  void publish(std::size_t count);
  // Says that the producer is at work, although it has nothing to publish.
  void touch() { touches_.store(touches_.load(std::memory_order_relaxed) + 1); }
  // The stream is over: the producer publishes nothing any more.
  void close();

  // The oldest tags, contiguous; empty when there are none.
  std::span<const Tag> peek();
  // As peek, but waits up to `timeout` for tags; empty when the time is up, after a stop request
  // and when ended().
  std::span<const Tag> wait(std::chrono::nanoseconds timeout, const std::stop_token& stop);
  // The first `count` tags of the last peek were read; their room may be written again.
  void consume(std::size_t count);
  // The producer has closed the ring and every tag is consumed.
  [[nodiscard]] bool ended() const;

  // How often the producer called publish() or touch(); a watchdog sees by it whether the producer
  // is still alive.
  [[nodiscard]] std::uint64_t touches() const { return touches_.load(); }

  // Tags in the ring; not exact while the other side is running.
  [[nodiscard]] std::size_t fill() const;
  [[nodiscard]] std::size_t capacity() const { return mask_ + 1; }

 private:
  // Design note: 64 is written out because std::hardware_destructive_interference_size depends on
  // the compiler's flags: two files compiled with different flags would disagree about this class.
  static constexpr std::size_t cache_line = 64;

  struct Sleeper {
    std::atomic<bool> asleep{false};
    std::binary_semaphore wake{0};
    template <class Ready>
    void sleep(std::chrono::nanoseconds at_most, Ready ready);
    void post();
  };

  std::size_t mask_;
  std::unique_ptr<Tag[]> tags_;

  alignas(cache_line) std::atomic<std::uint64_t> written_{0};  // producer writes
  std::atomic<std::uint64_t> touches_{0};                      // producer writes
  alignas(cache_line) std::atomic<std::uint64_t> read_{0};     // consumer writes
  alignas(cache_line) std::atomic<bool> closed_{false};        // producer writes, once
  alignas(cache_line) std::uint64_t producer_at_ = 0;          // producer only: own index,
  std::uint64_t producer_sees_read_ = 0;                       // last read_ seen
  alignas(cache_line) std::uint64_t consumer_at_ = 0;          // consumer only: own index,
  std::uint64_t consumer_sees_written_ = 0;                    // last written_ seen
  alignas(cache_line) Sleeper producer_;
  alignas(cache_line) Sleeper consumer_;
};

// The ring as seen by a source that can wait, such as a replay: no tag is ever dropped.
class WaitingSink final : public TagSink {
 public:
  WaitingSink(TagRing& ring, std::stop_token stop) : ring_(ring), stop_(std::move(stop)) {}
  std::span<Tag> claim(std::size_t max_count) override;
  void publish(std::size_t count) override { ring_.publish(count); }
  // Closes the ring. To be called when the source's run() has returned or thrown.
  void finish() { ring_.close(); }

 private:
  TagRing& ring_;
  std::stop_token stop_;
};

// The ring as seen by a live source: claim() never waits. When the ring is full, claim() hands out
// scratch room, and tags published there are dropped; so the newest tags are dropped, and on the
// producer's side. Before any later tag, the drop goes into the stream as a loss_begin with the
// time of the first dropped tag and a loss_end with the time of the last dropped tag and their
// number. A number above 2^31 - 1 is split over up to 14 such pairs, enough for six minutes at 80 M
// tags/s; tags beyond that are counted only in dropped_tags().
//
// Control tags in dropped blocks are not lost: the counts of the source's own losses are added to
// the drop's count, a loss_begin whose loss_end has not come yet is sent again after the drop, and
// a clock_break is passed on between the losses before and after it.
//
// Threads: the producer's, except the totals, which any thread may read.
//
// Design note: after a drop, tags are taken again when a sixteenth of the ring is free, and not
// when the first tag's room is: a source that is slightly too fast would otherwise cut its stream
// into losses every few tags. Room for 64 tags is never given to the source, so that the losses (at
// most 62 tags) fit even when the stream ends while the ring is full.
class DroppingSink final : public TagSink {
 public:
  // Errors: Error(Fault::usage) for a ring of fewer than 256 tags.
  DroppingSink(TagRing& ring, std::stop_token stop);
  std::span<Tag> claim(std::size_t max_count) override;
  void publish(std::size_t count) override;
  // Puts the last drop into the stream as a loss, and closes the ring.
  void finish();

  // Event tags (photons, syncs, markers) dropped since construction.
  [[nodiscard]] std::uint64_t dropped_tags() const { return dropped_tags_.load(); }
  // Intervals in which tags were dropped.
  [[nodiscard]] std::uint64_t drops() const { return drops_.load(); }

 private:
  // The tags dropped on one side of a clock_break.
  struct Dropped {
    bool any = false;
    bool unknown = false;   // a dropped loss of the source itself had no count
    bool reopened = false;  // the last dropped loss_begin has no loss_end yet
    std::int64_t first_ps = 0;
    std::int64_t last_ps = 0;
    std::uint64_t count = 0;
  };

  void drop(std::span<const Tag> tags);
  void drop(const Tag& tag);
  void drop_break(std::int64_t time_ps);
  void write_losses();
  void write(const Dropped& dropped);
  void put(const Tag& tag);
  [[nodiscard]] bool pending() const { return before_.any || after_.any || broken_; }

  TagRing& ring_;
  std::stop_token stop_;
  std::vector<Tag> scratch_;
  bool in_scratch_ = false;
  bool broken_ = false;  // a clock_break was dropped, at break_ps_
  std::int64_t break_ps_ = 0;
  Dropped before_;  // dropped before the clock_break; unused without a clock_break
  Dropped after_;   // dropped after it; without a clock_break, all dropped tags
  std::atomic<std::uint64_t> dropped_tags_{0};
  std::atomic<std::uint64_t> drops_{0};
};

}  // namespace splid
