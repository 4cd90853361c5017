#include "daemon/output/output.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "daemon/sockets/subscriber.hpp"
#include "tests/support/allocation_count.hpp"
#include "tests/support/daemon_scene.hpp"
#include "tests/support/field_scene.hpp"
#include "tests/support/measured_stream.hpp"
#include "tests/support/patience.hpp"
#include "tests/support/scripted_source.hpp"

namespace splid {
namespace {

using std::chrono::milliseconds;
using test::MeasuredStream;
using testing::AllOf;
using testing::ElementsAreArray;
using testing::HasSubstr;

struct Outcome {
  StreamSummary summary;
  std::vector<std::string> json;
  std::vector<FrameMessage> frames;
};

Outcome run(const Config& config, std::unique_ptr<TagSource> source, std::stop_token stop = {}) {
  Publisher publisher(config.publish.endpoint, 1000);
  MeasuredStream measured(config, std::move(source), publisher, host_clock());
  Outcome outcome;
  measured.observe([&](const FrameMessage& frame, const std::string& json) {
    outcome.json.push_back(json);
    outcome.frames.push_back(frame);
    return true;
  });
  outcome.summary = measured.run(stop);
  return outcome;
}

Outcome run_scene(double seconds, std::int64_t threads) {
  const Config config = scene_config(seconds, threads);
  return run(config, open_scene(config));
}

std::vector<std::string> repeatable_all(std::vector<std::string> lines) {
  for (std::string& line : lines) line = splid::repeatable(std::move(line));
  return lines;
}

// The threads between driver and estimate, which are to allocate nothing once they run.
bool on_hot_thread() {
  std::array<char, 16> name{};
  pthread_getname_np(pthread_self(), name.data(), name.size());
  const std::string_view text = name.data();
  return text == "source" || text == "framer" || text.substr(0, 8) == "estimate";
}

bool on_no_thread() { return false; }

// Syncs of the pattern and a photon in each 100th period.
std::vector<Tag> steady_tags(std::int64_t periods) {
  constexpr std::int64_t period_ps = 3'780'000;
  std::vector<Tag> tags;
  for (std::int64_t i = 0; i < periods; ++i) {
    tags.push_back(sync_tag(i * period_ps));
    if (i % 100 == 0) tags.push_back(photon_tag(i * period_ps + 1000, 1));
  }
  return tags;
}

TEST(Output, MeasuresTheSimulatedTarget) {
  const Outcome outcome = run_scene(0.5, 1);
  ASSERT_GE(outcome.frames.size(), 10u);
  EXPECT_GE(outcome.summary.valid_frames, 9u);
  EXPECT_EQ(outcome.summary.lost_tags, 0u);
  EXPECT_EQ(outcome.summary.fault, nullptr);
  for (std::size_t i = 0; i < 9; ++i) {
    ASSERT_TRUE(outcome.frames[i].valid());
    EXPECT_NEAR(*outcome.frames[i].distance_m, 284.5, 1);
  }
}

TEST(Output, PublishesTheSameFramesInOrderWhateverTheThreads) {
  const Outcome one = run_scene(0.6, 1);
  ASSERT_GE(one.frames.size(), 12u);
  for (std::size_t i = 0; i < one.frames.size(); ++i) EXPECT_EQ(one.frames[i].sequence, i);
  for (const std::int64_t threads : {2, 5}) {
    EXPECT_THAT(repeatable_all(run_scene(0.6, threads).json),
                ElementsAreArray(repeatable_all(one.json)))
        << threads;
  }
}

TEST(Output, SubscribersGetTheObserversBytes) {
  const Config config = scene_config(0.3, 2);
  Publisher publisher(config.publish.endpoint, 1000);
  sockets::Subscriber subscriber(publisher.endpoint(), {""});
  ASSERT_TRUE(publisher.wait_for_subscriber(test::patience));
  MeasuredStream measured(config, open_scene(config), publisher, host_clock());
  std::vector<std::string> observed;
  measured.observe([&](const FrameMessage&, const std::string& json) {
    observed.push_back(json);
    return true;
  });
  (void)measured.run({});
  std::vector<std::string> received;
  std::set<std::string> topics;
  std::string last_status;
  while (const auto message = subscriber.receive(milliseconds{500})) {
    topics.insert(message->topic);
    if (message->topic == topic_frame) received.push_back(message->json);
    if (message->topic == topic_status) last_status = message->json;
  }
  EXPECT_THAT(received, ElementsAreArray(observed));
  EXPECT_THAT(topics, testing::ElementsAre("frame", "status", "version"));
  EXPECT_THAT(last_status, HasSubstr("\"stopping\""));
}

// What a second of detections shows of the detector, with the key of the configuration.
TEST(Output, TheStatusHasTheDeadTimeThatIsNotGiven) {
  const auto findings = [](double source_ns, double configured_ns) {
    Config config = scene_config(1.2);
    auto& scene = dynamic_cast<simulator::Options&>(*config.source);
    scene.ambient_per_s = 2e6;
    scene.detector.dead_time_ns = source_ns;
    config.detector.dead_time_ns = configured_ns;
    Publisher publisher(config.publish.endpoint, 1000);
    (void)MeasuredStream(config, open_scene(config), publisher, host_clock()).run({});
    return findings_from_json(publisher.last_status());
  };
  const auto found = findings(50, 0);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].name, "dead_time");
  EXPECT_NEAR(found[0].value, 50, 0.5);
  EXPECT_EQ(found[0].unit, "ns");
  EXPECT_THAT(found[0].advice, HasSubstr("detector.dead_time_ns"));
  EXPECT_TRUE(findings(50, 50).empty());
  EXPECT_TRUE(findings(0, 0).empty());
}

