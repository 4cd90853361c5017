#include "drivers/replay/replay.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <stop_token>
#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/loss_collector.hpp"
#include "protocol/ptu_encode.hpp"
#include "tests/support/made_recording.hpp"
#include "tests/support/real_recording.hpp"
#include "tests/support/scene_runs.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/vector_sink.hpp"

namespace splid {
namespace {

using test::counted;
using test::overflow_record;
using test::photon_record;
using test::recording;
using test::sync_record;
using ::testing::ElementsAre;
using ::testing::SizeIs;

Tag tag(std::int64_t time_ps, TagKind kind, int value = 0) { return {time_ps, value, kind, {}}; }

class Replay : public ::testing::Test {
 protected:
  Replay() {
    context_.pattern = &pattern_;
    context_.warn = [this](const std::string& text) { warnings_.push_back(text); };
  }

  std::unique_ptr<TagSource> open(const std::string& content, double speed = 0) {
    ReplayOptions options;
    options.recording = folder_.write("made.ptu", content);
    options.speed = speed;
    return options.open(context_);
  }

  std::vector<Tag> play(const std::string& content, double speed = 0, std::size_t room = 1 << 16) {
    test::VectorSink sink(room);
    open(content, speed)->run(sink, {});
    return sink.tags;
  }

  test::TempFolder folder_;
  Pattern pattern_ = test::paper_pattern();
  SourceContext context_;
  std::vector<std::string> warnings_;
};

TEST_F(Replay, IsRegistered) { EXPECT_NE(make_source_options("replay"), nullptr); }

TEST_F(Replay, EndsWithAHeartbeatAtTheLastTag) {
  EXPECT_THAT(play(recording(counted(2), {photon_record(1, 5), sync_record(7)})),
              ElementsAre(photon_tag(5, 1), sync_tag(7), heartbeat_tag(7)));
}

TEST_F(Replay, TheClockAtTheLastOverflowIsReachedToo) {
  EXPECT_EQ(play(recording(counted(2), {sync_record(7), overflow_record(2)})).back(),
            heartbeat_tag(2 * 33'554'432));
}

TEST_F(Replay, TimesAreThoseOfTheLiveRun) {
  PtuFacts facts = counted(1);
  facts.origin_ps = 340'000'000'000'000'000;
  facts.created_unix_s = 1'700'000'000;
  const std::string content = recording(facts, {sync_record(7)});
  EXPECT_EQ(play(content).front(), sync_tag(340'000'000'000'000'007));
  const SourceInfo info = open(content)->info();
  EXPECT_FALSE(info.live);
  EXPECT_NEAR(info.start_unix_s.value(), 1'700'000'000 - 340'000, 1e-5);
}

// Each 200 ms of ten minutes, 40 ns are lost: more losses than a header holds.
TEST_F(Replay, ManyShortLossesComeBackAsShortLosses) {
  LossCollector collector;
  constexpr std::int64_t every_ps = 200'000'000'000;
  for (std::int64_t i = 1; i <= 3'000; ++i) collector.add({i * every_ps, i * every_ps + 40'000, 2});
  PtuFacts facts = counted(1);
  facts.losses = collector.losses(0);
  std::int64_t lost_ps = 0;
  std::int64_t count = 0;
  std::int64_t longest_ps = 0;
  std::int64_t begin_ps = 0;
  for (const Tag& each : play(recording(facts, {photon_record(1, 5)}))) {
    if (each.kind == TagKind::loss_begin) begin_ps = each.time_ps;
    if (each.kind != TagKind::loss_end) continue;
    lost_ps += each.time_ps - begin_ps;
    longest_ps = std::max(longest_ps, each.time_ps - begin_ps);
    count += each.value;
  }
  EXPECT_EQ(lost_ps, 3'000 * 40'000);
  EXPECT_EQ(count, 6'000);
  EXPECT_LT(longest_ps, 1'000'000);
}

class ReplayOfLosses : public Replay, public ::testing::WithParamInterface<double> {};

// At any speed and with rooms of any size.
TEST_P(ReplayOfLosses, StandInTheirPlaces) {
  PtuFacts facts = counted(4);
  facts.losses = {{0, 5, 1}, {100, 200, 7}, {250, 250, 2}, {900, 1000, -1}};
  const std::string content = recording(facts, {sync_record(10), photon_record(1, 100),
                                                photon_record(1, 200), photon_record(1, 300)});
  for (const std::size_t room : {1, 2, 1000}) {
    EXPECT_THAT(
        play(content, GetParam(), room),
        ElementsAre(tag(0, TagKind::loss_begin), tag(5, TagKind::loss_end, 1), sync_tag(10),
                    tag(100, TagKind::loss_begin), photon_tag(100, 1),
                    tag(200, TagKind::loss_end, 7), photon_tag(200, 1),
                    tag(250, TagKind::missed, 2), photon_tag(300, 1), tag(900, TagKind::loss_begin),
                    tag(1000, TagKind::loss_end, -1), heartbeat_tag(1000)));
  }
}

INSTANTIATE_TEST_SUITE_P(Speeds, ReplayOfLosses, ::testing::Values(0.0, 1e-3, 1.0, 1e9));

// 40 ms of simulated tags through the encoder and back, fast, slowly and with losses in between.
TEST_F(Replay, WhatWasRecordedComesBack) {
  simulator::Options options;
  options.pace = simulator::Speed::max;
  options.seconds = 0.04;
  options.start_ps = 5'000'000'000'000;
  options.encoder_rate_hz = 1000;
  const std::vector<Tag> tags = test::simulate(options, pattern_);
  PtuEncoder encoder(options.start_ps);
  std::vector<std::byte> records;
  encoder.encode(tags, records);
  encoder.flush(records);
  PtuFacts facts = counted(encoder.records());
  facts.origin_ps = options.start_ps;
  std::string content = recording(facts, {});
  content.append(reinterpret_cast<const char*>(records.data()), records.size());

  std::vector<Tag> events;
  for (const Tag& each : tags) {
    if (is_event(each.kind)) events.push_back(each);
  }
  events.push_back(heartbeat_tag(events.back().time_ps));
  const std::vector<Tag> fast = play(content);
  EXPECT_EQ(fast, events);
  EXPECT_EQ(play(content, 2), fast);
  EXPECT_EQ(play(content, 0, 100), fast);
}

TEST_F(Replay, PacedHandsOnInSlices) {
  const std::string content = recording(
      counted(5),
      {sync_record(0), sync_record(1), overflow_record(300), sync_record(0), sync_record(1)});
  test::VectorSink sink;
  std::vector<std::size_t> sizes;
  sink.on_publish = [&](test::VectorSink& self) { sizes.push_back(self.tags.size()); };
  open(content, 1)->run(sink, {});
  // 10 ms apart: two tags, two tags and the heartbeat.
  EXPECT_THAT(sizes, ElementsAre(2, 4, 5));
}

// The first slice of 5 ms ends before the tag at 5 ms.
TEST_F(Replay, ATagAtTheEndOfASliceIsInTheNext) {
  constexpr int overflows = 149;
  constexpr std::int64_t rest_ps = 5'000'000'000 - overflows * std::int64_t{33'554'432};
  const std::string content = recording(
      counted(4),
      {sync_record(0), overflow_record(overflows), sync_record(rest_ps - 1), sync_record(rest_ps)});
  test::VectorSink sink;
  std::vector<std::size_t> sizes;
  sink.on_publish = [&](test::VectorSink& self) { sizes.push_back(self.tags.size()); };
  open(content, 1)->run(sink, {});
  EXPECT_THAT(sizes, ElementsAre(2, 3, 4));
  EXPECT_EQ(sink.tags[2], sync_tag(5'000'000'000));
}

TEST_F(Replay, AStopEndsItWhileItSleeps) {
  const std::string content =
      recording(counted(3), {sync_record(0), overflow_record(1'000'000), sync_record(1)});
  std::stop_source stop;
  test::VectorSink sink(1000, stop.get_token());
  sink.on_publish = [&](test::VectorSink&) { stop.request_stop(); };
  open(content, 1e-3)->run(sink, stop.get_token());  // nine hours otherwise
  EXPECT_THAT(sink.tags, ElementsAre(sync_tag(0)));
}

TEST_F(Replay, AStopEndsItBetweenBlocks) {
  std::string content = recording(counted(1000), {});
  for (int i = 0; i < 1000; ++i) content.append({1, 0, 0, 2});
  std::stop_source stop;
  test::VectorSink sink(100, stop.get_token());
  sink.on_publish = [&](test::VectorSink&) { stop.request_stop(); };
  open(content)->run(sink, stop.get_token());
  EXPECT_THAT(sink.tags, SizeIs(100));
}

TEST_F(Replay, WarningsReachTheCaller) {
  play(recording(counted(0), {sync_record(1)}));
  EXPECT_THAT(warnings_, ElementsAre(::testing::HasSubstr("record count is 0")));
}

TEST_F(Replay, ARealRecordingPlays) {
  const std::filesystem::path file = test::real_recording_path("qutag_sync_t2.ptu");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there: see SPLID_DATA";
  ReplayOptions options;
  options.recording = file.string();
  test::VectorSink sink(4096);
  options.open(context_)->run(sink, {});
  EXPECT_EQ(test::times_ps(sink.tags, TagKind::photon).size(), 43'736U + 62'437U);
  EXPECT_EQ(test::times_ps(sink.tags, TagKind::sync).size(), 105'600U);
  EXPECT_EQ(sink.tags.back().kind, TagKind::heartbeat);
}

}  // namespace
}  // namespace splid
