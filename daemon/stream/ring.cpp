#include "daemon/stream/ring.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <string>
#include <utility>

#include "protocol/error.hpp"

namespace splid {
namespace {

using std::chrono::nanoseconds;
using std::chrono::steady_clock;

constexpr int looks_before_sleep = 128;
constexpr nanoseconds longest_sleep = std::chrono::milliseconds(20);

// Design note: room for the losses of a DroppingSink. On each side of a clock_break there may be 14
// pairs with a count and one pair without a count. With the clock_break itself and a loss_begin
// that is sent again these are at most 62 tags.
constexpr std::size_t kept_for_losses = 64;
constexpr int most_pairs = 14;
constexpr std::size_t scratch_tags = 8192;

void relax() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

template <class Ready>
bool look_a_while(Ready ready) {
  for (int i = 0; i < looks_before_sleep; ++i) {
    if (ready()) return true;
    relax();
  }
  return false;
}

}  // namespace

template <class Ready>
void TagRing::Sleeper::sleep(nanoseconds at_most, Ready ready) {
  asleep.store(true);
  if (!ready() && wake.try_acquire_for(at_most)) return;
  if (asleep.exchange(false)) return;
  // The other side has already taken the flag down and is about to post. That post has to be taken
  // here, or it would end the next sleep at once.
  while (!wake.try_acquire_for(longest_sleep)) {
  }
}

void TagRing::Sleeper::post() {
  if (asleep.load() && asleep.exchange(false)) wake.release();
}

TagRing::TagRing(std::size_t capacity) : mask_(capacity - 1) {
  if (!std::has_single_bit(capacity)) {
    throw Error(Fault::usage, "ring of " + std::to_string(capacity) +
                                  " tags: must be a power of two, such as " +
                                  std::to_string(std::bit_ceil(capacity)));
  }
  tags_ = std::make_unique<Tag[]>(capacity);
}

std::size_t TagRing::room(std::size_t wanted) {
  std::size_t free = capacity() - (producer_at_ - producer_sees_read_);
  if (free < wanted) {
    producer_sees_read_ = read_.load();
    free = capacity() - (producer_at_ - producer_sees_read_);
  }
  return free;
}

std::span<Tag> TagRing::claim(std::size_t max_count) {
  const std::size_t at = producer_at_ & mask_;
  const std::size_t wanted = std::min(max_count, capacity() - at);
  return {&tags_[at], std::min(wanted, room(wanted))};
}

std::span<Tag> TagRing::wait_claim(std::size_t max_count, const std::stop_token& stop) {
  const std::size_t enough = std::max<std::size_t>(capacity() / 4, 1);
  const auto ready = [&] { return room(enough) >= enough; };
  std::span<Tag> free = claim(max_count);
  if (!free.empty() || max_count == 0) return free;
  while (!look_a_while(ready)) {
    if (stop.stop_requested()) return {};
    producer_.sleep(longest_sleep, ready);
  }
  return claim(max_count);
}

void TagRing::publish(std::size_t count) {
  touch();
  if (count == 0) return;
  producer_at_ += count;
  written_.store(producer_at_);
  consumer_.post();
}

void TagRing::close() {
  closed_.store(true);
  consumer_.post();
}

std::span<const Tag> TagRing::peek() {
  if (consumer_at_ == consumer_sees_written_) consumer_sees_written_ = written_.load();
  const std::size_t at = consumer_at_ & mask_;
  const std::size_t full = consumer_sees_written_ - consumer_at_;
  return {&tags_[at], std::min(full, capacity() - at)};
}

std::span<const Tag> TagRing::wait(nanoseconds timeout, const std::stop_token& stop) {
  const auto ready = [&] { return written_.load() != consumer_at_ || closed_.load(); };
  std::span<const Tag> tags = peek();
  if (!tags.empty() || timeout <= nanoseconds::zero()) return tags;
  const auto deadline = steady_clock::now() + timeout;
  while (!look_a_while(ready)) {
    const nanoseconds left = deadline - steady_clock::now();
    if (left <= nanoseconds::zero() || stop.stop_requested()) break;
    consumer_.sleep(std::min(left, longest_sleep), ready);
  }
  return peek();
}

void TagRing::consume(std::size_t count) {
  if (count == 0) return;
  consumer_at_ += count;
  read_.store(consumer_at_);
  if (!producer_.asleep.load()) return;
  const std::size_t free = capacity() - (written_.load() - consumer_at_);
  if (free >= capacity() / 4) producer_.post();
}

bool TagRing::ended() const { return closed_.load() && written_.load() == consumer_at_; }

std::size_t TagRing::fill() const {
  const std::uint64_t read =
      read_.load();  // read_ first: written_ only grows, so the difference is never negative
  return std::min<std::size_t>(written_.load() - read, capacity());
}

std::span<Tag> WaitingSink::claim(std::size_t max_count) {
  if (stop_.stop_requested()) return {};
  return ring_.wait_claim(max_count, stop_);
}

DroppingSink::DroppingSink(TagRing& ring, std::stop_token stop)
    : ring_(ring), stop_(std::move(stop)), scratch_(scratch_tags) {
  if (ring.capacity() < 4 * kept_for_losses) {
    throw Error(Fault::usage, "ring of " + std::to_string(ring.capacity()) +
                                  " tags: a live source needs " +
                                  std::to_string(4 * kept_for_losses) + " or more");
  }
}

std::span<Tag> DroppingSink::claim(std::size_t max_count) {
  in_scratch_ = false;
  if (stop_.stop_requested()) return {};
  if (pending()) {
    const std::size_t enough = std::max(ring_.capacity() / 16, 2 * kept_for_losses);
    if (ring_.room(enough) >= enough) write_losses();
  }
  const std::size_t room = ring_.room(max_count + kept_for_losses);
  if (!pending() && room > kept_for_losses) {
    return ring_.claim(std::min(max_count, room - kept_for_losses));
  }
  in_scratch_ = true;
  return std::span(scratch_).first(std::min(max_count, scratch_.size()));
}

void DroppingSink::publish(std::size_t count) {
  if (!in_scratch_) {
    ring_.publish(count);
    return;
  }
  ring_.touch();
  drop(std::span(scratch_).first(count));
}

void DroppingSink::finish() {
  write_losses();
  ring_.close();
}

void DroppingSink::drop(std::span<const Tag> tags) {
  std::uint64_t events = 0;
  for (const Tag& tag : tags) {
    events += is_event(tag.kind) ? 1 : 0;
    drop(tag);
  }
  dropped_tags_ += events;
}

void DroppingSink::drop(const Tag& tag) {
  if (tag.kind == TagKind::clock_break) {
    drop_break(tag.time_ps);
    return;
  }
  if (tag.kind == TagKind::heartbeat) return;  // a dropped heartbeat is no loss
  if (!after_.any) {
    if (!before_.any) ++drops_;
    after_.any = true;
    after_.first_ps = after_.last_ps = tag.time_ps;
  }
  after_.last_ps = std::max(after_.last_ps, tag.time_ps);
  if (is_event(tag.kind)) {
    ++after_.count;
  } else if (tag.kind == TagKind::loss_begin) {
    after_.reopened = true;
  } else {
    if (tag.kind == TagKind::loss_end) after_.reopened = false;
    after_.unknown = after_.unknown || tag.value < 0;
    after_.count += static_cast<std::uint64_t>(std::max(tag.value, 0));
  }
}

void DroppingSink::drop_break(std::int64_t time_ps) {
  if (!before_.any) {
    before_ = after_;
  } else {
    before_.count += after_.count;
    before_.unknown = before_.unknown || after_.unknown;
  }
  before_.reopened = false;  // the source's open loss ends with the old clock
  after_ = {};
  broken_ = true;
  break_ps_ = time_ps;
}

void DroppingSink::write_losses() {
  write(before_);
  if (broken_) put({break_ps_, 0, TagKind::clock_break, {}});
  write(after_);
  before_ = after_ = {};
  broken_ = false;
}

void DroppingSink::write(const Dropped& dropped) {
  if (!dropped.any) return;
  constexpr std::uint64_t most = std::numeric_limits<std::int32_t>::max();
  std::uint64_t left = dropped.count;
  std::int64_t begin_ps = dropped.first_ps;
  for (int pair = 0; pair == 0 || (left > 0 && pair < most_pairs); ++pair) {
    const std::uint64_t part = std::min(left, most);
    put({begin_ps, 0, TagKind::loss_begin, {}});
    put({dropped.last_ps, static_cast<std::int32_t>(part), TagKind::loss_end, {}});
    left -= part;
    begin_ps = dropped.last_ps;
  }
  if (dropped.unknown) {
    put({begin_ps, 0, TagKind::loss_begin, {}});
    put({dropped.last_ps, -1, TagKind::loss_end, {}});
  }
  if (dropped.reopened) put({dropped.last_ps, 0, TagKind::loss_begin, {}});
}

void DroppingSink::put(const Tag& tag) {
  ring_.claim(1).front() = tag;
  ring_.publish(1);
}

}  // namespace splid
