#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <random>

#include "daemon/stream/framer.hpp"
#include "tests/support/framed.hpp"

namespace splid {
namespace {

using namespace test;

// From 2^63 - 2^54 ps on, and down from as far below zero, nothing can be measured. The frames say
// so, and every tag is lost in one of them.
TEST(Framer, BeyondTheRangeOfTimesFramesLoseTheirTags) {
  constexpr std::int64_t end_ps = std::numeric_limits<std::int64_t>::max() - (1LL << 54);
  for (const int sign : {1, -1}) {
    TagStream stream;
    stream.begin_ps = sign > 0 ? end_ps - 30 * ms : -end_ps - 50 * ms;
    const std::vector<Tag> tags = stream.make();
    const Framed r = framed(tags);
    expect_sums_close(r, tags.size());
    EXPECT_EQ(r.totals.unplaced, 0U);
    EXPECT_EQ(r.totals.resets, 1U);
    std::vector<bool> seen;
    for (const auto& frame : r.frames.frames) {
      seen.push_back(frame->seen_fraction > 0.99);
      if (seen.back()) continue;
      if (frame->seen_fraction > 0) continue;  // cut short at the end of the range
      EXPECT_EQ(frame->start_ps, sign * end_ps);
      EXPECT_GT(frame->lost_tags, 150U);
      EXPECT_TRUE(frame->photons_ps.empty() && frame->syncs_ps.empty());
    }
    EXPECT_EQ(std::count(seen.begin(), seen.end(), true), sign > 0 ? 3 : 5);
    EXPECT_GE(std::count(seen.begin(), seen.end(), false), sign > 0 ? 6 : 4);
    EXPECT_GT(r.totals.beyond, 0U);
  }
}

TEST(Framer, AClockThatStandsAtItsEndMakesNoMoreFramesThanItsTagsNeed) {
  std::vector<Tag> tags = TagStream{}.make();
  const std::size_t before = framed(tags).frames.size();
  tags.insert(tags.end(), 3 << 20, photon_tag(std::numeric_limits<std::int64_t>::max(), 1));
  const Framed r = framed(tags);
  expect_sums_close(r, tags.size());
  EXPECT_EQ(r.totals.unplaced, 0U);
  EXPECT_EQ(r.frames.size(), before + 3);
}

TEST(Framer, SingleTimesBeyondTheRangeAreLateAlone) {
  std::vector<Tag> tags = TagStream{}.make();
  const std::size_t before = framed(tags).frames.size();
  for (std::size_t at = 100; at < tags.size(); at += 100) {
    tags[at].time_ps = std::numeric_limits<std::int64_t>::min();
  }
  const Framed r = framed(tags);
  expect_sums_close(r, tags.size());
  EXPECT_EQ(r.frames.size(), before);
  EXPECT_EQ(r.totals.late, (tags.size() - 1) / 100);
  EXPECT_EQ(r.totals.beyond + r.totals.resets, 0U);
}

TEST(Framer, ALongGapIsALossAndFramingStartsAnew) {
  std::vector<Tag> tags = without(TagStream{}.make(), 25 * ms, 1'000 * ms);
  TagStream later;
  later.begin_ps = 100 * second + 777;
  for (const Tag& tag : later.make()) tags.push_back(tag);
  const Framed r = framed(tags);
  expect_sums_close(r, tags.size());
  expect_frames_whole(r);
  EXPECT_EQ(r.totals.jumps, 1U);
  EXPECT_EQ(r.totals.late, 0U);
  ASSERT_EQ(r.frames.size(), 13U);
  EXPECT_NEAR(r.frames[2].seen_fraction, 0.5, 0.01);
  EXPECT_EQ(r.frames[2].losses[0].end_ps, r.frames[2].end_ps);
  EXPECT_NEAR(double(r.frames[3].start_ps - later.begin_ps), 0, 60);
  EXPECT_TRUE(r.frames[3].sync.locked);
}

TEST(Framer, AStrayFarAheadCostsItselfAlone) {
  for (const std::int64_t ahead : {2 * ms, 50 * ms, 3 * second, 8'000'000 * second}) {
    std::vector<Tag> tags = TagStream{}.make();
    const auto at =
        std::find_if(tags.begin(), tags.end(), [](const Tag& t) { return t.time_ps > 19 * ms; });
    tags.insert(at, photon_tag(19 * ms + ahead, 1));
    const Framed r = framed(tags);
    expect_sums_close(r, tags.size());
    expect_seamless(r);
    EXPECT_EQ(r.totals.late, 1U) << ahead;
    EXPECT_EQ(r.frames.size(), 10U);
  }
}

TEST(Framer, TimesNearTheEndOf64BitsAreStray) {
  std::vector<Tag> tags = TagStream{}.make();
  constexpr std::int64_t most = std::numeric_limits<std::int64_t>::max();
  for (const std::int64_t t : {most, -most - 1, most - 1000}) {
    tags.insert(tags.begin() + 3000, photon_tag(t, 1));
    tags.insert(tags.begin() + 3000, {t, 0, TagKind::heartbeat, {}});
    tags.insert(tags.begin() + 3000, {t, 5, TagKind::loss_end, {}});
  }
  const Framed r = framed(tags);
  expect_sums_close(r, events_in(tags));
  EXPECT_EQ(r.totals.late, 3U);
  EXPECT_EQ(r.totals.reported, 15U);
  expect_seamless(r);
}

TEST(Framer, SixteenTagsBackSetTheClockAnew) {
  std::vector<Tag> tags = without(TagStream{}.make(), 45 * ms, 1'000 * ms);
  const std::size_t before = tags.size();
  TagStream again;
  again.seed = 2;
  for (const Tag& tag : again.make()) tags.push_back(tag);
  const Framed r = framed(tags);
  expect_sums_close(r, tags.size());
  expect_frames_whole(r);
  EXPECT_EQ(r.totals.resets, 1U);
  EXPECT_EQ(r.totals.late, 15U);
  ASSERT_EQ(r.frames.size(), 15U);
  EXPECT_NEAR(r.frames[4].seen_fraction, 0.5, 0.02);
  EXPECT_NEAR(double(r.frames[5].start_ps), double(tags[before + 15].time_ps), period_ps + 50);
  EXPECT_TRUE(r.frames[5].sync.locked);
}

TEST(Framer, LateTagsAmongGoodOnesDoNotSetTheClock) {
  TagStream stream;
  stream.syncs = false;
  stream.markers_per_ms = 0;
  std::vector<Tag> tags = stream.make();
  for (std::size_t i = 0; i < 40; ++i) {
    tags.insert(tags.begin() + 6'000 + 3 * std::ptrdiff_t(i), photon_tag(ms + std::int64_t(i), 1));
  }
  const Framed r = framed(tags);
  expect_sums_close(r, tags.size());
  EXPECT_EQ(r.totals.late, 40U);
  EXPECT_EQ(r.totals.resets, 0U);
  expect_seamless(r);
}

TEST(Framer, ALossGoesOnWhenTheClockIsSetAnew) {
  std::vector<Tag> tags = without(TagStream{}.make(), 45 * ms, 1'000 * ms);
  tags.push_back({45 * ms, 0, TagKind::loss_begin, {}});
  tags.push_back({45 * ms, 0, TagKind::clock_break, {}});
  tags.push_back(heartbeat_tag(0));
  tags.push_back({2 * ms, 3, TagKind::loss_end, {}});
  for (const Tag& tag : without(TagStream{}.make(), 0, 2 * ms)) tags.push_back(tag);
  const Framed r = framed(tags);
  expect_sums_close(r, events_in(tags));
  expect_frames_whole(r);
  EXPECT_NEAR(r.frames[4].seen_fraction, 0.5, 0.01);
  EXPECT_NEAR(r.frames[5].seen_fraction, 0.8, 0.02);
  EXPECT_EQ(r.frames[5].lost_tags, 3U);
}

// What was missing in the old clock is over with it: nobody may ever say its end.
TEST(Framer, AnOpenLossEndsWithTheClockThatItBeganIn) {
  for (const bool is_said : {true, false}) {
    std::vector<Tag> tags = without(TagStream{}.make(), 45 * ms, 1'000 * ms);
    tags.push_back({45 * ms, 0, TagKind::loss_begin, {}});
    if (is_said) tags.push_back({45 * ms, 0, TagKind::clock_break, {}});
    for (const Tag& tag : TagStream{}.make()) tags.push_back(tag);
    const Framed r = framed(tags);
    expect_sums_close(r, events_in(tags));
    expect_frames_whole(r);
    ASSERT_EQ(r.frames.size(), 15U);
    EXPECT_NEAR(r.frames[4].seen_fraction, 0.5, 0.02);
    for (std::size_t i = 6; i < 14; ++i) EXPECT_EQ(r.frames[i].seen_fraction, 1) << i;
  }
}

TEST(Framer, ALossWhoseEndIsNoTimeEndsAtTheTagBefore) {
  std::vector<Tag> tags = TagStream{}.make();
  const auto after = [&](std::int64_t time_ps) {
    return std::find_if(tags.begin(), tags.end(),
                        [&](const Tag& tag) { return tag.time_ps > time_ps; });
  };
  constexpr std::int64_t no_time = std::numeric_limits<std::int64_t>::max() - 5;
  tags.insert(after(14 * ms), Tag{no_time, -1, TagKind::loss_end, {}});
  insert_sorted(tags, {12 * ms, 0, TagKind::loss_begin, {}});
  const Framed r = framed(tags);
  expect_sums_close(r, events_in(tags));
  EXPECT_NEAR(r.frames[1].seen_fraction, 0.8, 0.01);
  for (std::size_t i = 2; i < r.frames.size() - 1; ++i) EXPECT_EQ(r.frames[i].seen_fraction, 1);
}

TEST(Framer, AClockBreakSetsTheClockAnewAtOnce) {
  std::vector<Tag> tags = without(TagStream{}.make(), 45 * ms, 1'000 * ms);
  tags.push_back({45 * ms, 0, TagKind::clock_break, {}});
  TagStream again;
  again.seed = 2;
  for (const Tag& tag : again.make()) tags.push_back(tag);
  const Framed r = framed(tags);
  expect_sums_close(r, events_in(tags));
  expect_frames_whole(r);
  EXPECT_EQ(r.totals.resets, 1U);
  EXPECT_EQ(r.totals.late, 0U);
  EXPECT_EQ(r.frames.size(), 15U);
}

TEST(Framer, ALossIsClippedToItsFramesAndCountedWhereItEnds) {
  std::vector<Tag> tags = without(TagStream{}.make(), 17 * ms, 34 * ms);
  insert_sorted(tags, {17 * ms, 0, TagKind::loss_begin, {}});
  insert_sorted(tags, {34 * ms, 1234, TagKind::loss_end, {}});
  const Framed r = framed(tags);
  expect_sums_close(r, events_in(tags));
  expect_frames_whole(r);
  expect_seamless(r);
  EXPECT_EQ(r.totals.reported, 1234U);
  EXPECT_NEAR(r.frames[1].seen_fraction, 0.7, 1e-6);
  EXPECT_EQ(r.frames[2].seen_fraction, 0);
  EXPECT_NEAR(r.frames[3].seen_fraction, 0.6, 1e-6);
  EXPECT_EQ(r.frames[1].lost_tags, 0U);
  EXPECT_EQ(r.frames[3].lost_tags, 1234U);
  EXPECT_EQ(r.frames[3].losses[0], (Loss{r.frames[3].start_ps, 34 * ms, 1234}));
}

TEST(Framer, AnEndWithoutABeginningReachesBack) {
  std::vector<Tag> tags = TagStream{}.make();
  insert_sorted(tags, {13 * ms, 5, TagKind::loss_end, {}});
  insert_sorted(tags, {16 * ms, -1, TagKind::loss_end, {}});
  const Framed r = framed(tags);
  ASSERT_EQ(r.frames[1].losses.size(), 1U);  // they touch
  EXPECT_EQ(r.frames[1].losses[0].begin_ps, r.frames[1].start_ps);
  EXPECT_EQ(r.frames[1].losses[0].end_ps, 16 * ms);
  EXPECT_EQ(r.frames[1].lost_tags, 5U);
  expect_sums_close(r, events_in(tags));
}

// As of a sender whose block numbers have a gap, but whose times have none.
TEST(Framer, ALossOfNobodyKnowsHowManyIsToldWhereItEnds) {
  std::vector<Tag> tags = TagStream{}.make();
  insert_sorted(tags, {13 * ms, 0, TagKind::loss_begin, {}});
  insert_sorted(tags, {13 * ms, -1, TagKind::loss_end, {}});
  insert_sorted(tags, {36 * ms, -1, TagKind::missed, {}});
  const Framed r = framed(tags);
  expect_sums_close(r, events_in(tags));
  EXPECT_EQ(r.totals.uncounted, 2U);
  for (std::size_t i = 0; i < r.frames.size(); ++i) {
    EXPECT_EQ(r.frames[i].uncounted_losses, i == 1 || i == 3 ? 1U : 0U) << i;
  }
}

TEST(Framer, MissedTagsAreALossSinceTheTagBefore) {
  std::vector<Tag> tags = without(TagStream{}.make(), 13 * ms, 14 * ms);
  insert_sorted(tags, {14 * ms, 70, TagKind::missed, {}});
  const Framed r = framed(tags);
  expect_sums_close(r, events_in(tags));
  EXPECT_EQ(r.frames[1].lost_tags, 70U);
  ASSERT_EQ(r.frames[1].losses.size(), 1U);
  EXPECT_EQ(r.frames[1].losses[0].count, 70);
  EXPECT_EQ(r.frames[1].losses[0].end_ps, 14 * ms);
  EXPECT_NEAR(r.frames[1].seen_fraction, 0.9, 0.01);
}

TEST(Framer, ALossOpenAtTheEndCoversTheRest) {
  std::vector<Tag> tags = without(TagStream{}.make(), 15 * ms, 1'000 * ms);
  tags.push_back({15 * ms, 0, TagKind::loss_begin, {}});
  const Framed r = framed(tags);
  ASSERT_EQ(r.frames.size(), 2U);
  EXPECT_NEAR(r.frames[1].seen_fraction, 0.5, 1e-6);
  EXPECT_EQ(r.frames[1].losses.size(), 1U);
}

TEST(Framer, PhotonsBeyondTheFramesRoomAreALoss) {
  const std::vector<Tag> tags = TagStream{}.make();
  FrameCapacity capacity = room_enough;
  capacity.photons = 500;
  const Framed r = framed(tags, 100, capacity);
  expect_sums_close(r, tags.size());
  expect_frames_whole(r);
  expect_seamless(r);
  EXPECT_NEAR(double(r.totals.surplus), 5'000, 1);
  EXPECT_NEAR(r.frames[0].seen_fraction, 0.5, 0.1);
  ASSERT_EQ(r.frames[0].losses.size(), 1U);
  EXPECT_EQ(r.frames[0].losses[0].end_ps, r.frames[0].end_ps);
  EXPECT_EQ(std::uint64_t(r.frames[0].losses[0].count), r.frames[0].lost_tags);
}

TEST(Framer, SyncsAndMarkersBeyondTheFramesRoomAreCounted) {
  const std::vector<Tag> tags = TagStream{}.make();
  FrameCapacity capacity = room_enough;
  capacity.syncs = 50;
  capacity.markers = 3;
  const Framed r = framed(tags, 100, capacity);
  expect_sums_close(r, tags.size());
  expect_frames_whole(r);
  EXPECT_EQ(r.totals.syncs, 500U);
}

}  // namespace
}  // namespace splid
