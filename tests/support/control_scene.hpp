#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "daemon/sockets/subscriber.hpp"
#include "protocol/frame_json.hpp"
#include "protocol/status_json.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/light_scene.hpp"
#include "tests/support/program.hpp"

namespace splid::test {

using std::chrono::milliseconds;

// A daemon with a control socket, and splid ctl to ask it.
class ControlScene : public ::testing::Test {
 protected:
  std::string configure(const std::string& source = light_source,
                        const std::string& more = "") const {
    return folder.write(
        "config.json",
        R"({"schema":"splid.config","v":[1,0],"source":{)" + source +
            R"(},"pattern":{"file":")" SPLID_SOURCE_DIR
            R"(/config/patterns/interleaved-180-189.json"},"publish":{"endpoint":")" +
            frames + R"("},"control":{"endpoint":")" + endpoint + "\"}" +
            with_light_scene(more + small_ring) + "}");
  }
  // Runs it until it measures.
  void run(const std::string& config) {
    daemon = std::make_unique<Program>(std::vector<std::string>{"run", "--config", config});
    ASSERT_TRUE(eventually([this] { return measures(); })) << daemon->err();
  }
  ProgramResult ctl(std::vector<std::string> words) const {
    words.insert(words.begin(), {"ctl", "--endpoint", endpoint});
    return run_program(words);
  }
  // Frames come; on a machine that is slow with their effort lowered.
  bool measures() const {
    const std::string said = status();
    return said.find("\"streaming\"") != std::string::npos ||
           said.find("\"degraded\"") != std::string::npos;
  }
  // The daemon's status; empty where nobody answers.
  std::string status() const {
    if (!std::filesystem::exists(socket)) return "";
    return ctl({"--json", "status"}).out;
  }
  void end() {
    daemon->signal(SIGTERM);
    const ProgramResult result = daemon->wait();
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }

  TempFolder folder;
  std::string socket = folder.path("control");
  std::string endpoint = "ipc://" + socket;
  std::string frames = "ipc://" + folder.path("frames");
  std::unique_ptr<Program> daemon;
};

// Hears every frame on a thread of its own, and whether one is missing.
class FrameWatch {
 public:
  explicit FrameWatch(const std::string& endpoint) : subscriber_(endpoint, {topic_frame}) {}
  ~FrameWatch() { stop(); }
  FrameWatch(const FrameWatch&) = delete;
  FrameWatch& operator=(const FrameWatch&) = delete;

  [[nodiscard]] int frames() const { return frames_; }
  [[nodiscard]] int missing() const { return missing_; }
  void stop() {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
  }

 private:
  void listen(const std::stop_token& stop) {
    std::uint64_t next = 0;
    while (!stop.stop_requested()) {
      const auto message = subscriber_.receive(milliseconds{50});
      if (!message) continue;
      const std::uint64_t sequence = frame_from_json(message->json).sequence;
      if (frames_ > 0 && sequence != next) ++missing_;
      next = sequence + 1;
      ++frames_;
    }
  }

  sockets::Subscriber subscriber_;
  std::atomic<int> frames_{0};
  std::atomic<int> missing_{0};
  std::jthread thread_{[this](const std::stop_token& stop) { listen(stop); }};
};

}  // namespace splid::test
