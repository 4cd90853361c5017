#include "drivers/simulator/simulator.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <stop_token>
#include <vector>

#include "tests/support/scene_runs.hpp"

namespace splid::simulator {
namespace {

using test::paper_pattern;
using test::times_ps;

TEST(Simulator, IsRegistered) { EXPECT_NE(make_source_options("simulator"), nullptr); }

TEST(Simulator, SaysWhetherItCanWait) {
  const Pattern pattern = paper_pattern();
  SourceContext context;
  context.pattern = &pattern;
  Options options;
  EXPECT_TRUE(options.open(context)->info().live);
  options.pace = Speed::max;
  EXPECT_FALSE(options.open(context)->info().live);
}

TEST(Simulator, LiveAndFastGiveTheSameTags) {
  Options options;
  options.seconds = 0.02;
  const std::vector<Tag> live = test::simulate(options, paper_pattern());
  options.pace = Speed::max;
  EXPECT_EQ(live, test::simulate(options, paper_pattern()));
}

TEST(Simulator, LiveSendsHeartbeatsAndStopsWhenAsked) {
  const Pattern pattern = paper_pattern();
  SourceContext context;
  context.pattern = &pattern;
  Options options;
  std::stop_source stop;
  test::VectorSink sink(1 << 16, stop.get_token());
  sink.on_publish = [&](test::VectorSink& self) {
    if (times_ps(self.tags, TagKind::heartbeat).size() == 4) stop.request_stop();
  };
  options.open(context)->run(sink, stop.get_token());
  const auto beats = times_ps(sink.tags, TagKind::heartbeat);
  EXPECT_EQ(beats, (std::vector<std::int64_t>{5'000'000'000, 10'000'000'000, 15'000'000'000,
                                              20'000'000'000}));
  // No more than one slice of 1 ms after the request.
  EXPECT_LE(sink.tags.back().time_ps, 21'000'000'000);
}

// Nothing of a scene comes more often than once in a year.
TEST(Simulator, WhatHardlyEverComesDoesNotComeNow) {
  for (const double rate : {1e-8, 1e-12, 1e-300}) {
    Options options = test::noiseless_scene();
    options.detection.signal_per_pulse = rate * 1e-7;
    options.ambient_per_s = rate;
    options.foreign.counts_per_s = rate;
    options.foreign.frequency_hz = 1e6;
    options.encoder_rate_hz = rate;
    options.encoder_start_s = 0;
    const std::vector<Tag> tags = test::simulate(options, paper_pattern());
    EXPECT_EQ(times_ps(tags, TagKind::photon).size(), 0U) << rate;
    EXPECT_EQ(times_ps(tags, TagKind::marker), std::vector<std::int64_t>{0}) << rate;
    EXPECT_EQ(times_ps(tags, TagKind::sync).size(), 13'228U) << rate;
  }
}

TEST(Simulator, EndsWithAHeartbeatAtItsLength) {
  Options options = test::noiseless_scene();
  options.seconds = 0.0123456;
  options.start_ps = 1000;
  EXPECT_EQ(test::simulate(options, paper_pattern()).back(), heartbeat_tag(12'345'601'000));
}

}  // namespace
}  // namespace splid::simulator
