#include "daemon/stream/framer_thread.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

#include "tests/support/held_clock.hpp"
#include "tests/support/patience.hpp"
#include "tests/support/yardstick.hpp"

// The thread between the ring and the lanes, with the test as source, estimator and publisher.

namespace splid {
namespace {

using std::chrono::milliseconds;

constexpr std::int64_t period_ps = 3'780'000;

// Syncs of the pattern, and a photon in each 100th period.
std::vector<Tag> steady_tags(std::int64_t first_period, std::int64_t periods) {
  std::vector<Tag> tags;
  for (std::int64_t i = first_period; i < first_period + periods; ++i) {
    tags.push_back(sync_tag(i * period_ps));
    if (i % 100 == 0) tags.push_back(photon_tag(i * period_ps + 1000, 1));
  }
  return tags;
}

class TapOfFramer final : public TagTap {
 public:
  void take(std::span<const Tag> tags) override { taken += tags.size(); }
  void finish() override { ++finished; }
  std::atomic<std::size_t> taken{0};
  std::atomic<int> finished{0};
};

// Frames of 5 ms, some 1,300 syncs each, dealt out to two lanes.
struct Framing {
  explicit Framing(bool is_live)
      : dealer({"scripted", is_live, {}}, Effort::balanced, clock, lanes) {
    for (int i = 0; i < 2; ++i) {
      lanes.push_back(std::make_unique<Lane>(FrameCapacity{1 << 14, 1 << 12, 16, 16}, lane_depth));
    }
  }

  void put(const std::vector<Tag>& tags) {
    std::copy(tags.begin(), tags.end(), ring.claim(tags.size()).begin());
    ring.publish(tags.size());
  }

  void run(int patience_ms = 400) {
    thread = std::jthread([this, patience_ms] { framer.run(stop.get_token(), patience_ms); });
  }

  // Takes the frames in the order in which they were dealt out, so long for each, until the lanes
  // are closed.
  void publish_all(milliseconds each = {}) {
    for (std::size_t next = 0; !lanes[next]->publisher_done();) {
      EstimationUnit* unit = lanes[next]->filled_unit();
      std::this_thread::sleep_for(unit == nullptr ? milliseconds{1} : each);
      if (unit == nullptr) continue;
      EXPECT_EQ(unit->frame.sequence, efforts.size());
      efforts.push_back(unit->effort);
      tags_in_frames += unit->frame.photons_ps.size() + unit->frame.syncs_ps.size();
      lanes[next]->estimated();
      lanes[next]->release();
      dealer.notify_released();
      next = (next + 1) % lanes.size();
    }
    thread.join();
  }

  HeldClock clock;
  TagRing ring{1 << 16};
  Lanes lanes;
  FrameDealer dealer;
  FramerThread framer{
      {5, period_ps, DriftMethod::regression, 1 << 12}, ChannelMap({}), clock, ring, dealer};
  std::stop_source stop;
  std::uint64_t tags_in_frames = 0;
  std::vector<Effort> efforts;  // of all frames
  std::jthread thread;          // ends before what it uses
};

TEST(FramerThread, DealsFramesOutInTurnAndEveryTagIsInOne) {
  Framing framing(false);
  const std::vector<Tag> tags = steady_tags(0, 26'000);
  framing.put(tags);
  framing.ring.close();
  framing.run();
  framing.publish_all();
  EXPECT_EQ(framing.efforts.size(), 20U);
  EXPECT_EQ(framing.tags_in_frames, tags.size());
  EXPECT_EQ(framing.framer.totals().events, tags.size());
  EXPECT_EQ(framing.framer.discarded(), 0U);
}

// The host's clock stands still, so the patience never ends; a negative patience has ended before.
TEST(FramerThread, WhatIsLeftAfterAStopIsFramedForAsLongAsItsPatienceAndThenCounted) {
  const std::vector<Tag> tags = steady_tags(0, 13'000);
  for (const int patience_ms : {400, -1}) {
    Framing framing(true);
    framing.put(tags);
    framing.ring.close();
    framing.stop.request_stop();
    framing.run(patience_ms);
    framing.publish_all();
    EXPECT_EQ(framing.tags_in_frames, patience_ms > 0 ? tags.size() : 0);
    EXPECT_EQ(framing.framer.discarded(), patience_ms > 0 ? 0 : tags.size());
  }
}

// Also where no tag comes; docs/architecture.md promises it after 100 ms at the latest.
TEST(FramerThread, ATapTakesOverBetweenTwoBlocksAndTheTapBeforeItIsFinished) {
  const test::Yardstick yardstick;
  TapOfFramer first;
  TapOfFramer second;
  Framing framing(true);
  framing.framer.tap_into(&first);
  const std::vector<Tag> tags = steady_tags(0, 1000);
  framing.put(tags);
  framing.run();
  const auto deadline = std::chrono::steady_clock::now() + test::patience;
  while (framing.ring.fill() > 0 && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(milliseconds{1});
  }
  std::vector<double> waited_ms;
  const std::vector<TagTap*> taps = {&second, nullptr, &second, nullptr, &second};
  for (TagTap* next : taps) {
    const auto begin = std::chrono::steady_clock::now();
    framing.framer.tap_into(next);
    framing.framer.wait_for_tap();
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
    waited_ms.push_back(took.count());
  }
  EXPECT_TRUE(yardstick.keeps(100, test::median(waited_ms)));
  EXPECT_EQ(first.taken, tags.size());
  EXPECT_EQ(first.finished, 1);
  EXPECT_EQ(second.finished, 2);
  framing.put(steady_tags(1000, 100));
  framing.ring.close();
  framing.publish_all();
  EXPECT_EQ(first.taken, tags.size());
  EXPECT_EQ(second.taken, 101U);
  EXPECT_EQ(second.finished, 3);
  framing.framer.wait_for_tap();  // returns, although no thread is there any more
}

TEST(FrameDealer, AFrameThatFoundNoSlotHasLessEffortWhereTheSourceIsLive) {
  for (const bool is_live : {true, false}) {
    Framing framing(is_live);
    framing.put(steady_tags(0, 26'000));
    framing.ring.close();
    framing.run();
    framing.publish_all(milliseconds{5});  // much longer than framing takes
    ASSERT_EQ(framing.efforts.size(), 20U);
    EXPECT_EQ(framing.efforts[0], Effort::balanced);
    EXPECT_EQ(*std::min_element(framing.efforts.begin(), framing.efforts.end()),
              is_live ? Effort::fast : Effort::balanced);
  }
}

}  // namespace
}  // namespace splid
