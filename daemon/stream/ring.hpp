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

// The lock-free way of the tags from the source's thread to the framer's: one producer, one
// consumer, blocks written and read in place.
//
// Threads: claim, wait_claim, publish and close are the producer's; peek, wait, consume and ended
// the consumer's; fill and capacity anyone's. Errors: none after construction. Timeouts: claim and
// peek return at once; wait and wait_claim return when there is something, when the time is up, at
// the end of the stream, or within 20 ms of a stop request, whichever comes first.
//
// Design note: a side that finds nothing to do looks 128 times more (about 5 us: a block at 50 M
// tags/s is as far away as that) and then sleeps on a semaphore that the other side posts only if
// it sees the sleeper's flag, so that a running pair makes no system call. The flag and the index
// are sequentially consistent: sleeper writes flag, reads index; waker writes index, reads flag;
// one of the two sees the other. Sleeps are sliced into 20 ms for the sake of the stop token.
class TagRing {
 public:
  // capacity: tags, a power of two. Errors: Error(Fault::usage).
  explicit TagRing(std::size_t capacity);

  // Free room in tags, contiguous or not; looks at the consumer's side only if less than wanted was
  // free when last seen.
  std::size_t room(std::size_t wanted);
  // Contiguous free room for 1 to max_count tags, empty when the ring is full. Ends at the wrap.
  std::span<Tag> claim(std::size_t max_count);
  // As claim, but waits until there is room; empty only after a stop request.
  // Once it had to wait it waits for a quarter of the ring, so that the two threads take turns
  // seldom.
  std::span<Tag> wait_claim(std::size_t max_count, const std::stop_token& stop);
  // The first count tags of the last claim are written and may be read; count may be 0.
  void publish(std::size_t count);
  // The producer is at work, though it has nothing to publish.
  void touch() { touches_.store(touches_.load(std::memory_order_relaxed) + 1); }
  // End of the stream: nothing is published any more.
  void close();

  // The oldest tags, contiguous, empty when there are none.
  std::span<const Tag> peek();
  // As peek, but waits up to timeout; empty after it, after a stop request or when ended().
  std::span<const Tag> wait(std::chrono::nanoseconds timeout, const std::stop_token& stop);
  // The first count tags of the last peek are done with; their room may be written again.
  void consume(std::size_t count);
  // Closed, and every tag consumed.
  [[nodiscard]] bool ended() const;

  // How often the producer published or touched, for anyone who watches whether it still does.
  [[nodiscard]] std::uint64_t touches() const { return touches_.load(); }

  // Tags in the ring; exact for neither side while the other runs.
  [[nodiscard]] std::size_t fill() const;
  [[nodiscard]] std::size_t capacity() const { return mask_ + 1; }

 private:
  // Design note: 64 is written out: std::hardware_destructive_interference_size changes with the
  // compiler's flags, and two files that disagree about it disagree about this class.
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

// The ring as a source sees it when it can wait, such as a recording: nothing is ever dropped.
class WaitingSink final : public TagSink {
 public:
  WaitingSink(TagRing& ring, std::stop_token stop) : ring_(ring), stop_(std::move(stop)) {}
  std::span<Tag> claim(std::size_t max_count) override;
  void publish(std::size_t count) override { ring_.publish(count); }
  // Closes the ring; call when run() has returned or thrown.
  void finish() { ring_.close(); }

 private:
  TagRing& ring_;
  std::stop_token stop_;
};

// The ring as a live source sees it: claim never waits. When the ring is full it hands out scratch
// room; tags published there are dropped, the newest, here in the producer. What was dropped goes
// into the stream as loss_begin (time of the first) and loss_end (time of the last, value: how
// many) before any later tag. A count above 2^31 - 1 is split over up to 14 such pairs,
// enough for six minutes of 80 M tags/s; what is beyond stands in dropped_tags() alone.
//
// What else was in the dropped blocks is kept: counts of the source's own losses are added, a
// loss_begin without its end is begun again, a clock_break is passed on between the losses before
// and after it.
//
// Threads: the producer's, but for the totals, which anyone may read.
//
// Design note: after a drop tags are taken again when a sixteenth of the ring is free, not at the
// first free tag: a source slightly too fast would otherwise cut its stream into a loss every few
// tags. Room for 64 tags is never given to the source, so that the losses (at most 60 tags) fit
// even when the stream ends with the ring full.
class DroppingSink final : public TagSink {
 public:
  // Errors: Error(Fault::usage) for a ring of fewer than 256 tags.
  DroppingSink(TagRing& ring, std::stop_token stop);
  std::span<Tag> claim(std::size_t max_count) override;
  void publish(std::size_t count) override;
  // Puts the last loss into the stream and closes the ring.
  void finish();

  // Event tags (photons, syncs, markers) dropped since construction.
  [[nodiscard]] std::uint64_t dropped_tags() const { return dropped_tags_.load(); }
  // Intervals in which that happened.
  [[nodiscard]] std::uint64_t drops() const { return drops_.load(); }

 private:
  // What was dropped on one side of a clock_break.
  struct Stretch {
    bool any = false;
    bool unknown = false;   // the source's own losses in it had no count
    bool reopened = false;  // its last loss_begin has no loss_end
    std::int64_t first_ps = 0;
    std::int64_t last_ps = 0;
    std::uint64_t count = 0;
  };

  void drop(std::span<const Tag> tags);
  void drop(const Tag& tag);
  void break_stretch(std::int64_t time_ps);
  void write_losses();
  void write(const Stretch& stretch);
  void put(const Tag& tag);
  [[nodiscard]] bool pending() const { return before_.any || after_.any || broken_; }

  TagRing& ring_;
  std::stop_token stop_;
  std::vector<Tag> scratch_;
  bool in_scratch_ = false;
  bool broken_ = false;  // a clock_break was dropped, at break_ps_
  std::int64_t break_ps_ = 0;
  Stretch before_;  // before that break; unused without one
  Stretch after_;
  std::atomic<std::uint64_t> dropped_tags_{0};
  std::atomic<std::uint64_t> drops_{0};
};

}  // namespace splid
