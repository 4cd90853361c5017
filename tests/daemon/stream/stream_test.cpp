#include "daemon/stream/stream.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <stop_token>
#include <utility>
#include <vector>

#include "protocol/error.hpp"
#include "tests/support/daemon_scene.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/held_clock.hpp"
#include "tests/support/scripted_source.hpp"

namespace splid {
namespace {

using std::chrono::milliseconds;

struct Taken {
  std::vector<std::uint64_t> sequences;
  std::vector<Effort> efforts;
};

// Takes each frame as it comes; after the frame of that number, `meanwhile`.
template <class Meanwhile>
Taken take_all(Stream& stream, std::uint64_t number, const Meanwhile& meanwhile) {
  Taken taken;
  stream.start();
  while (!stream.ended()) {
    const EstimationUnit* unit = stream.next();
    if (unit == nullptr) {
      stream.wait(milliseconds{50});
      continue;
    }
    taken.sequences.push_back(unit->frame.sequence);
    taken.efforts.push_back(unit->effort);
    stream.release();
    if (taken.sequences.back() == number) meanwhile();
  }
  EXPECT_EQ(stream.join(), nullptr);
  return taken;
}

class CountingTap final : public TagTap {
 public:
  void take(std::span<const Tag> tags) override {
    EXPECT_FALSE(finished);
    for (const Tag& tag : tags) events += is_event(tag.kind) ? 1 : 0;
  }
  void finish() override { finished = true; }

