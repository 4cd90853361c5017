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
constexpr milliseconds idle{100};

constexpr std::array counts = {
    &FramerTotals::events,   &FramerTotals::photons,  &FramerTotals::syncs,  &FramerTotals::markers,
    &FramerTotals::shared,   &FramerTotals::ignored,  &FramerTotals::late,   &FramerTotals::surplus,
    &FramerTotals::reported, &FramerTotals::unplaced, &FramerTotals::frames, &FramerTotals::jumps,
    &FramerTotals::resets,   &FramerTotals::uncounted};
static_assert(sizeof(FramerTotals) == counts.size() * sizeof(std::uint64_t), "one is missing");

constexpr std::int64_t ns_per_ms = 1'000'000;

constexpr std::uint64_t no_more_changes = std::numeric_limits<std::uint64_t>::max();

}  // namespace

FramerTotals added_up(const FramerTotals& a, const FramerTotals& b) {
  FramerTotals sum = a;
  for (const auto count : counts) sum.*count += b.*count;
  return sum;
}

FramerThread::FramerThread(const Config& config, const SourceInfo& source, const Clock& clock,
                           TagRing& ring, Lanes& lanes)
    : configured_effort(config.estimator.effort),
      host_(clock),
      ring_(ring),
      lanes_(lanes),
      channels_(config.channels),
      framer_(framer_options(config.frame.length_ms, config.pattern, config.drift.method),
              channels_, *this),
      device_clock_(source, clock),
      effort_(config.estimator.effort, source.live) {}

void FramerThread::run(const std::stop_token& stop, int patience_ms) {
  pthread_setname_np(pthread_self(), "framer");
  // A stop ends the source, which closes the ring: what is in it is taken first.
  const std::stop_token to_the_end;
  while (!ring_.ended()) {
    change_recording();
    const std::span<const Tag> waiting = ring_.wait(idle, to_the_end);
    const std::size_t fill = ring_.fill();
    if (fill > highest_fill.load(std::memory_order_relaxed)) highest_fill = fill;
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
  change_recording();
  if (recording_ != nullptr) recording_->finish();
  recordings_changed_.store(no_more_changes, std::memory_order_release);
  framer_.finish();
  show_totals();
  for (const auto& lane : lanes_) {
    lane->close();
    lane->estimator_wake.notify();
  }
}

void FramerThread::record_into(TagTap* recording) {
  next_recording_.store(recording, std::memory_order_relaxed);
  recordings_asked_.fetch_add(1, std::memory_order_release);
}

void FramerThread::wait_for_recording() const {
  const std::uint64_t asked = recordings_asked_.load(std::memory_order_relaxed);
  while (recordings_changed_.load(std::memory_order_acquire) < asked) {
    std::this_thread::sleep_for(milliseconds{1});
  }
}

void FramerThread::change_recording() {
  const std::uint64_t asked = recordings_asked_.load(std::memory_order_acquire);
  if (asked == recordings_taken_) return;
  recordings_taken_ = asked;
  if (recording_ != nullptr) recording_->finish();
  recording_ = next_recording_.load(std::memory_order_relaxed);
  recordings_changed_.store(asked, std::memory_order_release);
}

void FramerThread::take(std::span<const Tag> some) {
  if (!anchored_) device_clock_.anchor(some.front().time_ps);
  anchored_ = true;
  const std::int64_t now_ns = host_.steady_ns();
  // First, since the framer may wait for a slow publisher.
  if (recording_ != nullptr) recording_->take(some);
  framer_.push(some, now_ns);
  last_arrival_ns.store(now_ns, std::memory_order_relaxed);
  show_totals();
  if (framer_.diagnosis()) diagnosed.store(true, std::memory_order_release);
}

void FramerThread::show_totals() {
  for (std::size_t i = 0; i < counts.size(); ++i) {
    shown_[i].store(framer_.totals().*counts[i], std::memory_order_relaxed);
  }
}

FramerTotals FramerThread::totals_so_far() const {
  FramerTotals totals;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    totals.*counts[i] = shown_[i].load(std::memory_order_relaxed);
  }
  return totals;
}

bool FramerThread::out_of_patience(const std::stop_token& stop, int patience_ms) {
  if (!stop.stop_requested()) return false;
  const std::int64_t now_ns = host_.steady_ns();
  if (!stop_seen_ns_) stop_seen_ns_ = now_ns;
  return now_ns - *stop_seen_ns_ > patience_ms * ns_per_ms;
}

Frame& FramerThread::open() {
  // The publisher goes on releasing slots until the lanes are closed, so this ends.
  while ((slot_ = lanes_[lane_]->free_slot()) == nullptr) {
    waited_ = true;
    released_.wait_for(idle);
  }
  return slot_->frame;
}

void FramerThread::close() {
  const Frame& frame = slot_->frame;
  const bool clock_set_back = frame.sequence > 0 && frame.start_ps < last_end_ps_;
  if (clock_set_back) device_clock_.anchor(frame.end_ps);
  device_clock_.follow(frame.end_ps);
  last_end_ps_ = frame.end_ps;
  slot_->mid_unix_s = device_clock_.unix_s(frame.start_ps + (frame.end_ps - frame.start_ps) / 2);
  effort_.configure(configured_effort.load(std::memory_order_relaxed));
  slot_->effort = effort_.next(std::exchange(waited_, false));
  lanes_[lane_]->fill();
  lanes_[lane_]->estimator_wake.notify();
  lane_ = (lane_ + 1) % lanes_.size();
}

}  // namespace splid
