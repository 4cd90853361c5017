#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <random>

#include "daemon/stream/framer.hpp"
#include "tests/support/allocation_count.hpp"
#include "tests/support/framed.hpp"
#include "tests/support/real_recording.hpp"
#include "tests/support/sanitized.hpp"

// The framer under every fault at once, without memory, and on real recordings.

namespace splid {
namespace {

using namespace test;

// A stream with every fault at random places.
std::vector<Tag> faulty_stream(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto pick = [&](std::int64_t n) { return std::int64_t(random() % std::uint64_t(n)); };
  constexpr std::int64_t begins[] = {0, 340'000'000'000'000'000, -5'000'000'000'000};
  TagStream stream;
  stream.seed = seed;
  stream.begin_ps = begins[seed % 3];
  stream.period_ps = period_ps * (1 + double(pick(101)) * 1e-6);
  stream.sync_missing = seed % 4 == 1 ? 0.3 : 0;
  stream.syncs = seed % 11 != 5;
  stream.others_per_ms = double(pick(50));
  stream.photons_per_ms = double(pick(300));
  std::vector<Tag> tags = stream.make();
  const auto somewhere = [&] { return tags.begin() + pick(std::int64_t(tags.size())); };
  const auto insert = [&](auto make) {
    const auto at = somewhere();
    const std::int64_t now = at->time_ps;
    tags.insert(at, make(now));
  };
  for (int fault = 0; fault < 12; ++fault) {
    const std::int64_t off = pick(30 * ms);
    switch (pick(9)) {
      case 0:
        insert([&](auto t) { return photon_tag(t - off, 1); });
        break;
      case 1:
        insert([&](auto t) { return photon_tag(t + off / ms * off, 1); });
        break;
      case 2:
        insert([&](auto t) { return Tag{t, 0, TagKind::loss_begin, {}}; });
        break;
      case 3:
        insert([&](auto t) { return Tag{t, int(pick(9)) - 1, TagKind::loss_end, {}}; });
        break;
      case 4:
        insert([&](auto t) { return Tag{t, int(pick(9)) - 1, TagKind::missed, {}}; });
        break;
      case 5:
        insert([&](auto t) { return heartbeat_tag(t + pick(ms) - ms / 2); });
        break;
      case 6: {  // the clock steps, forward or back, said or not
        const auto at = somewhere();
        const std::int64_t step = (pick(7) - 3) * second / 2;
        for (auto tag = at; tag != tags.end(); ++tag) tag->time_ps += step;
        if (pick(2) == 0) tags.insert(at, Tag{0, 0, TagKind::clock_break, {}});
        break;
      }
      case 7: {  // doubled syncs
        const auto at = somewhere();
        const Tag tag = *at;
        if (tag.kind == TagKind::sync) tags.insert(at, tag);
        break;
      }
      default: {  // a gap
        const auto at = somewhere();
        tags.erase(at, at + std::min<std::int64_t>(pick(3000), tags.end() - at));
        if (tags.empty()) tags.push_back(sync_tag(0));
      }
    }
  }
  return tags;
}

// Each tag of the frames is a tag of the stream, and used at most as often as it was there.
void expect_no_tag_twice(const Framed& r, const std::vector<Tag>& tags) {
  std::map<std::int64_t, int> photons;
  for (const Tag& tag : tags) {
    if (tag.kind == TagKind::photon && tag.value == 1) ++photons[tag.time_ps];
  }
  for (const auto& frame : r.frames.frames) {
    for (const std::int64_t t : frame->photons_ps.view()) ASSERT_GE(--photons[t], 0);
  }
}

TEST(Framer, SumsCloseUnderEveryFault) {
  for (int seed = 1; seed <= test::times(300); ++seed) {
    SCOPED_TRACE(seed);
    const std::vector<Tag> tags = faulty_stream(seed);
    FrameCapacity capacity = room_enough;
    capacity.photons = seed % 5 == 0 ? 700 : 10'000;
    capacity.syncs = seed % 7 == 0 ? 60 : 1'000;
    capacity.losses = seed % 3 == 0 ? 2 : 64;
    const Framed r = framed(tags, 4096, capacity);
    expect_sums_close(r, events_in(tags));
    expect_frames_whole(r);
    expect_no_tag_twice(r, tags);
    if (r.totals.resets + r.totals.jumps == 0) expect_seamless(r);
    if (testing::Test::HasFailure()) break;
  }
}

TEST(Framer, HowTheStreamIsCutIntoBlocksChangesNothing) {
  for (int seed = 1; seed <= test::times(40); ++seed) {
    SCOPED_TRACE(seed);
    const std::vector<Tag> tags = faulty_stream(seed);
    FrameCapacity capacity = room_enough;
    capacity.photons = seed % 5 == 0 ? 700 : 10'000;
    const Framed whole = framed(tags, tags.size(), capacity);
    expect_same(whole, framed(tags, 1, capacity));
    expect_same(whole, framed(tags, 97, capacity));
    if (testing::Test::HasFailure()) break;
  }
}

// Syncs that are marker bits, on inputs where bit 1 is the encoder's marker and bit 2 the sync.
Framed framed_with_sync_bits(std::vector<Tag> tags, int bits, const FrameCapacity& capacity) {
  std::erase_if(tags, [](const Tag& t) { return t.kind == TagKind::marker; });
  for (Tag& tag : tags) {
    if (tag.kind == TagKind::sync) tag = marker_tag(tag.time_ps, bits);
  }
  ChannelOptions channels;
  channels.sync = "marker:2";
  channels.encoder = "marker:1";
  Framed r = framed(tags, 4096, capacity, options_of_10_ms(), channels);
  expect_sums_close(r, events_in(tags));
  for (auto& frame : r.frames.frames) frame->markers.clear();
  return r;
}

// Syncs that share their records with the encoder's marker are taken one by one, and others in runs
// with the photons: the frames are the same.
TEST(Framer, SyncsInRunsGiveTheFramesOfSyncsOneByOne) {
  for (int seed = 1; seed <= test::times(300); ++seed) {
    SCOPED_TRACE(seed);
    const std::vector<Tag> tags = faulty_stream(seed);
    FrameCapacity capacity = room_enough;
    capacity.photons = seed % 5 == 0 ? 700 : 10'000;
    capacity.syncs = capacity.markers = seed % 7 == 0 ? 60 : 300;
    const Framed in_runs = framed_with_sync_bits(tags, 2, capacity);
    const Framed one_by_one = framed_with_sync_bits(tags, 3, capacity);
    expect_same(in_runs, one_by_one);
    EXPECT_EQ(in_runs.totals.syncs, one_by_one.totals.syncs);
    EXPECT_EQ(in_runs.totals.ignored, one_by_one.totals.ignored);
    EXPECT_EQ(in_runs.totals.late, one_by_one.totals.late);
    EXPECT_EQ(in_runs.totals.surplus, one_by_one.totals.surplus);
    if (testing::Test::HasFailure()) break;
  }
}

TEST(Framer, NothingIsAllocatedAfterConstruction) {
  const ChannelMap channels{ChannelOptions{}};
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const std::vector<Tag> tags = faulty_stream(seed);
    FrameList frames(room_enough, true);
    Framer framer(options_of_10_ms(), channels, frames);
    const std::uint64_t before = test::allocations;
    framer.push(tags, 1);
    framer.finish();
    ASSERT_EQ(test::allocations - before, 0U) << seed;
    ASSERT_GT(frames.closed, 0);
  }
  const std::uint64_t before = test::allocations;
  const auto one = std::make_unique<Tag>();
  EXPECT_GT(test::allocations - before, 0U);  // the count does count
}

TEST(Framer, TheDiagnosisAllocatesNothing) {
  TagStream stream;
  stream.period_ps = 99'000'000;
  const std::vector<Tag> tags = stream.make();
  FrameList frames(room_enough, true);
  const ChannelMap channels{ChannelOptions{}};
  Framer framer(options_of_10_ms(), channels, frames);
  const std::uint64_t before = test::allocations;
  framer.push(tags, 1);
  EXPECT_EQ(test::allocations - before, 0U);
  EXPECT_TRUE(framer.diagnosis());
}

// The first sync moves the frame's start to before it, and must not move its end to before a
// photon.
TEST(Framer, WhatIsInAFrameStaysThereWhenItsStartMovesBack) {
  const Framed r = framed({photon_tag(0, 1), photon_tag(290'000'000, 1), sync_tag(150'000'000)}, 1,
                          room_enough, {0.3, double(period_ps), DriftMethod::regression, 64});
  expect_sums_close(r, 3);
  expect_frames_whole(r);
  ASSERT_EQ(r.frames.size(), 1U);
  EXPECT_EQ(r.frames[0].photons_ps.size(), 2U);
}

TEST(Framer, AStrayBeforeAnyFrameIsCounted) {
  const Framed r = framed({photon_tag(std::numeric_limits<std::int64_t>::min(), 1)});
  expect_sums_close(r, 1);
  EXPECT_EQ(r.frames.size(), 0U);
  EXPECT_EQ(r.totals.unplaced, 1U);
}

TEST(Framer, ARealRecordingGivesFramesThatLock) {
  const auto file = test::real_recording_path("qutag_sync_t2.ptu");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not here; set SPLID_DATA";
  const std::vector<Tag> tags = test::ptu_tags(file);
  const Framed r =
      framed(tags, 1000, room_enough, {50, 12'512.62584, DriftMethod::regression, 1 << 16});
  expect_sums_close(r, events_in(tags));
  expect_frames_whole(r);
  expect_seamless(r);
  ASSERT_EQ(r.frames.size(), 6U);
  EXPECT_EQ(r.totals.photons, 43'736U);
  EXPECT_EQ(r.totals.ignored, 62'437U);
  EXPECT_EQ(r.totals.syncs, 105'600U);
  EXPECT_EQ(r.totals.late, 0U);
  for (const auto& frame : r.frames.frames) {
    ASSERT_TRUE(frame->sync.locked);
    EXPECT_NEAR(frame->sync.period_ps, 12'512.626, 0.005);
  }
}

TEST(Framer, ARealRecordingWithoutSyncsGivesFramesThatDoNot) {
  const auto file = test::real_recording_path("hydraharp400_t2_hbt.ptu");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not here; set SPLID_DATA";
  const std::vector<Tag> tags = test::ptu_tags(file);
  const Framed r =
      framed(tags, 10'000, room_enough, {50, 3'780'000, DriftMethod::regression, 1 << 16});
  expect_sums_close(r, events_in(tags));
  expect_frames_whole(r);
  EXPECT_EQ(r.totals.photons, 224'721U);
  EXPECT_EQ(r.frames.size(), 20U);
}

TEST(Framer, RoomThatMayGrowHoldsAFullerFrameUpToItsBound) {
  const std::vector<Tag> tags = TagStream{}.make();
  const Framed whole = framed(tags);
  FrameCapacity capacity = room_enough;
  capacity.photons = 3;
  capacity.most_photons = 1'100;
  const Framed grown = framed(tags, 100, capacity);
  expect_sums_close(grown, tags.size());
  EXPECT_EQ(grown.totals.surplus, 0U);
  ASSERT_EQ(grown.frames.size(), whole.frames.size());
  for (std::size_t i = 0; i < whole.frames.size(); ++i) {
    EXPECT_TRUE(std::ranges::equal(grown.frames[i].photons_ps, whole.frames[i].photons_ps)) << i;
    EXPECT_EQ(grown.frames[i].seen_fraction, whole.frames[i].seen_fraction) << i;
  }
  capacity.most_photons = 700;
  const Framed bounded = framed(tags, 100, capacity);
  expect_sums_close(bounded, tags.size());
  EXPECT_EQ(bounded.totals.surplus + bounded.totals.photons, whole.totals.photons);
  EXPECT_EQ(bounded.frames[0].photons_ps.size(), 700U);
}

}  // namespace
}  // namespace splid
