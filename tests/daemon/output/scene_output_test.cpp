#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "daemon/output/output.hpp"
#include "daemon/sockets/subscriber.hpp"
#include "protocol/json_value.hpp"
#include "protocol/scene_json.hpp"
#include "tests/support/field_scene.hpp"
#include "tests/support/measured_stream.hpp"
#include "tests/support/patience.hpp"

// What is published of several pixels.

namespace splid {
namespace {

using testing::ElementsAre;
using testing::Pair;

constexpr std::size_t pixels = 4;

using Received = std::map<std::string, std::vector<std::string>>;

// What a subscriber to these topics hears of four pixels, the last of which counts nothing.
Received heard(const std::vector<std::string>& topics, double seconds = 0.26,
               const std::vector<std::string>& seen_subscribed = {}) {
  Config config = test::with_pixels(scene_config(0, 2), test::pixels_of(pixels));
  config.pixels[pixels - 1].input = config.channels.pixels[pixels - 1] = 77;
  config.pixels[0].azimuth_deg = -1.5;
  Publisher publisher(config.publish.endpoint, 1000);
  sockets::Subscriber subscriber(publisher.endpoint(), topics);
  EXPECT_TRUE(publisher.wait_for_subscriber(test::patience));
  std::uint64_t known = 0;
  std::vector<std::string> subscribed;
  while (subscribed.size() < seen_subscribed.size()) {
    if (auto now = publisher.pixel_topics(known)) subscribed = std::move(*now);
  }
  EXPECT_EQ(subscribed, seen_subscribed);
  test::MeasuredStream measured(config,
                                test::script(test::field_tags(pixels, seconds, config.pattern)),
                                publisher, host_clock());
  const StreamSummary summary = measured.run({});
  EXPECT_LE(summary.frames, summary.valid_frames + 1);
  Received received;
  while (true) {
    const auto message = subscriber.receive(test::patience);
    if (!message) ADD_FAILURE() << "no end";
    if (!message) break;
    received[message->topic].push_back(message->json);
    if (message->topic == topic_status &&
        message->json.find("\"state\":\"stopping\"") != std::string::npos) {
      break;
    }
  }
  return received;
}

TEST(SceneOutput, IsAMessageAFrameWithAnArrayOfThePixelsValues) {
  const Received received = heard({""});
  std::vector<std::string> topics;
  for (const auto& [topic, messages] : received) topics.push_back(topic);
  EXPECT_THAT(topics, ElementsAre("scene", "status", "version"));
  const std::vector<std::string>& scenes = received.at("scene");
  ASSERT_GE(scenes.size(), 5U);
  for (std::size_t k = 0; k + 1 < scenes.size(); ++k) {  // the last is cut short
    const SceneMessage scene = scene_from_json(scenes[k]);
    EXPECT_EQ(scene.whole.sequence, k);
    ASSERT_EQ(scene.pixels.size(), pixels);
    EXPECT_EQ(scene.pixels[0].azimuth_deg, -1.5);
    for (std::size_t p = 0; p + 1 < pixels; ++p) {
      EXPECT_EQ(scene.pixels[p].name, std::to_string(p + 1));
      EXPECT_EQ(scene.pixels[p].frame.status, FrameStatus::ok) << k << " " << p;
      EXPECT_NEAR(scene.pixels[p].frame.velocity_mps.value_or(99), 0.5 * static_cast<double>(p) - 2,
                  0.2);
    }
    EXPECT_EQ(scene.pixels[pixels - 1].frame.status, FrameStatus::no_target);
    EXPECT_EQ(scene.pixels[pixels - 1].frame.distance_m, std::nullopt);
  }
}

TEST(SceneOutput, HasAPixelsFrameWhileSomebodyAsksForIt) {
  const Received received = heard({"frame/2", "status"}, 0.26, {"frame/2"});
  ASSERT_TRUE(received.contains("frame/2"));
  EXPECT_FALSE(received.contains("scene"));
  EXPECT_FALSE(received.contains("frame/1"));
  const FrameMessage frame = frame_from_json(received.at("frame/2").at(1));
  EXPECT_EQ(frame.status, FrameStatus::ok);
  EXPECT_NEAR(frame.velocity_mps.value_or(99), -1.5, 0.2);
  EXPECT_EQ(frame.pixel, "2");
  EXPECT_GT(frame.photons.value_or(0), 1000U);
}

TEST(SceneOutput, HasAllPixelsFramesForWhoAsksForThePrefix) {
  const Received received = heard({"frame/", "status"}, 0.26, {"frame/"});
  for (const char* topic : {"frame/1", "frame/2", "frame/3", "frame/4"}) {
    EXPECT_TRUE(received.contains(topic)) << topic;
  }
}

TEST(SceneOutput, NamesDarkPixelsInTheStatus) {
  const Received received = heard({"scene", "status"}, 1.2);
  const auto status = json_value(received.at("status").back());
  EXPECT_EQ(status["pixels"], json_value(R"({"count":4,"by_status":{"incomplete":4},)"
                                         R"("dark":1,"hot":0,"dark_names":["4"]})"));
}

}  // namespace
}  // namespace splid
