#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "daemon/sockets/subscriber.hpp"
#include "protocol/frame_json.hpp"
#include "protocol/status_json.hpp"
#include "tests/support/fault_record.hpp"
#include "tests/support/patience.hpp"
#include "tests/support/program.hpp"

namespace splid::test {

// A `splid run` with a subscriber that keeps count of what it says.
class WatchedDaemon {
 public:
  using Clock = std::chrono::steady_clock;
  using FrameTest = std::function<bool(const FrameMessage&)>;

  // endpoint: that of the configuration, or one of TCP with port *, which the log then resolves.
  WatchedDaemon(const std::string& config, const std::string& endpoint)
      : program(std::make_unique<Program>(std::vector<std::string>{"run", "--config", config})),
        subscriber_(endpoint.ends_with('*') ? said_endpoint() : endpoint,
                    {topic_frame, topic_status}) {}

  // Waits for the first frame that passes. Each frame until then is counted, and must follow the
  // frame before it.
  bool await_frame(const FrameTest& meant) {
    return await([&](const sockets::Subscriber::Message& message) {
      return message.topic == topic_frame && meant(*last_frame);
    });
  }
  static bool is_good(const FrameMessage& frame) {
    return frame.status == FrameStatus::ok && frame.seen_fraction.value_or(0) == 1;
  }
  bool await_good_frame() { return await_frame(is_good); }

  // A frame that a fault cut near its end is valid. 0.998: the dead time of 40 us between two
  // sub-acquisitions hurts none.
  static bool is_hurt(const FrameMessage& frame) {
    return !frame.valid() || frame.seen_fraction.value_or(1) < 0.998;
  }

  // Waits for the first status whose reason has these words. Its state and its reason are then in
  // `said`.
  bool await_status(const std::string& words) {
    return await([&](const sockets::Subscriber::Message& message) {
      if (message.topic != topic_status) return false;
      const std::string reason = member(message.json, "reason");
      if (reason.find(words) == std::string::npos) return false;
      said = member(message.json, "state") + ": " + reason;
      return true;
    });
  }

  // Forgets what was counted, and all messages that have come by now.
  void start_counting() {
    while (const auto message = subscriber_.receive(std::chrono::milliseconds{0})) take(*message);
    lost_tags = frames = bad_frames = hurt_frames = 0;
    unseen_ms = 0;
  }
  // Of the frames since then.
  [[nodiscard]] std::string losses() const {
    char text[120];
    std::snprintf(text, sizeof text, "%llu tags, %.1f ms, %llu of %llu frames",
                  static_cast<unsigned long long>(lost_tags), unseen_ms,
                  static_cast<unsigned long long>(bad_frames),
                  static_cast<unsigned long long>(frames));
    return text;
  }
  static double ms_since(Clock::time_point begin) {
    return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
  }

  // After SIGTERM.
  ProgramResult stop() const {
    program->signal(SIGTERM);
    return program->wait();
  }

  std::unique_ptr<Program> program;
  std::optional<FrameMessage> last_frame;
  std::string said;
  std::uint64_t lost_tags = 0;
  double unseen_ms = 0;
  std::uint64_t bad_frames = 0;  // that say neither where the target is nor that there is none
  std::uint64_t hurt_frames = 0;
  std::uint64_t frames = 0;

 private:
  bool await(const std::function<bool(const sockets::Subscriber::Message&)>& meant) {
    const auto deadline = Clock::now() + patience;
    while (Clock::now() < deadline) {
      const auto message = subscriber_.receive(std::chrono::milliseconds{100});
      if (!message) continue;
      take(*message);
      if (meant(*message)) return true;
    }
    ADD_FAILURE() << "it did not come; the program said: " << program->err();
    return false;
  }

  void take(const sockets::Subscriber::Message& message) {
    if (message.topic != topic_frame) return;
    FrameMessage frame = frame_from_json(message.json);
    if (last_frame) {
      EXPECT_EQ(frame.sequence, last_frame->sequence + 1);
    }
    ++frames;
    bad_frames += frame.valid() || frame.status == FrameStatus::no_target ? 0 : 1;
    hurt_frames += is_hurt(frame) ? 1 : 0;
    lost_tags += frame.lost_tags.value_or(0);
    unseen_ms += (1 - frame.seen_fraction.value_or(1)) * frame.duration_ms;
    last_frame = std::move(frame);
  }

  [[nodiscard]] std::string said_endpoint() const {
    const std::string words = "publishing at ";
    for (int i = 0; i < 12'000; ++i) {
      const std::string err = program->err();
      const auto at = err.find(words);
      const auto end = at == std::string::npos ? at : err.find_first_of(" \n", at + words.size());
      if (end != std::string::npos) return err.substr(at + words.size(), end - at - words.size());
      std::this_thread::sleep_for(std::chrono::milliseconds{10});
    }
    throw std::runtime_error("it publishes nowhere: " + program->err());
  }

  // The text of a member; a quote inside ends it, which is enough here.
  static std::string member(const std::string& json, const std::string& name) {
    const std::string key = '"' + name + "\":\"";
    const auto at = json.find(key);
    if (at == std::string::npos) return {};
    const auto begin = at + key.size();
    return json.substr(begin, json.find('"', begin) - begin);
  }

  sockets::Subscriber subscriber_;
};

}  // namespace splid::test
