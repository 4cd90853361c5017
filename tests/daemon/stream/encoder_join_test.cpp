#include "daemon/stream/encoder_join.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace splid {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::int64_t a_ms_ps = 1'000'000'000;
constexpr std::int64_t join_frame_ps = 50 * a_ms_ps;

constexpr EncoderScale scale{.m_per_count = -0.001, .offset_m = 10};

// A sample clock of 1 kHz and a target that goes away at 2 m/s from 7 m: counts 3000, 2998, ...
struct JoinBench {
  explicit JoinBench(bool live = true, std::int64_t origin_ps = 0)
      : join(scale, live), now_ps(origin_ps) {}

  // The next frame; first_tick_ps: from where on there are ticks in it.
  void frame(std::int64_t first_tick_ps, std::vector<Loss> losses = {}) {
    std::vector<std::int64_t> markers_ps;
    for (std::int64_t tick_ps = first_tick_ps; tick_ps < now_ps + join_frame_ps;
         tick_ps += a_ms_ps) {
      if (tick_ps >= now_ps && tick_ps != hidden_ps) markers_ps.push_back(tick_ps);
    }
    std::reverse(markers_ps.begin(), markers_ps.end());
    join.take_frame(now_ps, now_ps + join_frame_ps, markers_ps, losses);
    now_ps += join_frame_ps;
  }
  void quiet_frames(int number) {
    for (int i = 0; i < number; ++i) frame(now_ps + join_frame_ps);
  }
  void counts(std::int64_t first_index, std::int64_t number, bool overrun = false) {
    EncoderBatch batch{first_index, {}, overrun};
    for (std::int64_t i = first_index; i < first_index + number; ++i) {
      batch.counts.push_back(3000 - 2 * i);
    }
    join.take_counts(batch);
  }
  // Ticks from time start_ps on, after a pause, with counts for four frames.
  void begin() {
    quiet_frames(2);
    start_ps = now_ps;
    frame(start_ps);
    counts(0, 200);
  }
  void expect_position() const {
    const auto position = join.position();
    ASSERT_TRUE(position) << join.fault();
    const double since_s = static_cast<double>(now_ps - join_frame_ps / 2 - start_ps) * 1e-12;
    EXPECT_NEAR(position->distance_m, 7 + 2 * since_s, 1e-9);
    EXPECT_NEAR(position->velocity_mps, 2, 1e-9);
    EXPECT_THAT(join.fault(), IsEmpty());
  }

  EncoderJoin join;
  std::int64_t now_ps;
  std::int64_t start_ps = 0;
  std::int64_t hidden_ps = -1;
};

