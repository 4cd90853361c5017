#include "daemon/stream/ring.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "protocol/error.hpp"

namespace splid {
namespace {

using std::chrono::milliseconds;

// Publishes photons numbered from `next` on until `count` more are in; false when there is no room.
bool put(TagSink& sink, std::int64_t& next, std::size_t count) {
  while (count > 0) {
    const std::span<Tag> room = sink.claim(count);
    if (room.empty()) return false;
    for (Tag& tag : room) tag = photon_tag(next++, 1);
    sink.publish(room.size());
    count -= room.size();
  }
  return true;
}

std::vector<Tag> drain(TagRing& ring) {
  std::vector<Tag> tags;
  for (auto some = ring.peek(); !some.empty(); some = ring.peek()) {
    tags.insert(tags.end(), some.begin(), some.end());
    ring.consume(some.size());
  }
  return tags;
}

TEST(TagRing, RefusesACapacityThatIsNoPowerOfTwo) {
  EXPECT_THROW(TagRing(0), Error);
  EXPECT_THROW(TagRing(1000), Error);
  EXPECT_EQ(TagRing(1024).capacity(), 1024U);
}

TEST(TagRing, StartsEmptyAndFillsToItsCapacity) {
  TagRing ring(8);
  EXPECT_TRUE(ring.peek().empty());
  EXPECT_EQ(ring.claim(100).size(), 8U);
  ring.publish(8);
  EXPECT_EQ(ring.fill(), 8U);
  EXPECT_TRUE(ring.claim(1).empty());
  EXPECT_EQ(ring.peek().size(), 8U);
  ring.consume(3);
  EXPECT_EQ(ring.fill(), 5U);
  EXPECT_EQ(ring.claim(100).size(), 3U);
}

TEST(TagRing, KeepsOrderAcrossTheWrap) {
  TagRing ring(8);
  std::int64_t written = 0;
  std::int64_t read = 0;
  for (std::size_t step = 1; step < 200; ++step) {
    const std::span<Tag> room = ring.claim(step % 7 + 1);
    for (Tag& tag : room) tag = photon_tag(written++, 1);
    ring.publish(room.size());
    const std::span<const Tag> tags = ring.peek();
    const std::size_t some = std::min<std::size_t>(tags.size(), step % 5 + 1);
    for (const Tag& tag : tags.first(some)) ASSERT_EQ(tag.time_ps, read++);
    ring.consume(some);
    ASSERT_EQ(ring.fill(), static_cast<std::size_t>(written - read));
  }
  EXPECT_GT(read, 300);
}

TEST(TagRing, WhatIsNotPublishedIsNotSeen) {
  TagRing ring(8);
  ring.claim(4)[0] = photon_tag(1, 1);
  ring.publish(0);
  EXPECT_TRUE(ring.peek().empty());
}

TEST(TagRing, EndsWhenClosedAndEmpty) {
  TagRing ring(8);
  ring.claim(1)[0] = photon_tag(1, 1);
  ring.publish(1);
  ring.close();
  EXPECT_FALSE(ring.ended());
  EXPECT_EQ(ring.wait(std::chrono::seconds(60), {}).size(), 1U);
  ring.consume(1);
  EXPECT_TRUE(ring.ended());
  EXPECT_TRUE(
      ring.wait(std::chrono::seconds(60), {}).empty());  // at once, or the test takes a minute
}

TEST(TagRing, WaitEndsWithItsTime) {
  TagRing ring(8);
  EXPECT_TRUE(ring.wait(milliseconds(1), {}).empty());
  EXPECT_TRUE(ring.wait(milliseconds(0), {}).empty());
}

TEST(TagRing, AStopEndsBothWaits) {
  TagRing empty(8);
  TagRing full(8);
  full.claim(8);
  full.publish(8);
  std::jthread consumer([&](const std::stop_token& stop) {
    EXPECT_TRUE(empty.wait(std::chrono::seconds(600), stop).empty());
  });
  std::jthread producer(
      [&](const std::stop_token& stop) { EXPECT_TRUE(full.wait_claim(1, stop).empty()); });
  std::this_thread::sleep_for(milliseconds(30));
  consumer.request_stop();
  producer.request_stop();
}

TEST(TagRing, AStopLeavesNoTagBehind) {
  TagRing ring(8);
  ring.claim(2);
  ring.publish(2);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(ring.wait(std::chrono::seconds(1), stop.get_token()).size(), 2U);
}

// Both sides have to sleep now and then for this to end well: the ring is small and each side
// pauses in turn.
void pass_through(std::size_t capacity, std::size_t block, std::int64_t total) {
  TagRing ring(capacity);
  std::jthread producer([&](const std::stop_token& stop) {
    WaitingSink sink(ring, stop);
    std::int64_t next = 0;
    while (next < total) {
      put(sink, next, std::min<std::size_t>(block, static_cast<std::size_t>(total - next)));
      if (next % 50'000 < 10) std::this_thread::sleep_for(milliseconds(1));
    }
    sink.finish();
  });
  std::int64_t expected = 0;
  while (!ring.ended()) {
    const std::span<const Tag> tags = ring.wait(std::chrono::seconds(1), {});
    for (const Tag& tag : tags) ASSERT_EQ(tag.time_ps, expected++);
    ring.consume(tags.size());
    if (expected % 70'000 < 10) std::this_thread::sleep_for(milliseconds(1));
  }
  EXPECT_EQ(expected, total);
}

TEST(TagRing, TwoThreadsPassEveryTagInOrder) {
  pass_through(1, 1, 2'000);
  pass_through(2, 3, 20'000);
  pass_through(64, 17, 200'000);
  pass_through(4096, 1000, 2'000'000);
}

TEST(TagRing, FillMayBeReadFromAnyThread) {
  TagRing ring(256);
  std::jthread watcher([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) ASSERT_LE(ring.fill(), ring.capacity());
  });
  std::jthread producer([&](const std::stop_token& stop) {
    WaitingSink sink(ring, stop);
    std::int64_t next = 0;
    put(sink, next, 100'000);
    sink.finish();
  });
  while (!ring.ended()) ring.consume(ring.wait(std::chrono::seconds(1), {}).size());
}

TEST(WaitingSink, GivesNothingAfterAStop) {
  TagRing ring(8);
  std::stop_source stop;
  WaitingSink sink(ring, stop.get_token());
  EXPECT_FALSE(sink.claim(1).empty());
  stop.request_stop();
  EXPECT_TRUE(sink.claim(1).empty());
}

TEST(DroppingSink, RefusesARingTooSmallForItsLosses) {
  TagRing ring(128);
  EXPECT_THROW(DroppingSink(ring, {}), Error);
}

TEST(DroppingSink, DropsTheNewestAndSaysSoBeforeAnyLaterTag) {
  TagRing ring(256);
  DroppingSink sink(ring, {});
  std::int64_t next = 0;
  ASSERT_TRUE(put(sink, next, 300));  // 192 fit, 64 are kept for losses
  EXPECT_EQ(sink.dropped_tags(), 108U);
  EXPECT_EQ(sink.drops(), 1U);
  EXPECT_EQ(drain(ring).size(), 192U);
  ASSERT_TRUE(put(sink, next, 1));
  const std::vector<Tag> tags = drain(ring);
  ASSERT_EQ(tags.size(), 3U);
  EXPECT_EQ(tags[0], (Tag{192, 0, TagKind::loss_begin, {}}));
  EXPECT_EQ(tags[1], (Tag{299, 108, TagKind::loss_end, {}}));
  EXPECT_EQ(tags[2], photon_tag(300, 1));
}

TEST(DroppingSink, TheLossFitsEvenAtTheEndOfAFullRing) {
  TagRing ring(256);
  DroppingSink sink(ring, {});
  std::int64_t next = 0;
  ASSERT_TRUE(put(sink, next, 1000));
  sink.finish();
  const std::vector<Tag> tags = drain(ring);
  ASSERT_EQ(tags.size(), 194U);
  EXPECT_EQ(tags[192], (Tag{192, 0, TagKind::loss_begin, {}}));
  EXPECT_EQ(tags[193], (Tag{999, 808, TagKind::loss_end, {}}));
  EXPECT_TRUE(ring.ended());
}

TEST(DroppingSink, WithoutDropsFinishAddsNothing) {
  TagRing ring(256);
  DroppingSink sink(ring, {});
  std::int64_t next = 0;
  put(sink, next, 10);
  sink.finish();
  EXPECT_EQ(drain(ring).size(), 10U);
}

// Fills the ring, has `tags` dropped, and returns what finish() says of them.
std::vector<Tag> told_of(const std::vector<Tag>& tags) {
  TagRing ring(256);
  DroppingSink sink(ring, {});
  std::int64_t next = 0;
  put(sink, next, 192);
  for (const Tag& tag : tags) {
    sink.claim(1)[0] = tag;
    sink.publish(1);
  }
  sink.finish();
  std::vector<Tag> all = drain(ring);
  all.erase(all.begin(), all.begin() + 192);
  return all;
}

TEST(DroppingSink, HeartbeatsAloneAreNoLoss) { EXPECT_TRUE(told_of({heartbeat_tag(500)}).empty()); }

TEST(DroppingSink, CountsOfDroppedLossesAreAdded) {
  const std::vector<Tag> told = told_of({photon_tag(500, 1),
                                         {600, 0, TagKind::loss_begin, {}},
                                         {700, 40, TagKind::loss_end, {}},
                                         {800, 2, TagKind::missed, {}}});
  EXPECT_EQ(told, (std::vector<Tag>{{500, 0, TagKind::loss_begin, {}},
                                    {800, 43, TagKind::loss_end, {}}}));
}

TEST(DroppingSink, UnknownCountsStayUnknown) {
  const std::vector<Tag> told = told_of({photon_tag(500, 1), {700, -1, TagKind::loss_end, {}}});
  EXPECT_EQ(told, (std::vector<Tag>{{500, 0, TagKind::loss_begin, {}},
                                    {700, 1, TagKind::loss_end, {}},
                                    {700, 0, TagKind::loss_begin, {}},
                                    {700, -1, TagKind::loss_end, {}}}));
}

TEST(DroppingSink, ALossThatGoesOnIsBegunAgain) {
  const std::vector<Tag> told = told_of({photon_tag(500, 1), {700, 0, TagKind::loss_begin, {}}});
  ASSERT_EQ(told.size(), 3U);
  EXPECT_EQ(told[2], (Tag{700, 0, TagKind::loss_begin, {}}));
}

TEST(DroppingSink, AClockBreakIsPassedOn) {
  const std::vector<Tag> told = told_of(
      {photon_tag(500, 1), {510, 0, TagKind::clock_break, {}}, photon_tag(3, 1), sync_tag(9)});
  EXPECT_EQ(told, (std::vector<Tag>{{500, 0, TagKind::loss_begin, {}},
                                    {500, 1, TagKind::loss_end, {}},
                                    {510, 0, TagKind::clock_break, {}},
                                    {3, 0, TagKind::loss_begin, {}},
                                    {9, 2, TagKind::loss_end, {}}}));
}

TEST(DroppingSink, ADropBehindAClockBreakIsCounted) {
  TagRing ring(256);
  DroppingSink sink(ring, {});
  std::int64_t next = 0;
  put(sink, next, 192);
  for (const Tag& tag : {Tag{500, 0, TagKind::clock_break, {}}, photon_tag(3, 1)}) {
    sink.claim(1)[0] = tag;
    sink.publish(1);
  }
  EXPECT_EQ(sink.drops(), 1U);
}

TEST(DroppingSink, CountsBeyond31BitsAreSplit) {
  constexpr std::int32_t most = 2'147'483'647;
  const std::vector<Tag> told = told_of({{500, most, TagKind::missed, {}},
                                         {600, most, TagKind::missed, {}},
                                         {700, 5, TagKind::missed, {}}});
  std::int64_t sum = 0;
  for (const Tag& tag : told) {
    if (tag.kind == TagKind::loss_end) sum += tag.value;
  }
  EXPECT_EQ(told.size(), 6U);
  EXPECT_EQ(sum, 2LL * most + 5);
}

TEST(DroppingSink, SumsCloseUnderASlowConsumer) {
  TagRing ring(1024);
  constexpr std::int64_t total = 2'000'000;
  std::uint64_t dropped = 0;
  std::jthread producer([&](const std::stop_token& stop) {
    DroppingSink sink(ring, stop);
    std::int64_t next = 0;
    while (next < total) put(sink, next, 100);
    sink.finish();
    dropped = sink.dropped_tags();
  });
  std::int64_t got = 0;
  std::int64_t told = 0;
  std::int64_t last = -1;
  while (!ring.ended()) {
    const std::span<const Tag> tags = ring.wait(std::chrono::seconds(1), {});
    for (const Tag& tag : tags) {
      ASSERT_GE(tag.time_ps, last);
      last = tag.time_ps;
      got += is_event(tag.kind) ? 1 : 0;
      told += tag.kind == TagKind::loss_end ? tag.value : 0;
    }
    ring.consume(tags.size());
    std::this_thread::yield();
  }
  producer.join();
  EXPECT_EQ(got + told, total);
  EXPECT_EQ(static_cast<std::uint64_t>(told), dropped);
}

}  // namespace
}  // namespace splid