  std::uint64_t events = 0;
  bool finished = false;
};

TEST(Stream, GivesFramesInTheirOrderAndCountsEveryTag) {
  const Config config = scene_config(0.6, 3);
  CountingTap tap;
  Stream stream(stream_options(config), open_scene(config), host_clock());
  stream.tap_into(&tap);
  const Taken taken = take_all(stream, 0, [] {});
  ASSERT_GE(taken.sequences.size(), 12U);
  for (std::size_t i = 0; i < taken.sequences.size(); ++i) EXPECT_EQ(taken.sequences[i], i);
  const StreamCounters counters = stream.counters();
  EXPECT_EQ(counters.framer.frames, taken.sequences.size());
  EXPECT_EQ(counters.framer.events, tap.events);
  EXPECT_EQ(counters.dropped_tags, 0U);
  EXPECT_TRUE(tap.finished);
}

TEST(Stream, EndsWhereNobodyTakesItsFrames) {
  const Config config = scene_config(60, 2);
  Stream stream(stream_options(config), open_scene(config), host_clock());
  stream.start();
  while (stream.next() == nullptr) stream.wait(milliseconds{50});
}

TEST(Stream, NeedNotBeStarted) {
  const Config config = scene_config(1);
  const Stream stream(stream_options(config), open_scene(config), host_clock());
  EXPECT_EQ(stream.counters().framer.events, 0U);
  EXPECT_EQ(stream.diagnosis(), nullptr);
}

TEST(Stream, ARequestToStopEndsItWithWhatCame) {
  const Config config = scene_config(600);
  Stream stream(stream_options(config), open_scene(config), host_clock());
  const Taken taken = take_all(stream, 3, [&] { stream.request_stop(); });
  EXPECT_GE(taken.sequences.size(), 4U);
  const StreamCounters counters = stream.counters();
  EXPECT_GT(counters.framer.events, 0U);
  EXPECT_LT(taken.sequences.size(), 6'000U);
}

// However long an estimate takes, a stop takes one for each thread at most.
TEST(Stream, FramesThatAStopLeavesNoTimeForArePublishedAsNotSeen) {
  const Config config = scene_config(600);
  HeldClock clock;
  Stream stream(stream_options(config), open_scene(config), clock);
  std::vector<std::pair<double, FrameStatus>> late;
  stream.start();
  while (stream.next() == nullptr) stream.wait(std::chrono::milliseconds{10});
  stream.request_stop();
  clock.advance_ms(Stream::stop_patience_ms + 1);
  for (stream.release(); !stream.ended();) {
    if (const EstimationUnit* unit = stream.next()) {
      late.emplace_back(unit->frame.seen_fraction, unit->estimate.status);
      stream.release();
    } else {
      stream.wait(std::chrono::milliseconds{10});
    }
  }
  EXPECT_EQ(stream.join(), nullptr);
  ASSERT_FALSE(late.empty());
  EXPECT_EQ(late.back(), (std::pair{0.0, FrameStatus::not_run}));
}

TEST(Stream, AMakerOfEstimatorsEndsAtAStop) {
  const Config config = scene_config(1);
  const Stream stream(stream_options(config), open_scene(config), host_clock());
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(test::error_text([&] { (void)stream.maker(stream_options(config))(stop.get_token()); }),
            "the program ends");
}

TEST(Stream, AReloadHoldsForTheFramesThatComeAfterIt) {
  const Config config = scene_config(3);
  Stream stream(stream_options(config), open_scene(config), host_clock());
  StreamOptions next = stream_options(config);
  next.estimator.effort = Effort::fast;
  const Taken taken = take_all(stream, 3, [&] { stream.reload(stream.maker(next)({})); });
  ASSERT_GE(taken.efforts.size(), 20U);
  EXPECT_EQ(taken.efforts.front(), Effort::balanced);
  EXPECT_EQ(taken.efforts.back(), Effort::fast);
}

// A source that can wait loses nothing, however many photons a frame has.
TEST(Stream, AFrameOfAReplayHasRoomForMorePhotonsThanTheRing) {
  Config config = scene_config(0.2);
  auto scene = std::make_unique<simulator::Options>();
  scene->pace = simulator::Speed::max;
  scene->seconds = 0.2;
  scene->ambient_per_s = 2e6;
  config.source = std::move(scene);
  const auto photons_of = [&](std::int64_t ring_tags) {
    config.pipeline.ring_capacity_tags = ring_tags;
    Stream stream(stream_options(config), open_scene(config), host_clock());
    std::vector<std::size_t> photons;
    stream.start();
    while (!stream.ended()) {
      const EstimationUnit* unit = stream.next();
      if (unit == nullptr) {
        stream.wait(milliseconds{50});
        continue;
      }
      photons.push_back(unit->frame.photons_ps.size());
      EXPECT_EQ(unit->frame.lost_tags, 0U);
      stream.release();
    }
    EXPECT_EQ(stream.join(), nullptr);
    EXPECT_EQ(stream.counters().framer.surplus, 0U);
    return photons;
  };
  const std::vector<std::size_t> whole = photons_of(1 << 20);
  ASSERT_GE(whole.size(), 4U);
  EXPECT_GT(whole[1], 90'000U);
  EXPECT_EQ(photons_of(1 << 14), whole);
}

TEST(Stream, AddsUpTheCountsOfStreams) {
  StreamCounters sum;
  StreamCounters one;
  one.framer.events = 10;
  one.framer.uncounted = 2;
  one.dropped_tags = 3;
  one.discarded_tags = 4;
  one.source = {{"splid_blocks_total", {}, "blocks", 5}};
  sum += one;
  sum += one;
  EXPECT_EQ(sum.framer.events, 20U);
  EXPECT_EQ(sum.framer.uncounted, 4U);
  EXPECT_EQ(sum.dropped_tags, 6U);
  EXPECT_EQ(sum.discarded_tags, 8U);
  ASSERT_EQ(sum.source.size(), 1U);
  EXPECT_EQ(sum.source[0].value, 10U);
}

TEST(Stream, RefusesAFrameThatDoesNotFitTheRing) {
  Config config = scene_config(0);
  config.pipeline.ring_capacity_tags = 1 << 12;
  EXPECT_THROW(Stream(stream_options(config), open_scene(config), host_clock()), Error);
}

}  // namespace
}  // namespace splid
