#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "daemon/sockets/subscriber.hpp"
#include "protocol/json_value.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/program.hpp"

namespace splid::test {

inline constexpr const char* words_before_endpoint = "publishing at ";

// A laser's syncs come each 12.5 ns, and all of a frame fit into the ring.
inline constexpr const char* short_frames =
    R"(,"frame":{"length_ms":10},"pipeline":{"ring_capacity_tags":1048576})";

// A frame without what the host's clock and load say in it, in the time of the records.
inline std::string lasting(nlohmann::json frame, std::int64_t origin_ps = 0) {
  for (const char* name : {"timestamp", "compute_ms", "latency_ms"}) frame.erase(name);
  frame["start_ps"] = std::to_string(std::stoll(frame["start_ps"].get<std::string>()) - origin_ps);
  return frame.dump();
}

// Whether it logs these words before long.
inline bool says(const Program& program, const std::string& words) {
  return eventually([&] { return program.err().find(words) != std::string::npos; });
}

// The frames of a recording's replay.
inline std::vector<std::string> replayed(const std::string& recording, const std::string& config,
                                         std::int64_t origin_ps = 0) {
  const ProgramResult result =
      run_program({"replay", recording, "--config", config, "--json", "--no-publish"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  std::vector<std::string> frames;
  std::istringstream lines(result.out);
  for (std::string line; std::getline(lines, line);) {
    frames.push_back(lasting(json_value(line), origin_ps));
  }
  return frames;
}

// As many frames of a `splid run`, from the first. begin: makes its source send, once it publishes.
inline std::vector<std::string> live(const std::string& config, std::size_t count,
                                     const std::function<void(const Program& splid)>& begin) {
  const Program splid({"run", "--config", config});
  EXPECT_TRUE(says(splid, words_before_endpoint));
  const std::string err = splid.err();
  const auto at = err.find(words_before_endpoint) + std::strlen(words_before_endpoint);
  sockets::Subscriber subscriber(err.substr(at, err.find_first_of(" \n", at) - at), {"frame"});
  begin(splid);
  std::vector<std::string> frames;
  EXPECT_TRUE(eventually([&] {
    while (frames.size() < count) {
      const auto message = subscriber.receive(std::chrono::milliseconds{100});
      if (!message) return false;
      frames.push_back(lasting(json_value(message->json)));
    }
    return true;
  })) << splid.err();
  return frames;
}

// The same of one whose source is a bridge. start: starts the bridge, and plug_in its instrument
// once splid has connected, which says_absence tells: words that splid then logs.
inline std::vector<std::string> bridged(const std::string& config, std::size_t count,
                                        const std::function<std::unique_ptr<Program>()>& start,
                                        const std::string& says_absence,
                                        const std::function<void()>& plug_in) {
  std::unique_ptr<Program> bridge;
  std::vector<std::string> frames = live(config, count, [&](const Program& splid) {
    bridge = start();
    EXPECT_TRUE(says(splid, says_absence)) << bridge->err();
    plug_in();
  });
  EXPECT_EQ(frames.size(), count) << bridge->err();
  return frames;
}

}  // namespace splid::test
