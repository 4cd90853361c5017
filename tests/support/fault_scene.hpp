#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <string>
#include <vector>

#include "protocol/pattern_json.hpp"
#include "tests/support/faulty_bridge.hpp"
#include "tests/support/light_scene.hpp"
#include "tests/support/watched_daemon.hpp"
#include "tests/support/yardstick.hpp"

namespace splid::test {

inline constexpr const char* pattern_file =
    SPLID_SOURCE_DIR "/config/patterns/interleaved-180-189.json";

inline simulator::Options scene_options() {
  simulator::Options options;
  options.target.motion = simulator::MotionKind::linear;  // at rest
  options.target.distance_m = 284.5;
  return options;
}

inline std::vector<std::byte> noise(std::size_t bytes) {
  std::mt19937 random(5);
  std::vector<std::byte> made(bytes);
  for (std::byte& byte : made) byte = static_cast<std::byte>(random());
  return made;
}

inline std::string noise_text(std::size_t bytes) {
  const std::vector<std::byte> made = noise(bytes);
  return {reinterpret_cast<const char*>(made.data()), made.size()};
}

// The built program measures a live instrument behind a bridge with which things go wrong: a target
// at rest in 284.5 m.
class FaultScene : public ::testing::Test {
 protected:
  void start(const std::string& more = "") {
    config(more);
    daemon = std::make_unique<WatchedDaemon>(folder.path("config.json"), "tcp://127.0.0.1:*");
    ASSERT_TRUE(daemon->await_good_frame());
  }
  void config(const std::string& more) const {
    (void)folder.write(
        "config.json",
        R"({"schema":"splid.config","v":[1,0],"control":{"endpoint":")" + control +
            R"("},"source":{"driver":"bridge","address":")" + bridge.address() +
            R"("},"channels":{"photon":[1],"sync":"8"},"estimator":{"effort":"fast"},)"
            R"("pipeline":{"ring_capacity_tags":524288},"pattern":{"file":")" +
            pattern_file + R"("},"publish":{"endpoint":"tcp://127.0.0.1:*")" + publish + "}" +
            with_light_scene(more) + "}");
  }

  // Where the log says that the daemon listens, after these words.
  [[nodiscard]] int port_after(const std::string& words) const {
    const std::string err = daemon->program->err();
    const auto at = err.find(words);
    return at == std::string::npos ? 0 : std::stoi(err.substr(at + words.size()));
  }

  void TearDown() override {
    if (daemon == nullptr) return;
    const auto begin = WatchedDaemon::Clock::now();
    const ProgramResult result = daemon->stop();
    EXPECT_TRUE(yardstick.keeps(stop_ms, WatchedDaemon::ms_since(begin))) << result.err;
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }

  static constexpr double stop_ms = 1000;  // from SIGTERM to the end, as docs/guide/service.md says

  TempFolder folder;
  Yardstick yardstick;
  FaultyBridge bridge{
      folder.path("bridge"),
      SceneRecords(pattern_from_json(file_text(pattern_file), pattern_file), scene_options())};
  std::string control = "off";  // its endpoint
  std::string publish;          // further members of that object
  std::unique_ptr<WatchedDaemon> daemon;
};

}  // namespace splid::test
