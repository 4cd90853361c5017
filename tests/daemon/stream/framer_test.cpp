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

// A detector may be dead at a frame's start from a photon of the frame before.
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
  for (std::size_t n = 0; n < frames.size(); ++n) EXPECT_EQ(frames[n].is_cut_off, n == 9) << n;
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
