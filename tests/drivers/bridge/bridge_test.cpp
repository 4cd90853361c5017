#include "drivers/bridge/bridge.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "protocol/error.hpp"
#include "tests/support/bridge_server.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/running_bridge.hpp"
#include "tests/support/tags16_block.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid {
namespace {

using test::block_bytes;
using test::BridgeServer;
using test::RunningBridge;
using testing::ElementsAre;
using testing::HasSubstr;

Tag loss_begin(std::int64_t time_ps) { return {time_ps, 0, TagKind::loss_begin, {}}; }
Tag loss_end(std::int64_t time_ps) { return {time_ps, -1, TagKind::loss_end, {}}; }

TEST(Bridge, TagsComeOverTcp) {
  BridgeServer server;
  RunningBridge bridge(server.address());
  EXPECT_EQ(bridge.info().name, "bridge at " + server.address());
  EXPECT_TRUE(bridge.info().live);
  ASSERT_TRUE(server.accept());
  server.send(block_bytes({0, 0, 10, {{3, 1}, {4, -1}}}));
  EXPECT_THAT(bridge.sink.wait(3),
              ElementsAre(photon_tag(3, 1), photon_tag(4, -1), heartbeat_tag(10)));
  EXPECT_TRUE(bridge.reports.wait(DeviceState::connected, ""));
}

TEST(Bridge, TagsComeOverAUnixSocketInAnyNumber) {
  constexpr std::uint32_t blocks = 50;
  constexpr std::int64_t tags = 2'000;
  const test::TempFolder folder;
  BridgeServer server(folder.path("bridge.sock"));
  RunningBridge bridge(server.address());
  ASSERT_TRUE(server.accept());
  for (std::uint32_t i = 0; i < blocks; ++i) {
    test::Tags16Block block{i, i * tags, (i + 1) * tags, {}};
    for (std::int64_t k = 0; k < tags; ++k) block.records.push_back({i * tags + k, 1});
    ASSERT_TRUE(server.send(block_bytes(block)));
  }
  EXPECT_EQ(bridge.sink.wait(blocks * (tags + 1)).size(), blocks * (tags + 1));
}

TEST(Bridge, WaitsForABridgeThatIsNotThereYet) {
  const test::TempFolder folder;
  const std::string path = folder.path("bridge.sock");
  RunningBridge bridge("unix:" + path);
  EXPECT_TRUE(bridge.reports.wait(DeviceState::no_device, path + ": connect: No such file"));
  BridgeServer server(path);
  ASSERT_TRUE(server.accept());
  server.send(block_bytes({0, 0, 10, {}}));
  EXPECT_THAT(bridge.sink.wait(1), ElementsAre(heartbeat_tag(10)));
  EXPECT_TRUE(bridge.reports.wait(DeviceState::connected, ""));
}

// A bridge that fails after each first block would fill the log.
TEST(Bridge, ConnectionsThatDoNotLastAreMadeMoreAndMoreSeldom) {
  BridgeServer server;
  const RunningBridge bridge(server.address());
  ASSERT_TRUE(server.accept());
  const auto begin = std::chrono::steady_clock::now();
  for (std::uint32_t i = 0; i < 2; ++i) {
    server.send(block_bytes({i, 0, 10, {}}));
    ASSERT_TRUE(server.accept());
  }
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds{300});
}

TEST(Bridge, ANewConnectionIsALossInTheStream) {
  BridgeServer server;
  RunningBridge bridge(server.address());
  ASSERT_TRUE(server.accept());
  std::vector<std::byte> bytes = block_bytes({5, 0, 10, {{3, 1}}});
  test::append_block({6, 10, 20, {{13, 1}, {14, 1}}}, bytes);
  bytes.resize(bytes.size() - 7);
  server.send(bytes);
  EXPECT_EQ(bridge.sink.wait(3).size(), 3U);
  server.hang_up();
  EXPECT_TRUE(bridge.reports.wait(DeviceState::no_device, "the other side closed the connection"));
  ASSERT_TRUE(server.accept());
  server.send(block_bytes({0, 500, 600, {}}));
  EXPECT_THAT(bridge.sink.wait(6),
              ElementsAre(photon_tag(3, 1), heartbeat_tag(10), photon_tag(13, 1), loss_begin(13),
                          loss_end(500), heartbeat_tag(600)));
  EXPECT_EQ(bridge.counter("splid_bridge_connections_total"), 2U);
}

