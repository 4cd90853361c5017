#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "daemon/sockets/subscriber.hpp"
#include "protocol/json_value.hpp"
#include "tests/support/light_scene.hpp"
#include "tests/support/patience.hpp"
#include "tests/support/python_program.hpp"

// The bridges that are shipped, as programs of their own, with the built program at the other end.

namespace splid {
namespace {

using nlohmann::json;
using splid::test::Program;
using splid::test::python;
using splid::test::TempFolder;
using std::chrono::steady_clock;

constexpr const char* pattern_file = SPLID_SOURCE_DIR "/config/patterns/interleaved-180-189.json";

class BridgeProgram : public ::testing::Test {
 protected:
  // The next frame from a `splid run` of this configuration that `wanted` is true for.
  template <class Wanted>
  std::optional<json> frame(sockets::Subscriber& frames, const Wanted& wanted) {
    const auto deadline = steady_clock::now() + test::patience;
    while (steady_clock::now() < deadline) {
      const auto message = frames.receive(std::chrono::milliseconds{200});
      if (!message) continue;
      json found = json_value(message->json);
      if (wanted(found)) return found;
    }
    return std::nullopt;
  }

  std::string config() const {
    return folder.write(
        "config.json",
        R"({"schema":"splid.config","v":[1,0],"source":{"driver":"bridge","address":")" + address +
            R"("},"channels":{"photon":[1],"sync":"8","encoder":""},"pattern":{"file":")" +
            pattern_file + R"("},"publish":{"endpoint":")" + endpoint + "\"}" + test::small_ring +
            "}");
  }

  TempFolder folder;
  std::string address = "unix:" + folder.path("bridge.sock");
  std::string endpoint = "ipc://" + folder.path("frames");
};

TEST_F(BridgeProgram, SwabiansTagsBecomeFrames) {
  constexpr double distance_m = 120;
  constexpr double sync_delay_m = 100e-9 * 299'792'458.0 / 2;
  const Program bridge = python(
      "drivers/bridge/python/swabian_bridge.py", {"--listen", address, "1:0.5", "8:0.25:100000"},
      {"SPLID_DISTANCE_M=120", std::string("SPLID_PATTERN=") + pattern_file});
  const Program splid({"run", "--config", config()});
  sockets::Subscriber frames(endpoint, {"frame"});
  const auto good =
      frame(frames, [](const json& f) { return f["status"] == "ok" && f["seen_fraction"] == 1; });
  ASSERT_TRUE(good) << bridge.err() << splid.err();
  EXPECT_NEAR((*good)["distance_m"], distance_m - sync_delay_m, 0.01);
  EXPECT_NEAR((*good)["velocity_mps"], 0, 0.5);
  EXPECT_GT(std::stoll((*good)["start_ps"].get<std::string>()), 340'000'000'000'000'000);
  EXPECT_EQ((*good)["lost_tags"], 0);
  // 0.02 of 40 pulses in each of some 13,228 periods; tags of input 3 are not among them.
  EXPECT_NEAR((*good)["photons"], 10'580, 600);
  const auto overflowed = frame(frames, [](const json& f) { return f["lost_tags"] != 0; });
  ASSERT_TRUE(overflowed) << bridge.err() << splid.err();
  EXPECT_EQ((*overflowed)["lost_tags"], 513);
}

TEST_F(BridgeProgram, AFilesTagsBecomeFrames) {
  address = "unix:" + folder.path("file.sock");
  constexpr int periods = 40'000;
  {
    std::ofstream tags(folder.path("tags.txt"));
    for (std::int64_t i = 0; i < periods; ++i) {
      tags << i * 3'780'000 << " 8\n" << i * 3'780'000 + 666'000 << " 1\n";
    }
  }
  const Program bridge = python("drivers/bridge/python/file_bridge.py",
                                {"--listen", address, folder.path("tags.txt")});
  const Program splid({"run", "--config", config()});
  sockets::Subscriber frames(endpoint, {"frame"});
  const auto found = frame(frames, [](const json& f) { return f["seen_fraction"] == 1; });
  ASSERT_TRUE(found) << bridge.err() << splid.err();
  EXPECT_EQ((*found)["photons"], (*found)["sync"]["count"]);
  EXPECT_NEAR((*found)["photons"], 13'228, 1);
}

TEST_F(BridgeProgram, AFilesMarkHeaderAndCommasAreNoTags) {
  address = "unix:" + folder.path("file.sock");
  {
    std::ofstream tags(folder.path("tags.csv"));
    tags << "\xef\xbb\xbftime_ps,channel\r\n";
    for (std::int64_t i = 0; i < 40'000; ++i) {
      tags << i * 3'780'000 << ",8\r\n" << i * 3'780'000 + 666'000 << ", 1\r\n";
    }
  }
  const Program bridge = python("drivers/bridge/python/file_bridge.py",
                                {"--listen", address, folder.path("tags.csv")});
  const Program splid({"run", "--config", config()});
  sockets::Subscriber frames(endpoint, {"frame"});
  const auto found = frame(frames, [](const json& f) { return f["seen_fraction"] == 1; });
  ASSERT_TRUE(found) << bridge.err() << splid.err();
  EXPECT_EQ((*found)["photons"], (*found)["sync"]["count"]);
  EXPECT_NEAR((*found)["photons"], 13'228, 1);
}

TEST_F(BridgeProgram, AFileThatCannotBeServedIsSaidAtOnce) {
  const std::string file = folder.path("tags.txt");
  const auto said = [&](const std::string& content) {
    folder.write("tags.txt", content);
    Program bridge = python("drivers/bridge/python/file_bridge.py",
                            {"--listen", "unix:" + folder.path("file.sock"), file});
    const auto result = bridge.wait();
    EXPECT_EQ(result.exit_code, 1) << content;
    EXPECT_THAT(result.err, testing::StartsWith(file + ": "));
    return result.err;
  };
  EXPECT_EQ(said("5 8\n7 1\n6 1\n9 1\n"),
            file +
                ": tag 3, at 6 ps, follows a tag at 7 ps; sort the file by time, as sort -n does"
                "\n");
  for (const char* content : {"5 8\n7 x\n", "5 8\n7.5 1\n", "5 8 1\n6 8 1\n", "5 8\n6\n"}) {
    EXPECT_THAT(said(content), testing::HasSubstr("each line must be TIME_PS CHANNEL"));
  }
}

}  // namespace
}  // namespace splid