TEST(Output, TheEndOfAStreamIsNoLossInTheStatus) {
  const Config config = scene_config(0.52);
  Publisher publisher(config.publish.endpoint, 1000);
  sockets::Subscriber subscriber(publisher.endpoint(), {""});
  ASSERT_TRUE(publisher.wait_for_subscriber(test::patience));
  MeasuredStream measured(config, open_scene(config), publisher, host_clock());
  const StreamSummary summary = measured.run({});
  EXPECT_EQ(summary.frames - summary.valid_frames, 1u);
  std::size_t heard = 0;
  while (const auto message = subscriber.receive(milliseconds{300})) {
    if (message->topic != topic_status) continue;
    EXPECT_THAT(message->json, testing::Not(HasSubstr("degraded")));
    ++heard;
  }
  EXPECT_GE(heard, 2u);
}

TEST(Output, PublishesWhatCameBeforeTheSourceFailed) {
  const Config config = scene_config(0);
  const Outcome outcome = run(
      config, std::make_unique<ScriptedSource>(steady_tags(30'000), SourceInfo{"script", false, {}},
                                               ScriptedSource::End::error));
  EXPECT_EQ(outcome.frames.size(), 3u);  // 113.4 ms
  EXPECT_EQ(outcome.summary.tags.events, 30'300u);
  ASSERT_NE(outcome.summary.fault, nullptr);
  try {
    std::rethrow_exception(outcome.summary.fault);
  } catch (const Error& error) {
    EXPECT_EQ(error.exit_code(), 3);
    EXPECT_THAT(error.what(), HasSubstr("the cable came off"));
  }
}

TEST(Output, StopDrainsWhatCame) {
  const Config config = scene_config(0);
  std::stop_source stop;
  auto source = std::make_unique<ScriptedSource>(
      steady_tags(20'000), SourceInfo{"script", true, {}}, ScriptedSource::End::until_stopped);
  source->stop_when_sent(stop);
  const Outcome outcome = run(config, std::move(source), stop.get_token());
  EXPECT_EQ(outcome.summary.tags.events + outcome.summary.discarded_tags, 20'200u);
  EXPECT_EQ(outcome.summary.discarded_tags, 0u);
  EXPECT_EQ(outcome.frames.size(), 2u);  // 75.6 ms
  EXPECT_EQ(outcome.summary.fault, nullptr);
}

// Streams follow each other: subscribers hear of no end in between, and one row of frames.
TEST(Output, GoesOnWithTheNextStreamWhereTheOneBeforeEnded) {
  const Config config = scene_config(0.3);
  Publisher publisher(config.publish.endpoint, 1000);
  std::uint64_t next = 0;
  std::uint64_t events = 0;
  Stream* running = nullptr;
  Output output(output_options(config),
                {publisher, nullptr, nullptr,
                 [&](const FrameMessage& frame, const std::string&) {
                   EXPECT_EQ(frame.sequence, next++);
                   running->request_stop();
                   return true;
                 }},
                host_clock());
  for (int i = 0; i < 3; ++i) {
    Stream stream(stream_options(config), open_scene(config), host_clock());
    running = &stream;
    output.begin();
    const StreamSummary summary = output.publish(stream);
    EXPECT_GE(summary.frames, 1u);
    events += summary.tags.events;
    EXPECT_EQ(publisher.last_status().find("stopping"), std::string::npos);
    output.wait("somebody else has the tagger");
    EXPECT_THAT(publisher.last_status(),
                AllOf(HasSubstr("waiting_for_device"), HasSubstr("somebody else has the tagger"),
                      HasSubstr("\"tags\":" + std::to_string(events)),
                      HasSubstr("\"frames\":" + std::to_string(next))));
  }
  output.stop("");
  EXPECT_THAT(publisher.last_status(),
              AllOf(HasSubstr("stopping"), HasSubstr("\"frames\":" + std::to_string(next))));
}

TEST(Output, AnObserverThatFailsEndsTheStreamWithItsError) {
  const Config config = scene_config(5);
  Publisher publisher(config.publish.endpoint, 1000);
  MeasuredStream measured(config, open_scene(config), publisher, host_clock());
  int heard = 0;
  measured.observe([&](const FrameMessage&, const std::string&) -> bool {
    ++heard;
    throw Error(Fault::device, "standard output: no room");
  });
  EXPECT_THROW((void)measured.run({}), Error);
  EXPECT_EQ(heard, 1);
}

TEST(Output, AReplayLosesNothingThroughASmallRing) {
  Config config = scene_config(0);
  config.pipeline.ring_capacity_tags = 1 << 14;
  const Outcome outcome = run(config, std::make_unique<ScriptedSource>(
                                          steady_tags(200'000), SourceInfo{"script", false, {}}));
  EXPECT_EQ(outcome.summary.tags.events, 202'000u);
  EXPECT_EQ(outcome.summary.tags.syncs, 200'000u);
  EXPECT_EQ(outcome.summary.lost_tags, 0u);
}

TEST(Output, TimesFollowTheSourceAndNeverTheHost) {
  const Config config = scene_config(0);
  SourceInfo info{"script", false, {}};
  info.start_unix_s = 1e9;
  const Outcome outcome = run(config, std::make_unique<ScriptedSource>(steady_tags(15'000), info));
  ASSERT_FALSE(outcome.frames.empty());
  EXPECT_NEAR(outcome.frames[0].timestamp_s, 1e9 + 0.025, 1e-4);
  const Outcome unknown = run(config, std::make_unique<ScriptedSource>(
                                          steady_tags(15'000), SourceInfo{"script", false, {}}));
  EXPECT_NEAR(unknown.frames[0].timestamp_s, 0.025, 1e-4);
}

TEST(Output, TellsOfSyncsAtAnotherPeriod) {
  Config config = scene_config(0);
  config.pattern = make_periodic(Mode::baseline, 3'770'000);
  const Outcome outcome = run(config, std::make_unique<ScriptedSource>(
                                          steady_tags(80'000), SourceInfo{"script", false, {}}));
  EXPECT_EQ(outcome.summary.locked_frames, 0u);
  ASSERT_TRUE(outcome.summary.diagnosis);
  EXPECT_NEAR(outcome.summary.diagnosis->sync_period_ps.value_or(0), 3'780'000, 1);
}

// Of the hot threads, from the second published frame on, by when every thread runs.
void expect_no_allocation(const Config& config, std::unique_ptr<TagSource> source,
                          std::uint64_t least_frames) {
  Publisher publisher(config.publish.endpoint, 1000);
  MeasuredStream measured(config, std::move(source), publisher, host_clock());
  test::counted_thread = on_no_thread;
  test::allocations = 0;
  measured.observe([&](const FrameMessage& frame, const std::string&) {
    if (frame.sequence == 1) test::counted_thread = on_hot_thread;
    return true;
  });
  const StreamSummary summary = measured.run({});
  // Read before those of all threads count again: ZeroMQ's allocate when they like.
  const std::uint64_t allocated = test::allocations;
  test::counted_thread = nullptr;
  EXPECT_GE(summary.frames, least_frames);
  EXPECT_EQ(allocated, 0u);
}

TEST(Output, HotThreadsAllocateNothingAfterStart) {
  const Config config = scene_config(0.6, 2);
  expect_no_allocation(config, open_scene(config), 12);
}

TEST(Output, HotThreadsAllocateNothingForSeveralPixels) {
  const Config config = test::with_pixels(scene_config(0, 2), test::pixels_of(4));
  const SourceInfo live{"field", true, 0.0, false};
  expect_no_allocation(
      config, std::make_unique<ScriptedSource>(test::field_tags(4, 0.6, config.pattern), live), 5);
}

}  // namespace
}  // namespace splid
