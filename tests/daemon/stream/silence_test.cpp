#include "daemon/stream/silence.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/support/framed.hpp"
#include "tests/support/real_recording.hpp"
#include "tests/support/sanitized.hpp"

namespace splid {
namespace {

using namespace test;

constexpr std::int64_t pattern_ps = 3'780'000;
const FramerOptions frames_of_50_ms{50, double(pattern_ps), DriftMethod::regression, 1 << 15};

// 130 photons a frame of 50 ms, as [P] has them.
TagStream faint_stream() {
  TagStream stream;
  stream.period_ps = pattern_ps;
  stream.photons_per_ms = 2.6;
  stream.markers_per_ms = 0;
  stream.length_ms = 400;
  return stream;
}

// As of an instrument that sends only the syncs beside photons, of a laser of 80 MHz.
std::vector<Tag> stream_with_syncs_beside_photons(double photons_per_ms, std::uint64_t seed) {
  constexpr double laser_ps = 12'512.6;
  std::mt19937_64 random(seed);
  std::exponential_distribution<double> gap(photons_per_ms / 1e9);
  std::vector<Tag> tags;
  for (double at_ps = gap(random); at_ps < 400e9; at_ps += gap(random)) {
    tags.push_back(sync_tag(std::llround(std::floor(at_ps / laser_ps) * laser_ps)));
    tags.push_back(photon_tag(std::llround(at_ps), 1));
  }
  std::ranges::sort(tags, {}, &Tag::time_ps);
  return tags;
}

Framed framed_80_mhz(const std::vector<Tag>& tags) {
  return framed(tags, 1 << 14, room_enough, {50, 12'512.6, DriftMethod::regression, 1 << 16});
}

// An instrument says nothing, but the host's clock goes on, in heartbeats.
std::vector<Tag> silent_between(const std::vector<Tag>& tags, std::int64_t begin_ps,
                                std::int64_t end_ps) {
  std::vector<Tag> left = without(tags, begin_ps, end_ps);
  for (std::int64_t at = begin_ps + 10 * ms; at < end_ps; at += 10 * ms) {
    insert_sorted(left, heartbeat_tag(at));
  }
  return left;
}

double seen_between(const Frame& frame, std::int64_t begin_ps, std::int64_t end_ps) {
  const auto inside = double(std::min(end_ps, frame.end_ps) - std::max(begin_ps, frame.start_ps));
  return 1 - std::max(inside, 0.0) / double(frame.end_ps - frame.start_ps);
}

// 400 ms in frames of 50: the last ends with the stream. What a test says of each frame it must
// have said of some.
void expect_eight_frames(const Framed& r) { ASSERT_EQ(r.frames.size(), 8U); }

void expect_unseen_between(const Framed& r, std::int64_t begin_ps, std::int64_t end_ps) {
  expect_frames_whole(r);
  expect_eight_frames(r);
  for (std::size_t i = 1; i + 1 < r.frames.size(); ++i) {
    const Frame& frame = r.frames[i];
    const double seen = seen_between(frame, begin_ps, end_ps);
    EXPECT_NEAR(frame.seen_fraction, seen, 0.003) << "frame " << i;
    if (seen < 0.99) {
      EXPECT_EQ(frame.uncounted_losses, 1U);
    }
    if (seen == 1) {
      EXPECT_EQ(frame.uncounted_losses, 0U);
    }
  }
}

TEST(Silence, IsTimeThatWasNotSeen) {
  for (const double silent : {0.08, 0.66, 0.9, 0.95, 0.995}) {
    for (const double begin : {0.0, 0.5, 1.0}) {  // of the frame's rest
      SCOPED_TRACE(std::to_string(silent) + " of a frame from " + std::to_string(begin));
      const auto begin_ps = std::llround((150 + begin * (1 - silent) * 50) * 1e9);
      const auto end_ps = begin_ps + std::llround(silent * 50e9);
      const std::vector<Tag> tags = silent_between(faint_stream().make(), begin_ps, end_ps);
      const Framed r = framed(tags, 1 << 14, room_enough, frames_of_50_ms);
      expect_sums_close(r, events_in(tags));
      expect_unseen_between(r, begin_ps, end_ps);
    }
  }
}

TEST(Silence, GoesOnOverWholeFrames) {
  const std::vector<Tag> tags = silent_between(faint_stream().make(), 120 * ms, 290 * ms);
  expect_unseen_between(framed(tags, 1 << 14, room_enough, frames_of_50_ms), 120 * ms, 290 * ms);
}

TEST(Silence, ThatComesAndGoesIsFoundEachTime) {
  std::vector<Tag> tags = faint_stream().make();
  std::erase_if(tags, [](const Tag& tag) { return tag.time_ps % ms > ms / 5; });
  const Framed r = framed(tags, 1 << 14, room_enough, frames_of_50_ms);
  expect_eight_frames(r);
  for (std::size_t i = 1; i + 1 < r.frames.size(); ++i) {
    EXPECT_NEAR(r.frames[i].seen_fraction, 0.2, 0.01);
  }
}

// 11 periods in each 28, and 8 in each 265: chance makes no gap as long of so many syncs dropped
// one by one.
TEST(Silence, OfSomePeriodsIsFoundToo) {
  FrameCapacity room_for_losses = room_enough;
  room_for_losses.losses = 1024;
  struct Case {
    std::int64_t silent_ps, turn_ps;
  };
  for (const Case& run : {Case{42'000'000, 105'000'000}, Case{30'000'000, ms}}) {
    SCOPED_TRACE(run.silent_ps);
    std::vector<Tag> tags = faint_stream().make();
    std::erase_if(tags, [&](const Tag& tag) { return tag.time_ps % run.turn_ps < run.silent_ps; });
    const Framed r = framed(tags, 1 << 14, room_for_losses, frames_of_50_ms);
    expect_sums_close(r, events_in(tags));
    // A run reaches from the sync before it to the sync after it.
    const double silent = (double(run.silent_ps) + pattern_ps) / double(run.turn_ps);
    expect_eight_frames(r);
    for (std::size_t i = 1; i + 1 < r.frames.size(); ++i) {
      EXPECT_NEAR(r.frames[i].seen_fraction, 1 - silent, 0.02) << i;
    }
  }
}

TEST(Silence, SyncsDroppedOneByOneAreNone) {
  for (const double dropped : {0.01, 0.3, 0.6}) {
    TagStream stream = faint_stream();
    stream.sync_missing = dropped;
    const Framed r = framed(stream.make(), 1 << 14, room_enough, frames_of_50_ms);
    expect_eight_frames(r);
    for (std::size_t i = 0; i + 1 < r.frames.size(); ++i) {
      EXPECT_GT(r.frames[i].seen_fraction, 0.9999) << dropped;
      EXPECT_EQ(r.frames[i].uncounted_losses, 0U) << dropped;
    }
  }
}

// The sync's cable is off: photons say that the time was seen.
TEST(Silence, IsNoneWherePhotonsGoOn) {
  std::vector<Tag> tags = faint_stream().make();
  std::erase_if(tags, [](const Tag& tag) {
    return tag.kind == TagKind::sync && tag.time_ps > 170 * ms && tag.time_ps < 310 * ms;
  });
  const Framed r = framed(tags, 1 << 14, room_enough, frames_of_50_ms);
  expect_eight_frames(r);
  for (std::size_t i = 0; i + 1 < r.frames.size(); ++i) EXPECT_GT(r.frames[i].seen_fraction, 0.99);
}

TEST(Silence, OfSyncsBesidePhotonsIsWhatChanceDoesNotExplain) {
  for (const double photons_per_ms : {20.0, 300.0}) {
    for (int seed = 1; seed <= test::times(10); ++seed) {
      SCOPED_TRACE(seed);
      const std::vector<Tag> tags = stream_with_syncs_beside_photons(photons_per_ms, seed);
      const Framed whole = framed_80_mhz(tags);
      EXPECT_EQ(whole.totals.uncounted, 0U);
      const Framed r = framed_80_mhz(silent_between(tags, 160 * ms, 195 * ms));
      EXPECT_NEAR(r.frames[3].seen_fraction, 0.3, 0.04);
    }
  }
}

// A scene that grows dark is no silence, although the instrument says less.
TEST(Silence, OfSyncsBesidePhotonsIsNoneInTheDark) {
  std::vector<Tag> tags = stream_with_syncs_beside_photons(300, 1);
  std::mt19937_64 random(2);
  std::erase_if(tags,
                [&](const Tag& tag) { return tag.time_ps > 170 * ms && random() % 200 != 0; });
  const Framed r = framed_80_mhz(tags);
  EXPECT_EQ(r.totals.uncounted, 0U);
}

TEST(Silence, IsNotCountedTwiceWhereItWasTold) {
  std::vector<Tag> tags = without(faint_stream().make(), 160 * ms, 190 * ms);
  insert_sorted(tags, {160 * ms, 0, TagKind::loss_begin, {}});
  insert_sorted(tags, {190 * ms, 77, TagKind::loss_end, {}});
  const Framed r = framed(tags, 1 << 14, room_enough, frames_of_50_ms);
  EXPECT_EQ(r.totals.uncounted, 0U);
  EXPECT_NEAR(r.frames[3].seen_fraction, 0.4, 1e-3);
}

TEST(Silence, IsNoneInARealRecordingWithSyncsBesidePhotons) {
  const auto file = test::real_recording_path("qutag_sync_t2.ptu");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not here; set SPLID_DATA";
  const std::vector<Tag> tags = test::ptu_tags(file);
  const FramerOptions options{50, 12'512.62584, DriftMethod::regression, 1 << 16};
  EXPECT_EQ(framed(tags, 1 << 14, room_enough, options).totals.uncounted, 0U);
  const std::int64_t begin_ps = tags.front().time_ps;
  const Framed r = framed(silent_between(tags, begin_ps + 110 * ms, begin_ps + 140 * ms), 1 << 14,
                          room_enough, options);
  EXPECT_NEAR(r.frames[2].seen_fraction, 0.4, 0.02);
}

}  // namespace
}  // namespace splid