TEST(Bridge, AClockThatBeganAnewIsAClockBreak) {
  BridgeServer server;
  RunningBridge bridge(server.address());
  ASSERT_TRUE(server.accept());
  server.send(block_bytes({0, 2'000'000'000, 3'000'000'000, {}}));
  EXPECT_EQ(bridge.sink.wait(1).size(), 1U);
  ASSERT_TRUE(server.accept());
  server.send(block_bytes({0, 0, 10, {}}));
  EXPECT_THAT(bridge.sink.wait(3),
              ElementsAre(heartbeat_tag(3'000'000'000), Tag{0, 0, TagKind::clock_break, {}},
                          heartbeat_tag(10)));
}

// Each reason is reported when it becomes the reason, in whichever state, and not again.
TEST(Bridge, SilenceAndGarbageAreSaid) {
  BridgeServer server;
  RunningBridge bridge(server.address());
  ASSERT_TRUE(server.accept());
  EXPECT_TRUE(bridge.reports.wait(DeviceState::failing, "nothing came for a second"));
  EXPECT_TRUE(test::eventually([&] {
    server.send(std::string(100, 'x'));
    return std::ranges::any_of(bridge.reports.all(), [](const DeviceReport& report) {
      return report.reason.find("no tags16 block") != std::string::npos;
    });
  }));
  server.send(block_bytes({0, 0, 10, {}}));
  EXPECT_TRUE(bridge.reports.wait(DeviceState::connected, ""));
  // Silent again, and for so long that the connection is given up.
  EXPECT_TRUE(bridge.reports.wait(DeviceState::no_device, "silent for 3 s"));
  ASSERT_TRUE(server.accept());
  server.send(block_bytes({0, 10, 20, {}}));
  EXPECT_EQ(bridge.sink.wait(4).size(), 4U);
  EXPECT_EQ(bridge.counter("splid_tags16_blocks_total"), 2U);
  const std::vector<DeviceReport> all = bridge.reports.all();
  for (std::size_t i = 1; i < all.size(); ++i) EXPECT_NE(all[i], all[i - 1]) << all[i].reason;
}

TEST(Bridge, APartOfABlockAfterASilenceIsNoGarbage) {
  BridgeServer server;
  RunningBridge bridge(server.address());
  ASSERT_TRUE(server.accept());
  EXPECT_TRUE(bridge.reports.wait(DeviceState::failing, "nothing came for a second"));
  const std::vector<std::byte> block = block_bytes({0, 0, 10, {{3, 1}}});
  server.send(std::span(block).first(40));
  EXPECT_TRUE(test::eventually([&] { return bridge.counter("splid_tags16_bytes_total") == 40; }));
  server.send(std::span(block).subspan(40));
  EXPECT_TRUE(bridge.reports.wait(DeviceState::connected, ""));
  EXPECT_EQ(bridge.reports.all().size(), 2U);
}

// A record of a sentence of less than six bytes, at time 0.
test::Tags16Record sentence(NoticeKind kind, const std::string& text) {
  test::Tags16Record record;
  record.type = tags16::type_text;
  record.reserved = static_cast<std::uint8_t>(kind);
  std::string bytes = text;
  bytes.resize(tags16::text_bytes_a_record);
  std::memcpy(&record.missed, bytes.data(), sizeof record.missed);
  std::memcpy(&record.channel, &bytes[sizeof record.missed], sizeof record.channel);
  return record;
}

TEST(Bridge, AStateAndAnEventOfOneBlockAreBothReported) {
  BridgeServer server;
  RunningBridge bridge(server.address());
  ASSERT_TRUE(server.accept());
  server.send(block_bytes({0, 0, 10, {sentence(NoticeKind::absent, "none")}}));
  EXPECT_TRUE(bridge.reports.wait(DeviceState::no_device, "none"));
  server.send(block_bytes(
      {1, 10, 20, {sentence(NoticeKind::caution, ""), sentence(NoticeKind::event, "back")}}));
  EXPECT_TRUE(bridge.reports.wait(DeviceState::connected, "back"));
  EXPECT_TRUE(test::eventually([&] {
    return bridge.reports.all().back() == DeviceReport{DeviceState::connected, "", "", ""};
  }));
}

TEST(Bridge, AddressesThatAreNone) {
  const auto fault = [](const std::string& address) {
    BridgeOptions options;
    options.address = address;
    const auto found = options.validate();
    return found ? found->pointer + ": " + found->what : "none";
  };
  EXPECT_EQ(fault("unix:/run/splid/bridge.sock"), "none");
  EXPECT_EQ(fault("unix:/" + std::string(106, 'x')), "none");
  EXPECT_EQ(fault("tcp:lab-pc:65535"), "none");
  EXPECT_THAT(fault(""), HasSubstr("/address: \"\" must begin with unix: or tcp:"));
  EXPECT_THAT(fault("unix:"), HasSubstr("names no file"));
  EXPECT_THAT(fault("unix:/" + std::string(107, 'x')), HasSubstr("a path of 108 bytes"));
  for (const char* address : {"tcp:", "tcp:9880", "tcp::9880", "tcp:host", "tcp:host:0",
                              "tcp:host:65536", "tcp:host:port"}) {
    EXPECT_THAT(fault(address), HasSubstr("tcp:HOST:PORT")) << address;
  }
}

TEST(Bridge, AHostThatNobodyKnows) {
  BridgeOptions options;
  options.address = "tcp:300.300.300.300:9880";
  EXPECT_THAT(test::error_text([&] { (void)options.open({}); }),
              HasSubstr("the host 300.300.300.300"));
}

}  // namespace
}  // namespace splid
