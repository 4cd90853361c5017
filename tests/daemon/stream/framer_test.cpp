#include "daemon/stream/framer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <random>

#include "tests/support/framed.hpp"

namespace splid {
namespace {

using namespace test;

TEST(Framer, CutsACleanStreamIntoWholePeriods) {
  const std::vector<Tag> tags = TagStream{}.make();
  const Framed r = framed(tags);
  ASSERT_EQ(r.frames.size(), 10U);
  expect_sums_close(r, tags.size());
  expect_frames_whole(r);
  expect_seamless(r);
  EXPECT_EQ(r.totals.late, 0U);
  for (std::size_t i = 0; i < 10; ++i) {
    const Frame& frame = r.frames[i];
    EXPECT_NEAR(double(frame.start_ps), double(i) * 10 * ms, 60);
    EXPECT_NEAR(double(frame.end_ps - frame.start_ps), 10 * ms, 60);
    EXPECT_TRUE(frame.sync.locked);
    EXPECT_NEAR(frame.sync.period_ps, period_ps, 1);
    EXPECT_NEAR(double(frame.photons_ps.size()), 1000, 150);
    EXPECT_EQ(frame.arrival_ns, 1);
  }
  EXPECT_EQ(r.frames[3].seen_fraction, 1);
}

TEST(Framer, TakesPeriodsThatDoNotDivideTheLength) {
  TagStream stream;
  stream.period_ps = 3'780'000;
  stream.begin_ps = 340'000'000'000'000'123;
  const std::vector<Tag> tags = stream.make();
  const Framed r = framed(tags, 777, room_enough, {10, 3'780'000, DriftMethod::regression, 8192});
  expect_sums_close(r, tags.size());
  expect_frames_whole(r);
  expect_seamless(r);
  ASSERT_GE(r.frames.size(), 10U);
  // 10 ms is 2645.5 periods: 2646 or 2645 of them, always the same number.
  for (std::size_t i = 0; i + 1 < r.frames.size(); ++i) {
    EXPECT_NEAR(double(r.frames[i].end_ps - r.frames[i].start_ps), 2646 * 3'780'000.0, 60);
    EXPECT_LE(r.frames[i].sync.missing, 0U);
  }
  EXPECT_NEAR(double(r.frames[0].start_ps - stream.begin_ps), 0, 60);
}

TEST(Framer, FollowsADriftingPattern) {
  for (const double ppm : {0.0, 1.0, 30.0, 100.0, -100.0}) {
    TagStream stream;
    stream.period_ps = period_ps * (1 + ppm * 1e-6);
    const std::vector<Tag> tags = stream.make();
    const Framed r = framed(tags);
    expect_sums_close(r, tags.size());
    expect_seamless(r);
    ASSERT_GE(r.frames.size(), 10U);
    for (std::size_t i = 0; i + 1 < r.frames.size(); ++i) {
      const Frame& frame = r.frames[i];
      EXPECT_TRUE(frame.sync.locked);
      // On the true grid, to within the jitter of the fit.
      EXPECT_NEAR(std::remainder(double(frame.end_ps), stream.period_ps), 0, 20) << ppm;
      EXPECT_NEAR(frame.sync.drift_ppm, ppm, 0.05);
    }
  }
}

TEST(Framer, TheFirstFrameStartsOnTheGridBeforeItsFirstTag) {
  std::vector<Tag> tags = without(TagStream{}.make(), 0, period_ps * 5 / 2);
  tags.insert(tags.begin(), photon_tag(period_ps * 5 / 4, 1));  // then a sync at 3 periods
  const Framed r = framed(tags);
  EXPECT_NEAR(double(r.frames[0].start_ps), period_ps, 50);
  ASSERT_EQ(r.frames[0].losses.size(), 1U);
  EXPECT_EQ(r.frames[0].losses[0].begin_ps, r.frames[0].start_ps);
  EXPECT_EQ(r.frames[0].losses[0].end_ps, period_ps * 5 / 4);
  EXPECT_NEAR(double(r.frames[0].end_ps), period_ps * 101, 50);
  expect_sums_close(r, tags.size());
}

TEST(Framer, WithoutSyncsFramesHaveTheirNominalLength) {
  TagStream stream;
  stream.syncs = false;
  stream.begin_ps = 5;
  const std::vector<Tag> tags = stream.make();
  const Framed r = framed(tags);
  expect_sums_close(r, tags.size());
  expect_frames_whole(r);
  expect_seamless(r);
  EXPECT_EQ(r.frames[0].start_ps, tags.front().time_ps);
  ASSERT_GE(r.frames.size(), 10U);
  for (const auto& frame : r.frames.frames) {
    EXPECT_EQ(frame->end_ps - frame->start_ps, 10 * ms);
    EXPECT_FALSE(frame->sync.locked);
  }
}

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

TEST(Framer, SyncsThatComeLaterPutTheFramesOnTheGrid) {
  std::vector<Tag> tags = TagStream{}.make();
  std::erase_if(tags,
                [](const Tag& t) { return t.kind == TagKind::sync && t.time_ps < 25 * ms + 5; });
  insert_sorted(tags, photon_tag(12'345'678, 1));
  const Framed r = framed(tags);
  expect_sums_close(r, tags.size());
  expect_seamless(r);
  EXPECT_FALSE(r.frames[0].sync.locked);
  ASSERT_GE(r.frames.size(), 10U);
  for (std::size_t i = 2; i + 1 < r.frames.size(); ++i) {
    EXPECT_TRUE(r.frames[i].sync.locked);
    EXPECT_NEAR(std::remainder(double(r.frames[i].end_ps), double(period_ps)), 0, 50);
  }
}

TEST(Framer, AFrameWithOneSyncStaysOnTheGrid) {
  std::vector<Tag> tags = TagStream{}.make();
  std::erase_if(tags, [](const Tag& t) {
    return t.kind == TagKind::sync && t.time_ps > 30 * ms + period_ps && t.time_ps < 39 * ms;
  });
  const Framed r = framed(tags);
  expect_seamless(r);
  ASSERT_GE(r.frames.size(), 10U);
  for (std::size_t i = 0; i + 1 < r.frames.size(); ++i) {
    EXPECT_NEAR(std::remainder(double(r.frames[i].end_ps), double(period_ps)), 0, 50);
  }
}

TEST(Framer, HeartbeatsCloseFramesInTheDark) {
  std::vector<Tag> tags;
  for (std::int64_t t = 0; t <= 100 * ms; t += 5 * ms) tags.push_back(heartbeat_tag(t));
  const Framed r = framed(tags);
  expect_sums_close(r, 0);
  expect_seamless(r);
  EXPECT_EQ(r.frames.size(), 9U);  // 100 ms is not past the tenth's end yet
  EXPECT_EQ(r.frames[0].photons_ps.size(), 0U);
  EXPECT_EQ(r.frames[0].seen_fraction, 1);
}

TEST(Framer, AHeartbeatClosesTheFrameWithoutWaitingForAnyTag) {
  FrameList frames(room_enough);
  const ChannelMap channels{ChannelOptions{}};
  Framer framer(options_of_10_ms(), channels, frames);
  framer.push(std::vector<Tag>{photon_tag(0, 1), heartbeat_tag(10 * ms + 1'000'000)}, 7);
  EXPECT_EQ(frames.size(), 1U);
}

TEST(Framer, TagsOutOfOrderByAMicrosecondAreInTheirFrame) {
  TagStream stream;
  stream.photons_per_ms = 20'000;
  stream.length_ms = 30;
  // Each tag comes up to 0.95 us after its time.
  std::mt19937_64 random(3);
  std::vector<std::pair<std::int64_t, Tag>> arrivals;
  for (const Tag& tag : stream.make()) {
    arrivals.emplace_back(tag.time_ps + std::int64_t(random() % 950'000), tag);
  }
  std::ranges::stable_sort(arrivals, {}, &std::pair<std::int64_t, Tag>::first);
  std::vector<Tag> tags;
  for (const auto& arrival : arrivals) tags.push_back(arrival.second);
  const Framed r = framed(tags);
  expect_sums_close(r, tags.size());
  expect_frames_whole(r);
  EXPECT_EQ(r.totals.late, 0U);
}

// A cable's 400 ns on the second input: frames are those of a detector without it, but for the
// order of their photons.
TEST(Framer, AnInputsDelayIsTakenOffItsPhotons) {
  constexpr std::int64_t delay_ps = 400'000;
  std::vector<Tag> tags = TagStream{}.make();
  for (std::size_t i = 0; i < tags.size(); i += 2) {
    if (tags[i].kind == TagKind::photon) tags[i].value = 2;
  }
  const ChannelOptions both{{"1", "2"}};
  const Framed without = framed(tags, 777, room_enough, options_of_10_ms(), both);
  for (Tag& tag : tags) {
    if (tag.kind == TagKind::photon && tag.value == 2) tag.time_ps += delay_ps;
  }
  std::stable_sort(tags.begin(), tags.end(),
                   [](const Tag& a, const Tag& b) { return a.time_ps < b.time_ps; });
  ChannelOptions late = both;
  late.delays_ps = {0, delay_ps};
  for (const std::size_t block : {std::size_t{777}, std::size_t{100'000}}) {
    Framed with = framed(tags, block, room_enough, options_of_10_ms(), late);
    expect_sums_close(with, tags.size());
    ASSERT_EQ(with.frames.size(), without.frames.size());
    EXPECT_EQ(with.totals.late, 0U);
    for (std::size_t k = 0; k < with.frames.size(); ++k) {
      EXPECT_EQ(with.frames[k].start_ps, without.frames[k].start_ps);
      const auto photons = [](const Frame& frame) {
        std::vector<std::int64_t> sorted(frame.photons_ps.begin(), frame.photons_ps.end());
        std::sort(sorted.begin(), sorted.end());
        return sorted;
      };
      EXPECT_EQ(photons(with.frames[k]), photons(without.frames[k])) << k;
    }
  }
}

// The walk of each input is taken off, whatever the blocks are.
TEST(Framer, AnInputsTimingWalkIsTakenOffItsPhotons) {
  const std::vector<Tag> tags = TagStream{}.make();
  FramerOptions options = options_of_10_ms();
  options.walk = {{100'000, 700}};
  std::vector<std::int64_t> expected;
  TimingWalk walk(options.walk, 1);
  for (const Tag& tag : tags) {
    if (tag.kind == TagKind::photon) expected.push_back(walk.without(tag.time_ps, 0));
  }
  for (const std::size_t block : {std::size_t{777}, std::size_t{100'000}}) {
    const Framed r = framed(tags, block, room_enough, options);
    expect_sums_close(r, tags.size());
    EXPECT_EQ(r.totals.late, 0U);
    std::vector<std::int64_t> photons;
    for (const auto& frame : r.frames.frames) {
      photons.insert(photons.end(), frame->photons_ps.begin(), frame->photons_ps.end());
    }
    std::sort(photons.begin(), photons.end());
    std::sort(expected.begin(), expected.end());
    EXPECT_EQ(photons, expected);
  }
}

// Input 7 gets a quarter of the light, and the delay of its tags moves some to other frames.
TEST(Framer, ThePhotonsOfEachInputAreCounted) {
  TagStream stream;
  stream.others_per_ms = stream.photons_per_ms / 3;
  std::vector<Tag> tags = stream.make();
  for (const double delay_ps : {0.0, 400'000.0}) {
    const ChannelOptions two{{"7", "1"}, "sync", "marker:1", {delay_ps, 0}};
    for (const std::size_t photons : {std::size_t{1} << 16, std::size_t{500}}) {
      for (const std::size_t block : {std::size_t{1}, std::size_t{777}, std::size_t{100'000}}) {
        const Framed r =
            framed(tags, block, {photons, 1 << 15, 1 << 10, 64}, options_of_10_ms(), two);
        expect_frames_whole(r);
        for (std::size_t k = 0; k < r.frames.size(); ++k) {
          const Frame& frame = r.frames[k];
          const auto of_input = frame.view().photons_of_input;
          ASSERT_EQ(of_input.size(), 2U);
          if (frame.photons_ps.size() == photons) continue;  // not all of them had room
          const auto others = std::count_if(tags.begin(), tags.end(), [&](const Tag& tag) {
            return tag.kind == TagKind::photon && tag.value == 7 &&
                   inside(frame, tag.time_ps - std::llround(delay_ps));
          });
          EXPECT_EQ(of_input[0], static_cast<std::uint64_t>(others)) << k;
        }
      }
    }
  }
  EXPECT_TRUE(framed(tags).frames[1].view().photons_of_input.empty());
}

TEST(Framer, LaterThanThatIsCountedLate) {
  std::vector<Tag> tags = TagStream{}.make();
  const auto at =
      std::find_if(tags.begin(), tags.end(), [](const Tag& t) { return t.time_ps > 12 * ms; });
  tags.insert(at, photon_tag(9 * ms, 1));
  const Framed r = framed(tags);
  expect_sums_close(r, tags.size());
  EXPECT_EQ(r.totals.late, 1U);
  EXPECT_EQ(r.frames[1].lost_tags, 1U);
  EXPECT_EQ(r.totals.resets, 0U);
}

// A detector may be blind at a frame's start from a photon of the frame before.
TEST(Framer, AFrameKnowsTheLastPhotonsBeforeIt) {
  const Framed r = framed(TagStream{}.make());
  EXPECT_TRUE(r.frames[0].before_ps.empty());
  ASSERT_GE(r.frames.size(), 10U);
  for (std::size_t i = 1; i < r.frames.size(); ++i) {
    const auto before = r.frames[i - 1].photons_ps.view();
    const auto known = r.frames[i].before_ps.view();
    ASSERT_EQ(known.size(), 64U);
    EXPECT_TRUE(std::equal(known.begin(), known.end(), before.end() - 64));
    EXPECT_EQ(r.frames[i].view().before_ps.back(), before.back());
  }
}

// 30 photons a frame: those of the last frames but one are known too.
TEST(Framer, AFrameAfterFramesOfFewPhotonsKnowsThoseOfSeveral) {
  TagStream stream;
  stream.photons_per_ms = 3;
  std::vector<std::int64_t> all;
  const Framed r = framed(stream.make());
  ASSERT_GE(r.frames.size(), 10U);
  for (std::size_t i = 0; i < r.frames.size(); ++i) {
    const auto known = r.frames[i].before_ps.view();
    ASSERT_EQ(known.size(), std::min<std::size_t>(all.size(), 64));
    EXPECT_TRUE(std::equal(known.rbegin(), known.rend(), all.rbegin()));
    const auto photons = r.frames[i].photons_ps.view();
    all.insert(all.end(), photons.begin(), photons.end());
  }
}

TEST(Framer, AfterALongGapNoPhotonIsKnownFromBefore) {
  TagStream late;
  late.begin_ps = 60 * second;
  std::vector<Tag> tags = TagStream{}.make();
  const std::vector<Tag> more = late.make();
  tags.insert(tags.end(), more.begin(), more.end());
  const Framed r = framed(tags);
  ASSERT_GE(r.frames.size(), 20U);
  std::size_t without_before = 0;
  for (std::size_t i = 0; i < r.frames.size(); ++i) {
    const auto known = r.frames[i].before_ps.view();
    for (const std::int64_t photon_ps : known) EXPECT_LT(r.frames[i].start_ps - photon_ps, second);
    without_before += known.empty() ? 1 : 0;
  }
  EXPECT_EQ(without_before, 2U);  // the first of each part
}

TEST(Framer, AShortGapGivesEmptyFrames) {
  const std::vector<Tag> tags = without(TagStream{}.make(), 21 * ms, 68 * ms);
  const Framed r = framed(tags);
  expect_sums_close(r, tags.size());
  expect_seamless(r);
  EXPECT_EQ(r.frames.size(), 10U);
  EXPECT_EQ(r.frames[4].photons_ps.size(), 0U);
  EXPECT_EQ(r.totals.jumps, 0U);
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

TEST(Framer, TheFirstTagsAfterAGapMayBeOutOfOrder) {
  std::vector<Tag> tags = without(TagStream{}.make(), 25 * ms, 1'000 * ms);
  tags.push_back(photon_tag(5 * second + 500'000, 1));
  tags.push_back(photon_tag(5 * second, 1));
  const Framed r = framed(tags);
  expect_sums_close(r, tags.size());
  expect_frames_whole(r);
  EXPECT_EQ(r.totals.late, 0U);
  EXPECT_EQ(r.frames[3].start_ps, 5 * second);
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

TEST(Framer, TheLastFrameSaysHowFarItWent) {
  const std::vector<Tag> tags = without(TagStream{}.make(), 64 * ms, 1'000 * ms);
  const Framed r = framed(tags);
  expect_sums_close(r, tags.size());
  expect_frames_whole(r);
  ASSERT_EQ(r.frames.size(), 7U);
  EXPECT_NEAR(r.frames[6].seen_fraction, 0.4, 0.01);
  EXPECT_NEAR(double(r.frames[6].end_ps), 70.0 * ms, 50);
  EXPECT_EQ(r.frames[6].losses[0].begin_ps, tags.back().time_ps + 1);
  EXPECT_EQ(r.frames[6].losses[0].end_ps, r.frames[6].end_ps);
}

TEST(Framer, NothingInNothingOut) {
  EXPECT_EQ(framed({}).frames.size(), 0U);
  EXPECT_EQ(framed({heartbeat_tag(5)}).frames.size(), 0U);
  const Framed one = framed({photon_tag(5, 1)});
  EXPECT_EQ(one.frames.size(), 1U);
  expect_sums_close(one, 1);
}

TEST(Framer, GoesOnAfterFinish) {
  FrameList frames(room_enough);
  const ChannelMap channels{ChannelOptions{}};
  Framer framer(options_of_10_ms(), channels, frames);
  framer.push(std::vector<Tag>{heartbeat_tag(0)}, 1);
  framer.finish();
  framer.push(TagStream{}.make(), 1);
  framer.finish();
  EXPECT_EQ(frames.size(), 10U);
  EXPECT_EQ(frames.opened, 10);
}

TEST(Framer, IgnoredChannelsAreCountedAndMoveTheClock) {
  TagStream stream;
  stream.photons_per_ms = 0;
  stream.others_per_ms = 500;
  const std::vector<Tag> tags = stream.make();
  const Framed r = framed(tags, 333);
  expect_sums_close(r, tags.size());
  EXPECT_EQ(r.totals.ignored, 50'000U);
  EXPECT_EQ(r.frames.size(), 10U);
}

TEST(Framer, ATagThatIsSyncAndMarkerIsBoth) {
  FrameList frames(room_enough);
  const ChannelMap channels{ChannelOptions{{"1"}, "marker:2", "marker:1"}};
  Framer framer(options_of_10_ms(), channels, frames);
  std::vector<Tag> tags;
  for (int i = 0; i < 50; ++i) tags.push_back(marker_tag(i * period_ps, i % 3 == 0 ? 3 : 2));
  framer.push(tags, 1);
  framer.finish();
  EXPECT_EQ(framer.totals().syncs, 50U);
  EXPECT_EQ(framer.totals().markers, 17U);
  EXPECT_EQ(framer.totals().shared, 17U);
  EXPECT_EQ(frames[0].markers[0].bits, 3);
}

TEST(Framer, SaysWhenTheSyncsHaveAnotherPeriod) {
  TagStream stream;
  stream.period_ps = 99'000'000;
  const Framed r = framed(stream.make());
  ASSERT_TRUE(r.diagnosis);
  EXPECT_EQ(r.diagnosis->pattern_period_ps, period_ps);
  ASSERT_TRUE(r.diagnosis->sync_period_ps);
  EXPECT_NEAR(*r.diagnosis->sync_period_ps, 99'000'000, 20);
  EXPECT_GE(r.diagnosis->syncs, 16U);
  EXPECT_FALSE(framed(TagStream{}.make()).diagnosis);
}

}  // namespace
}  // namespace splid
