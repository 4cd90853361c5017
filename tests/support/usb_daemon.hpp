#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <chrono>
#include <csignal>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/sockets/subscriber.hpp"
#include "drivers/simulator/simulator_options.hpp"
#include "protocol/frame_json.hpp"
#include "protocol/status_json.hpp"
#include "tests/support/patience.hpp"
#include "tests/support/program.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/yardstick.hpp"

namespace splid::test {

// The built program, unmodified and in a process of its own, which measures what an emulated USB
// device sends: a scene of scene_options(), with the pattern of pattern_file.
class UsbDaemonRun {
 public:
  static constexpr std::int64_t frame_ps = 50'000'000'000;
  static constexpr const char* pattern_file =
      SPLID_SOURCE_DIR "/config/patterns/interleaved-180-189.json";

  static simulator::Options scene_options() {
    simulator::Options options;
    options.target.motion = simulator::MotionKind::linear;  // at rest
    options.target.distance_m = 284.5;
    return options;
  }

  // source: the configuration's source and channels, with the comma between them. To be called once
  // the double of the device is there.
  void start(const std::string& source) {
    setenv("LD_PRELOAD", "libumockdev-preload.so.0", 1);
    // The preloaded library comes before a sanitizer's, which that does not like but bears.
    setenv("ASAN_OPTIONS", "verify_asan_link_order=0:detect_leaks=0", 1);
    daemon = std::make_unique<Program>(
        std::vector<std::string>{"run", "--config", write_config(source)});
    unsetenv("LD_PRELOAD");
    unsetenv("ASAN_OPTIONS");
  }

  // To be called before the double goes.
  void stop() {
    daemon->signal(SIGTERM);
    const ProgramResult result = daemon->wait();
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }

  // The first message of that topic from now on that is meant.
  std::optional<std::string> await(const std::string& topic,
                                   const std::function<bool(const std::string&)>& meant) {
    const auto began = std::chrono::steady_clock::now();
    while (std::chrono::steady_clock::now() - began < patience) {
      const auto message = subscriber.receive(std::chrono::milliseconds{100});
      if (message && message->topic == topic_status) statuses += message->json;
      if (message && message->topic == topic && meant(message->json)) {
        waited =
            std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - began);
        return message->json;
      }
    }
    ADD_FAILURE() << "no such " << topic << "; the program said: " << daemon->err();
    return std::nullopt;
  }

  bool await_status(const std::string& state, const std::string& reason) {
    const bool came = await(topic_status, [&](const std::string& json) {
                        return json.find("\"device\":\"" + state + '"') != std::string::npos &&
                               json.find(reason) != std::string::npos;
                      }).has_value();
    said_ms = waited.count();
    return came;
  }

  // A frame that measures the target, of that time or later.
  std::optional<FrameMessage> await_frame(std::int64_t start_ps = 0) {
    std::optional<FrameMessage> frame;
    await(topic_frame, [&](const std::string& json) {
      frame = frame_from_json(json);
      return frame->status == FrameStatus::ok && frame->start_ps >= start_ps;
    });
    if (frame && frame->distance_m) {
      EXPECT_NEAR(*frame->distance_m, 284.5, 0.5);
    }
    return frame;
  }

  // Everything that was published before is passed over.
  void forget() {
    while (subscriber.receive(std::chrono::milliseconds{0})) {
    }
  }

  TempFolder folder;
  Yardstick yardstick;
  sockets::Subscriber subscriber{"ipc://" + folder.path("socket"), {topic_frame, topic_status}};
  std::unique_ptr<Program> daemon;
  std::chrono::duration<double, std::milli> waited{0};
  double said_ms = -1;
  std::string statuses;  // all that were heard

 private:
  [[nodiscard]] std::string write_config(const std::string& source) const {
    return folder.write("config.json", R"({"schema":"splid.config","v":[1,0],)" + source +
                                           R"(,"estimator":{"effort":"fast"},)"
                                           R"("pattern":{"file":")" +
                                           pattern_file + R"("},"publish":{"endpoint":"ipc://)" +
                                           folder.path("socket") + R"("}})");
  }
};

}  // namespace splid::test