TEST(EncoderJoin, PositionAtMidFrameAndItsSlope) {
  for (const std::int64_t origin_ps : {std::int64_t{0}, std::int64_t{340'000'000'000'000'000}}) {
    JoinBench bench(true, origin_ps);
    bench.begin();
    bench.expect_position();
    bench.frame(bench.start_ps);
    bench.expect_position();
  }
}

// Two frames of a counter of 32 bits that goes by `step` a sample from `first` on. Their positions
// must be those of counts from `counted_from` on.
void expect_unwrapped(std::int64_t first, std::int64_t step, std::int64_t counted_from,
                      bool is_signed = false) {
  JoinBench bench;
  bench.quiet_frames(2);
  const std::int64_t start_ps = bench.now_ps;
  EncoderBatch batch;
  for (std::int64_t i = 0; i < 100; ++i) {
    const auto value = static_cast<std::uint32_t>(first + step * i);
    batch.counts.push_back(is_signed ? static_cast<std::int32_t>(value) : std::int64_t{value});
  }
  bench.join.take_counts(batch);
  for (int frame = 0; frame < 2; ++frame) {
    bench.frame(start_ps);
    const auto position = bench.join.position();
    ASSERT_TRUE(position) << bench.join.fault();
    const double counts =
        static_cast<double>(counted_from) + static_cast<double>(step) * (25 + 50 * frame);
    EXPECT_NEAR(position->distance_m, 10 - 0.001 * counts, 1e-6) << first << " " << step;
    EXPECT_NEAR(position->velocity_mps, -static_cast<double>(step), 1e-6) << first << " " << step;
  }
}

TEST(EncoderJoin, ACounterOf32BitsMayPassItsEnd) {
  constexpr std::int64_t turn = std::int64_t{1} << 32;
  // From below 0 and from above, upwards and downwards.
  expect_unwrapped(turn - 810, 30, -810);
  expect_unwrapped(turn - 2'100, 30, -2'100);
  expect_unwrapped(810, -30, 810);
  expect_unwrapped(turn / 2 - 200'000'000, 50'000'000, turn / 2 - 200'000'000);
  // Through the middle of its range, which is the end of a counter with a sign.
  expect_unwrapped(turn / 2 - 100, 3'000'000, turn / 2 - 100);
  expect_unwrapped(turn / 2 - 1'000, 30, turn / 2 - 1'000, true);
}

// Of a counter that moves by less than half of 32 bits a sample, and by more than one and a half.
TEST(EncoderJoin, ALargeCountIsNoEnd) {
  constexpr std::int64_t half_turn = std::int64_t{1} << 31;
  for (const std::int64_t step : {half_turn, -half_turn, 3 * half_turn, -3 * half_turn}) {
    JoinBench bench;
    bench.quiet_frames(2);
    constexpr std::int64_t first = std::int64_t{1} << 40;
    EncoderBatch batch;
    for (std::int64_t i = 0; i < 50; ++i) batch.counts.push_back(first + step * i);
    bench.join.take_counts(batch);
    bench.frame(bench.now_ps);
    const auto position = bench.join.position();
    ASSERT_TRUE(position) << bench.join.fault();
    EXPECT_NEAR(position->distance_m, 10 - 0.001 * static_cast<double>(first + 25 * step), 1e-3);
  }
}

TEST(EncoderJoin, CountsMayComeLate) {
  JoinBench bench;
  bench.quiet_frames(2);
  EXPECT_FALSE(bench.join.waits());
  bench.start_ps = bench.now_ps;
  bench.frame(bench.start_ps);
  EXPECT_TRUE(bench.join.waits());
  bench.counts(0, 49);
  EXPECT_TRUE(bench.join.waits());
  EXPECT_FALSE(bench.join.position());
  bench.counts(49, 1);
  EXPECT_FALSE(bench.join.waits());
  bench.expect_position();
}

TEST(EncoderJoin, CountsMayComeBeforeTheirMarkers) {
  JoinBench bench;
  bench.counts(0, 120);
  bench.quiet_frames(2);
  bench.start_ps = bench.now_ps;
  for (int i = 0; i < 2; ++i) {
    bench.frame(bench.start_ps);
    bench.expect_position();
  }
  bench.frame(bench.start_ps);
  EXPECT_TRUE(bench.join.waits());
}

TEST(EncoderJoin, AFrameNeedsSamplesOverHalfOfIt) {
  JoinBench bench;
  bench.quiet_frames(2);
  bench.start_ps = bench.now_ps + 26 * a_ms_ps;
  bench.frame(bench.start_ps);
  bench.counts(0, 200);
  EXPECT_FALSE(bench.join.position());
  EXPECT_FALSE(bench.join.waits());
  bench.frame(bench.start_ps);
  bench.expect_position();
}

TEST(EncoderJoin, AMissingMarkerBreaksItUntilTheClockStartsAnew) {
  JoinBench bench;
  bench.begin();
  bench.hidden_ps = bench.now_ps + 20 * a_ms_ps;
  bench.frame(bench.start_ps);
  EXPECT_FALSE(bench.join.position());
  EXPECT_THAT(bench.join.fault(), HasSubstr("markers have a gap"));
  bench.frame(bench.start_ps);
  EXPECT_FALSE(bench.join.position());
  bench.begin();
  bench.expect_position();
}

TEST(EncoderJoin, ALostFirstMarkerOfAFrameIsNoticed) {
  JoinBench bench;
  bench.begin();
  bench.hidden_ps = bench.now_ps;
  bench.frame(bench.start_ps);
  EXPECT_FALSE(bench.join.position());
}

TEST(EncoderJoin, AMarkerTooManyBreaksIt) {
  JoinBench bench;
  bench.begin();
  std::vector<std::int64_t> markers_ps;
  for (std::int64_t i = 0; i < 50; ++i) markers_ps.push_back(bench.now_ps + i * a_ms_ps);
  markers_ps.push_back(bench.now_ps + 20 * a_ms_ps + a_ms_ps / 2);
  bench.join.take_frame(bench.now_ps, bench.now_ps + join_frame_ps, markers_ps, {});
  EXPECT_FALSE(bench.join.position());
}

TEST(EncoderJoin, ALossThatHidNoMarkerBreaksNothing) {
  JoinBench bench;
  bench.begin();
  bench.frame(bench.start_ps, {{bench.now_ps + a_ms_ps / 4, bench.now_ps + a_ms_ps / 2, 17}});
  bench.expect_position();
}

TEST(EncoderJoin, AnOverrunOrAJumpOfTheIndexBreaksIt) {
  for (const bool overrun : {true, false}) {
    JoinBench bench;
    bench.begin();
    bench.counts(overrun ? 200 : 201, 100, overrun);
    bench.frame(bench.start_ps);
    EXPECT_FALSE(bench.join.position());
    EXPECT_FALSE(bench.join.waits());
    EXPECT_THAT(bench.join.fault(), HasSubstr("counts have a gap"));
    bench.begin();
    bench.expect_position();
  }
}

TEST(EncoderJoin, AClockThatRanBeforeIsNotJoined) {
  JoinBench bench;
  bench.frame(bench.now_ps);
  bench.counts(0, 200);
  EXPECT_FALSE(bench.join.position());
  EXPECT_FALSE(bench.join.waits());
  EXPECT_THAT(bench.join.fault(), HasSubstr("began before they were watched"));
  bench.begin();
  bench.expect_position();
}

TEST(EncoderJoin, CountsThatBeginInMidRunAreNotJoined) {
  JoinBench bench;
  bench.quiet_frames(2);
  bench.frame(bench.now_ps);
  bench.counts(1, 200);
  EXPECT_FALSE(bench.join.position());
  EXPECT_THAT(bench.join.fault(), HasSubstr("do not begin with index 0"));
  bench.begin();
  bench.expect_position();
}

TEST(EncoderJoin, AnIndexThatStepsBackIsAStartThatWasMissed) {
  JoinBench bench;
  bench.begin();
  bench.counts(50, 100);
  bench.quiet_frames(2);
  bench.frame(bench.now_ps);
  EXPECT_FALSE(bench.join.position());
  EXPECT_FALSE(bench.join.waits());
  EXPECT_THAT(bench.join.fault(), HasSubstr("do not begin with index 0"));
  bench.begin();
  bench.expect_position();
}

TEST(EncoderJoin, CountsOfARunThatIsOverAreNotWaitedFor) {
  JoinBench bench;
  bench.quiet_frames(2);
  bench.frame(bench.now_ps);
  bench.counts(0, 40);
  EXPECT_TRUE(bench.join.waits());
  bench.counts(0, 10);
  EXPECT_FALSE(bench.join.waits());
}

TEST(EncoderJoin, CountsWithoutMarkersAreForgottenSomeDay) {
  JoinBench bench(false);
  bench.counts(0, (1 << 22) + 1);
  bench.quiet_frames(2);
  bench.frame(bench.now_ps);
  EXPECT_FALSE(bench.join.position());
  EXPECT_THAT(bench.join.fault(), HasSubstr("counts have a gap"));
}

TEST(EncoderJoin, ALossShortBeforeTheFirstMarkerIsNoPause) {
  JoinBench bench;
  bench.quiet_frames(2);
  bench.frame(bench.now_ps + 20 * a_ms_ps, {{bench.now_ps, bench.now_ps + a_ms_ps, -1}});
  bench.counts(0, 200);
  EXPECT_FALSE(bench.join.position());
  EXPECT_THAT(bench.join.fault(), HasSubstr("began before they were watched"));
}

TEST(EncoderJoin, APauseInWhichTagsWereLostIsNoStart) {
  JoinBench bench;
  bench.begin();
  bench.frame(bench.now_ps + join_frame_ps,
              {{bench.now_ps + 10 * a_ms_ps, bench.now_ps + 20 * a_ms_ps, -1}});
  bench.frame(bench.now_ps + join_frame_ps);
  bench.frame(bench.now_ps + 19 * a_ms_ps);
  EXPECT_FALSE(bench.join.position());
  EXPECT_THAT(bench.join.fault(), HasSubstr("out of step"));
  bench.begin();
  EXPECT_FALSE(bench.join.position());
}

TEST(EncoderJoin, AFrameThatDoesNotFollowIsNoPause) {
  JoinBench bench;
  bench.begin();
  bench.now_ps += 4 * join_frame_ps;
  bench.frame(bench.now_ps);
  EXPECT_FALSE(bench.join.position());
  EXPECT_THAT(bench.join.fault(), HasSubstr("out of step"));
}

// The counts of a run whose markers were not there, and then the markers of another.
TEST(EncoderJoin, CountsFarAheadOfTheirMarkersAreOfAnotherRun) {
  for (const bool live : {true, false}) {
    JoinBench bench(live);
    bench.counts(0, 2'200);
    bench.quiet_frames(2);
    bench.start_ps = bench.now_ps;
    bench.frame(bench.start_ps);
    bench.counts(2'200, 1);
    EXPECT_EQ(bench.join.position().has_value(), !live);
  }
}

TEST(EncoderJoin, LongRunsKeepOnlyWhatIsNeeded) {
  JoinBench bench(false);
  bench.begin();
  for (int i = 0; i < 2'000; ++i) {
    bench.counts(200 + 50 * i, 50);
    bench.frame(bench.start_ps);
  }
  bench.expect_position();
}

// A bridge may begin again and again without the sample clock: nothing of that is kept.
TEST(EncoderJoin, CountsThatBeginTooOftenAreOutOfStep) {
  JoinBench bench;
  for (int i = 0; i < 16; ++i) bench.counts(0, 10);
  EXPECT_EQ(bench.join.waiting(), 160U);
  EXPECT_THAT(bench.join.fault(), IsEmpty());
  for (int i = 0; i < 1000; ++i) bench.counts(0, 10);
  EXPECT_EQ(bench.join.waiting(), 0U);
  EXPECT_THAT(bench.join.fault(), HasSubstr("out of step"));
}

TEST(EncoderJoin, SoManyCountsWaitInAllAndNoMore) {
  JoinBench bench;
  for (int i = 0; i < 9; ++i) bench.counts(0, 500'000);
  EXPECT_EQ(bench.join.waiting(), 4'000'000U);
  bench.counts(0, 10);
  EXPECT_EQ(bench.join.waiting(), 4'000'010U);
}

}  // namespace
}  // namespace splid
