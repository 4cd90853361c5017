#include "protocol/loss_collector.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace splid {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::int64_t ms = 1'000'000'000;

Tag begin_tag(std::int64_t time_ps) { return {time_ps, 0, TagKind::loss_begin, {}}; }
Tag end_tag(std::int64_t time_ps, int count) { return {time_ps, count, TagKind::loss_end, {}}; }
Tag missed_tag(std::int64_t time_ps, int count) { return {time_ps, count, TagKind::missed, {}}; }

TEST(JoinLosses, ClosesTheSmallestGapsFirst) {
  std::vector<Loss> losses = {{0, 10, 1}, {100, 110, 2}, {115, 120, 3}, {200, 210, 4}};
  join_losses(losses, 4);
  EXPECT_EQ(losses.size(), 4U);
  join_losses(losses, 3);
  EXPECT_THAT(losses, ElementsAre(Loss{0, 10, 1}, Loss{100, 115, 5}, Loss{200, 210, 4}));
  join_losses(losses, 2);
  EXPECT_THAT(losses, ElementsAre(Loss{0, 10, 1}, Loss{100, 125, 9}));
  join_losses(losses, 0);
  EXPECT_THAT(losses, ElementsAre(Loss{90, 125, 10}));
}

TEST(JoinLosses, LossesThatTouchOrOverlapBecomeOneInterval) {
  std::vector<Loss> losses = {{0, 10, 1}, {10, 30, 2}, {15, 20, 3}};
  join_losses(losses, 1);
  EXPECT_THAT(losses, ElementsAre(Loss{0, 30, 6}));
}

TEST(JoinLosses, APointMovesToTheInterval) {
  std::vector<Loss> losses = {{0, 0, 1}, {20, 50, 2}, {70, 70, -1}};
  join_losses(losses, 1);
  EXPECT_THAT(losses, ElementsAre(Loss{20, 50, -1}));
}

TEST(JoinLosses, AnUnknownCountStaysUnknown) {
  std::vector<Loss> losses = {{0, 10, 5}, {20, 30, -1}, {35, 40, 7}};
  join_losses(losses, 1);
  EXPECT_THAT(losses, ElementsAre(Loss{10, 35, -1}));
}

TEST(JoinLosses, EmptyStaysEmpty) {
  std::vector<Loss> losses;
  join_losses(losses, 1);
  EXPECT_THAT(losses, IsEmpty());
}

TEST(LossCollector, PairsBeginsAndEnds) {
  LossCollector collector;
  for (const Tag& tag : {photon_tag(1, 1), begin_tag(10), photon_tag(12, 1), begin_tag(15),
                         end_tag(20, 3), heartbeat_tag(25), begin_tag(30), end_tag(40, -1)}) {
    collector.take(tag);
  }
  EXPECT_THAT(collector.losses(100), ElementsAre(Loss{10, 20, 3}, Loss{30, 40, -1}));
  EXPECT_EQ(collector.lost_tags(), 3U);
}

TEST(LossCollector, AnEndAloneHasNoInterval) {
  LossCollector collector;
  collector.take(end_tag(20, 3));
  EXPECT_THAT(collector.losses(100), ElementsAre(Loss{20, 20, 3}));
}

TEST(LossCollector, ALossStillOpenReachesToNow) {
  LossCollector collector;
  collector.take(begin_tag(50));
  EXPECT_THAT(collector.losses(80), ElementsAre(Loss{50, 80, -1}));
  EXPECT_THAT(collector.losses(10), ElementsAre(Loss{50, 50, -1}));
  collector.take(end_tag(90, 2));
  EXPECT_THAT(collector.losses(100), ElementsAre(Loss{50, 90, 2}));
}

TEST(LossCollector, MissedTagsWithinAMillisecondStandTogether) {
  LossCollector collector;
  collector.take(missed_tag(5, 2));
  collector.take(missed_tag(4 + ms, 3));
  collector.take(missed_tag(5 + ms, 4));
  collector.take(missed_tag(6 + ms, -1));
  EXPECT_THAT(collector.losses(0),
              ElementsAre(Loss{5, 5, 5}, Loss{5 + ms, 5 + ms, 4}, Loss{6 + ms, 6 + ms, -1}));
  EXPECT_EQ(collector.lost_tags(), 9U);
}

TEST(LossCollector, MissedTagsDoNotBlurAnInterval) {
  LossCollector collector;
  collector.add({0, 100, 1});
  collector.add_missed(100, 1);
  EXPECT_THAT(collector.losses(0), ElementsAre(Loss{0, 100, 1}, Loss{100, 100, 1}));
}

