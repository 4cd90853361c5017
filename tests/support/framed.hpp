#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

#include "daemon/stream/framer.hpp"
#include "tests/support/frame_list.hpp"
#include "tests/support/tag_stream.hpp"

// A stream through a framer, and what must hold of the frames that come out.

namespace splid::test {

inline constexpr std::int64_t ms = 1'000'000'000;
inline constexpr std::int64_t period_ps = 100'000'000;  // 0.1 ms: 100 syncs a frame of 10 ms
inline constexpr std::int64_t second = 1000 * ms;

inline FramerOptions options_of_10_ms() {
  return {10, double(period_ps), DriftMethod::regression, 4096};
}

// Less than the default, which takes longer to clear than to fill here.
inline const FrameCapacity room_enough{1 << 16, 1 << 15, 1 << 10, 64};

struct Framed {
  FrameList frames;
  FramerTotals totals;
  std::optional<SyncDiagnosis> diagnosis;
};

// Pushes the tags in blocks of the given size.
inline Framed framed(const std::vector<Tag>& tags, std::size_t block = 1'000'000,
                     const FrameCapacity& capacity = room_enough,
                     const FramerOptions& options = options_of_10_ms(),
                     const ChannelOptions& inputs = {}) {
  Framed result{FrameList(capacity), {}, {}};
  const ChannelMap channels{inputs};
  Framer framer(options, channels, result.frames);
  for (std::size_t at = 0; at < tags.size(); at += block) {
    framer.push(std::span(tags).subspan(at, std::min(block, tags.size() - at)), 1);
  }
  framer.finish();
  result.totals = framer.totals();
  result.diagnosis = framer.diagnosis();
  return result;
}

inline std::uint64_t events_in(const std::vector<Tag>& tags) {
  return static_cast<std::uint64_t>(
      std::count_if(tags.begin(), tags.end(), [](const Tag& t) { return is_event(t.kind); }));
}

inline void expect_sums_close(const Framed& r, std::uint64_t events) {
  const FramerTotals& t = r.totals;
  EXPECT_EQ(t.events, events);
  EXPECT_EQ(t.events, t.photons + t.syncs + t.markers - t.shared + t.ignored + t.late + t.surplus);
  std::uint64_t photons = 0;
  std::uint64_t syncs = 0;
  std::uint64_t markers = 0;
  std::uint64_t lost = 0;
  std::uint64_t uncounted = 0;
  for (const auto& frame : r.frames.frames) {
    photons += frame->photons_ps.size();
    syncs += frame->syncs_ps.size();
    markers += frame->markers.size();
    lost += frame->lost_tags;
    uncounted += frame->uncounted_losses;
  }
  EXPECT_EQ(photons, t.photons);
  EXPECT_EQ(syncs, t.syncs);
  EXPECT_EQ(markers, t.markers);
  EXPECT_EQ(lost + t.unplaced, t.late + t.surplus + t.reported);
  EXPECT_LE(uncounted, t.uncounted);  // the rest came while no frame was open
  EXPECT_EQ(r.frames.size(), t.frames);
  EXPECT_LE(r.frames.opened - r.frames.closed, 1);
}

inline bool inside(const Frame& frame, std::int64_t time_ps) {
  return time_ps >= frame.start_ps && time_ps < frame.end_ps;
}

inline void expect_whole(const Frame& frame) {
  EXPECT_LT(frame.start_ps, frame.end_ps);
  const auto of_input = frame.photons_of_input.view();
  if (!of_input.empty()) {
    EXPECT_EQ(std::accumulate(of_input.begin(), of_input.end(), std::size_t{0}),
              frame.photons_ps.size());
  }
  for (const std::int64_t t : frame.photons_ps.view()) ASSERT_TRUE(inside(frame, t));
  for (const std::int64_t t : frame.syncs_ps.view()) ASSERT_TRUE(inside(frame, t));
  for (const MarkerTag& m : frame.markers.view()) ASSERT_TRUE(inside(frame, m.time_ps));
  std::int64_t unseen_ps = 0;
  std::int64_t from_ps = frame.start_ps;
  for (const Loss& loss : frame.losses.view()) {
    EXPECT_GE(loss.begin_ps, from_ps);
    EXPECT_LT(loss.begin_ps, loss.end_ps);
    EXPECT_LE(loss.end_ps, frame.end_ps);
    from_ps = loss.end_ps;
    unseen_ps += loss.end_ps - loss.begin_ps;
  }
  EXPECT_NEAR(frame.seen_fraction, 1 - double(unseen_ps) / double(frame.end_ps - frame.start_ps),
              1e-12);
}

inline void expect_frames_whole(const Framed& r) {
  for (std::size_t i = 0; i < r.frames.size(); ++i) {
    EXPECT_EQ(r.frames[i].sequence, i);
    expect_whole(r.frames[i]);
  }
}

inline void expect_seamless(const Framed& r) {
  for (std::size_t i = 1; i < r.frames.size(); ++i) {
    EXPECT_EQ(r.frames[i].start_ps, r.frames[i - 1].end_ps) << i;
  }
}

inline void expect_same(const Framed& a, const Framed& b) {
  ASSERT_EQ(a.frames.size(), b.frames.size());
  for (std::size_t i = 0; i < a.frames.size(); ++i) {
    const Frame& x = a.frames[i];
    const Frame& y = b.frames[i];
    ASSERT_EQ(x.start_ps, y.start_ps) << i;
    ASSERT_EQ(x.end_ps, y.end_ps) << i;
    ASSERT_TRUE(std::ranges::equal(x.photons_ps.view(), y.photons_ps.view())) << i;
    ASSERT_TRUE(std::ranges::equal(x.syncs_ps.view(), y.syncs_ps.view())) << i;
    ASSERT_TRUE(std::ranges::equal(x.losses.view(), y.losses.view())) << i;
    ASSERT_EQ(x.markers.size(), y.markers.size()) << i;
    ASSERT_EQ(x.lost_tags, y.lost_tags) << i;
    ASSERT_EQ(x.seen_fraction, y.seen_fraction) << i;
    ASSERT_EQ(x.sync.locked, y.sync.locked) << i;
    ASSERT_EQ(x.sync.phase_ps, y.sync.phase_ps) << i;
    ASSERT_EQ(x.sync.period_ps, y.sync.period_ps) << i;
  }
}

inline void insert_sorted(std::vector<Tag>& tags, const Tag& tag) {
  const auto at = std::upper_bound(tags.begin(), tags.end(), tag, [](const Tag& a, const Tag& b) {
    return a.time_ps < b.time_ps;
  });
  tags.insert(at, tag);
}

// Without the tags of a stretch of time.
inline std::vector<Tag> without(std::vector<Tag> tags, std::int64_t begin_ps, std::int64_t end_ps) {
  std::erase_if(tags, [&](const Tag& t) { return t.time_ps >= begin_ps && t.time_ps < end_ps; });
  return tags;
}

}  // namespace splid::test
