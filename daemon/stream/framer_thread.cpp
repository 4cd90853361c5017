#include "daemon/stream/framer_thread.hpp"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <thread>
#include <utility>

namespace splid {
namespace {

using std::chrono::milliseconds;

// Tags given to the framer at once: few enough that a replay gets room in the ring early and that
// the time of arrival of a frame's last tag is true to a fraction of a millisecond.
constexpr std::size_t tags_at_once = 16'384;

// How long an idle wait lasts before it looks at everything again.
constexpr milliseconds framer_idle{100};

constexpr std::array counted_totals = {
    &FramerTotals::events,     &FramerTotals::photons,
    &FramerTotals::syncs,      &FramerTotals::markers,
    &FramerTotals::shared,     &FramerTotals::ignored,
    &FramerTotals::late,       &FramerTotals::surplus,
    &FramerTotals::reported,   &FramerTotals::unplaced,
    &FramerTotals::frames,     &FramerTotals::jumps,
    &FramerTotals::resets,     &FramerTotals::uncounted,
    &FramerTotals::beyond,     &FramerTotals::outside,
    &FramerTotals::lines,      &FramerTotals::cut_lines,
    &FramerTotals::open_lines, &FramerTotals::half_picture_lines};
static_assert(sizeof(FramerTotals) == counted_totals.size() * sizeof(std::uint64_t),
              "one is missing");

constexpr std::int64_t ns_per_ms = 1'000'000;

constexpr std::uint64_t no_more_changes = std::numeric_limits<std::uint64_t>::max();

}  // namespace

FramerTotals& operator+=(FramerTotals& sum, const FramerTotals& more) {
  for (const auto count : counted_totals) sum.*count += more.*count;
  return sum;
}

FramerThread::FramerThread(const FramerOptions& options, const ChannelMap& channels,
                           const Clock& clock, TagRing& ring, FrameDealer& dealer)
    : host_(clock), ring_(ring), dealer_(dealer), framer_(options, channels, dealer) {
  if (options.scan) cutter_.emplace(*options.scan, channels, ring.capacity(), framer_);
}

void FramerThread::run(const std::stop_token& stop, int patience_ms) {
  pthread_setname_np(pthread_self(), "framer");
  // A stop ends the source, which closes the ring: what is in it is taken first.
  const std::stop_token to_the_end;
  while (!ring_.ended()) {
    change_tap();
    const std::span<const Tag> waiting = ring_.wait(framer_idle, to_the_end);
    const std::size_t fill = ring_.fill();
    if (fill > highest_fill_.load(std::memory_order_relaxed)) highest_fill_ = fill;
    const auto some = waiting.first(std::min(waiting.size(), tags_at_once));
    if (out_of_patience(stop, patience_ms)) {
      const auto events =
          std::count_if(some.begin(), some.end(), [](const Tag& t) { return is_event(t.kind); });
      discarded_.fetch_add(static_cast<std::uint64_t>(events), std::memory_order_relaxed);
    } else if (!some.empty()) {
      take(some);
    }
    ring_.consume(some.size());
  }
  change_tap();
  if (tap_ != nullptr) tap_->finish();
  taps_changed_.store(no_more_changes, std::memory_order_release);
  if (cutter_) cutter_->finish();
  framer_.finish();
  show_totals();
  dealer_.close_lanes();
}

void FramerThread::tap_into(TagTap* tap) {
  next_tap_.store(tap, std::memory_order_relaxed);
  taps_asked_.fetch_add(1, std::memory_order_release);
}

void FramerThread::wait_for_tap() const {
  const std::uint64_t asked = taps_asked_.load(std::memory_order_relaxed);
  while (taps_changed_.load(std::memory_order_acquire) < asked) {
    std::this_thread::sleep_for(milliseconds{1});
  }
}

void FramerThread::change_tap() {
  const std::uint64_t asked = taps_asked_.load(std::memory_order_acquire);
  if (asked == taps_taken_) return;
  taps_taken_ = asked;
  if (tap_ != nullptr) tap_->finish();
  tap_ = next_tap_.load(std::memory_order_relaxed);
  taps_changed_.store(asked, std::memory_order_release);
}

void FramerThread::take(std::span<const Tag> some) {
  if (!begun_) dealer_.begin(some.front().time_ps);
  begun_ = true;
  const std::int64_t now_ns = host_.steady_ns();
  // The tap comes first, since the framer may wait for a slow taker of frames.
  if (tap_ != nullptr) tap_->take(some);
  if (cutter_) {
    cutter_->push(some, now_ns);
  } else {
    framer_.push(some, now_ns);
  }
  // Of what came while the framer waited for room in the lanes, the rest may take a while to come.
  last_arrival_ns_.store(host_.steady_ns(), std::memory_order_relaxed);
  show_totals();
  if (framer_.diagnosis()) diagnosed_.store(true, std::memory_order_release);
}

void FramerThread::show_totals() {
  for (std::size_t i = 0; i < counted_totals.size(); ++i) {
    shown_[i].store(framer_.totals().*counted_totals[i], std::memory_order_relaxed);
  }
}

FramerTotals FramerThread::totals() const {
  FramerTotals totals;
  for (std::size_t i = 0; i < counted_totals.size(); ++i) {
    totals.*counted_totals[i] = shown_[i].load(std::memory_order_relaxed);
  }
  return totals;
}

bool FramerThread::out_of_patience(const std::stop_token& stop, int patience_ms) {
  if (!stop.stop_requested()) return false;
  const std::int64_t now_ns = host_.steady_ns();
  if (!stop_seen_ns_) stop_seen_ns_ = now_ns;
  return now_ns - *stop_seen_ns_ > patience_ms * ns_per_ms;
}

}  // namespace splid