TEST(LossCollector, PastItsCapacityItJoinsAndForgetsNothing) {
  LossCollector collector(10);
  for (std::int64_t i = 0; i < 1'000; ++i) collector.add({i * ms, i * ms + 5, 2});
  const auto losses = collector.losses(0);
  EXPECT_EQ(losses.size(), 10U);
  EXPECT_EQ(losses.front().begin_ps, 0);
  std::int64_t sum = 0;
  std::int64_t length_ps = 0;
  for (const Loss& loss : losses) {
    sum += loss.count;
    length_ps += loss.end_ps - loss.begin_ps;
  }
  EXPECT_EQ(sum, 2'000);
  EXPECT_EQ(length_ps, 5'000);
  EXPECT_EQ(collector.lost_tags(), 2'000U);
}

// Each 200 ms an instrument is blind for 40 ns: a frame of 50 ms stays whole.
TEST(LossCollector, ManyShortLossesDoNotGrowOverTheTimeBetween) {
  LossCollector collector;
  for (std::int64_t i = 1; i <= 3'000; ++i)
    collector.add({i * 200 * ms, i * 200 * ms + 40'000, -1});
  const auto losses = collector.losses(0);
  EXPECT_EQ(losses.size(), 1'024U);
  std::int64_t length_ps = 0;
  for (const Loss& loss : losses) {
    length_ps += loss.end_ps - loss.begin_ps;
    EXPECT_LE(loss.end_ps - loss.begin_ps, ms);
  }
  EXPECT_EQ(length_ps, 120'000'000);
}

TEST(LossCollector, ManyMissedTagsStayPointsAllOverTheTime) {
  LossCollector collector;
  for (std::int64_t i = 0; i < 30'000; ++i) collector.take(missed_tag(i * 2 * ms, 1));
  const auto losses = collector.losses(0);
  EXPECT_EQ(losses.size(), 1'024U);
  std::int64_t sum = 0;
  std::int64_t last_ps = 0;
  for (const Loss& loss : losses) {
    EXPECT_EQ(loss.begin_ps, loss.end_ps);
    EXPECT_LE(loss.begin_ps - last_ps, 500 * ms);
    last_ps = loss.begin_ps;
    sum += loss.count;
  }
  EXPECT_EQ(sum, 30'000);
}

TEST(LossCollector, KeepsLossesSorted) {
  LossCollector collector;
  collector.add({30, 40, 1});
  collector.add({10, 20, 2});
  EXPECT_THAT(collector.losses(0), ElementsAre(Loss{10, 20, 2}, Loss{30, 40, 1}));
}

TEST(LossCollector, ALossThatIsOpenHasItsPlaceToo) {
  LossCollector collector;
  collector.take({10, 0, TagKind::loss_begin, {}});
  collector.take({40, 2, TagKind::missed, {}});
  EXPECT_THAT(collector.losses(50), ElementsAre(Loss{10, 50, -1}, Loss{40, 40, 2}));
}

TEST(LossCollector, ALossThatIsOpenEndsWithItsClock) {
  LossCollector collector;
  collector.take({50, 0, TagKind::loss_begin, {}});
  collector.take({0, 0, TagKind::clock_break, {}});
  EXPECT_THAT(collector.losses(900), ElementsAre(Loss{50, 50, -1}));
  collector.take({700, 3, TagKind::loss_end, {}});
  EXPECT_THAT(collector.losses(900), ElementsAre(Loss{50, 50, -1}, Loss{700, 700, 3}));
}

TEST(LossCollector, AnEndBeforeItsBeginIsTurnedAround) {
  LossCollector collector;
  collector.take({40, 0, TagKind::loss_begin, {}});
  collector.take({10, 3, TagKind::loss_end, {}});
  EXPECT_THAT(collector.losses(50), ElementsAre(Loss{10, 40, 3}));
}

TEST(LossCollector, TimesAndCountsMayBeAnyOf64Bits) {
  constexpr std::int64_t most = std::numeric_limits<std::int64_t>::max();
  constexpr std::int64_t least = std::numeric_limits<std::int64_t>::min();
  std::vector<Loss> losses = {{least, least, most}, {0, 1, 0}, {most, most, most}};
  join_losses(losses, 1);
  EXPECT_THAT(losses, ElementsAre(Loss{0, 1, most}));
}

}  // namespace
}  // namespace splid
