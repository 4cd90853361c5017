#include "daemon/sockets/tag_server.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <thread>
#include <vector>

#include "drivers/client_socket.hpp"
#include "protocol/tags16.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/running_bridge.hpp"
#include "tests/support/temp_folder.hpp"

// Both ends of a bridge's socket: what goes into a TagServer comes out of a BridgeSource.

namespace splid::sockets {
namespace {

using std::chrono::steady_clock;
using testing::ElementsAre;
using Client = test::RunningBridge;  // a splid at the bridge's address

class TagServerTest : public ::testing::Test {
 protected:
  void publish(const std::vector<Tag>& tags) {
    const std::span<Tag> room = server.claim(tags.size());
    ASSERT_GE(room.size(), tags.size());
    std::copy(tags.begin(), tags.end(), room.begin());
    server.publish(tags.size());
  }
  void publish_full_block() {
    const std::span<Tag> room = server.claim(16'384);
    for (Tag& tag : room) tag = photon_tag(++full_ps, 1);
    server.publish(room.size());
  }
  // Publishes heartbeats at that time until a client hears them.
  bool heard_by(Client& client, std::int64_t time_ps) {
    return test::eventually([&] {
      publish({heartbeat_tag(time_ps)});
      const auto tags = client.sink.wait(0);
      return !tags.empty() && tags.back().time_ps == time_ps;
    });
  }
  // The same while nothing but signs of life are published.
  bool hears(Client& client, DeviceState state, const std::string& words) {
    return test::eventually([&] {
      server.publish(0);
      for (const DeviceReport& each : client.reports.all()) {
        const std::string& said = words.empty() ? words : each.reason + each.caution;
        if (each.state == state && said.find(words) != std::string::npos) return true;
      }
      return false;
    });
  }

  test::TempFolder folder;
  std::string address = "unix:" + folder.path("bridge.sock");
  TagServer server{"listen", address};
  std::int64_t full_ps = 0;  // of the last full block
};

TEST_F(TagServerTest, TagsComeOutAsTheyWentIn) {
  Client client(address);
  ASSERT_TRUE(heard_by(client, 1000));
  publish({photon_tag(1500, 1),
           sync_tag(1600),
           marker_tag(1700, 3),
           {1800, 0, TagKind::loss_begin, {}},
           {1900, -1, TagKind::loss_end, {}}});
  std::vector<Tag> tags;
  ASSERT_TRUE(test::eventually([&] {
    tags = client.sink.wait(0);
    std::erase_if(tags, [](const Tag& tag) { return tag.time_ps == 1000; });
    return tags.size() == 6;
  }));
  EXPECT_THAT(tags, ElementsAre(photon_tag(1500, 1), sync_tag(1600), marker_tag(1700, 3),
                                Tag{1800, 0, TagKind::loss_begin, {}},
                                Tag{1900, -1, TagKind::loss_end, {}}, heartbeat_tag(1900)));
}

// To one who comes again, from where it was.
TEST_F(TagServerTest, WhatIsPublishedWhileNobodyListensIsALoss) {
  Tags16Decoder decoder;
  std::vector<Tag> tags;
  const auto hear_until = [&](ClientSocket& socket, std::int64_t time_ps) {
    std::vector<std::byte> bytes(4096);
    return test::eventually([&] {
      publish({heartbeat_tag(time_ps)});
      const std::size_t got = socket.read(bytes, std::chrono::milliseconds{1});
      std::vector<Tag> room(1000);
      const auto done = decoder.decode(std::span(bytes).first(got), room);
      tags.insert(tags.end(), room.begin(), room.begin() + static_cast<int>(done.tags));
      return decoder.reached_ps() == time_ps;
    });
  };
  {
    ClientSocket first(address);
    ASSERT_TRUE(first.connect({}));
    ASSERT_TRUE(hear_until(first, 1000));
  }
  decoder.cut();
  publish({photon_tag(1500, 1)});
  ClientSocket again(address);
  ASSERT_TRUE(again.connect({}));
  ASSERT_TRUE(hear_until(again, 2000));
  std::erase_if(tags, [](const Tag& tag) { return tag.kind == TagKind::heartbeat; });
  ASSERT_EQ(tags.size(), 2U);
  EXPECT_EQ(tags[0], (Tag{1000, 0, TagKind::loss_begin, {}}));
  EXPECT_EQ(tags[1].kind, TagKind::loss_end);
  EXPECT_GE(tags[1].time_ps, 1500);
}

TEST_F(TagServerTest, TheNewestClientIsServed) {
  ClientSocket first(address);
  ASSERT_TRUE(first.connect({}));
  Client second(address);
  ASSERT_TRUE(heard_by(second, 2000));
  std::vector<std::byte> bytes(4096);
  EXPECT_TRUE(test::eventually([&] {
    (void)first.read(bytes, std::chrono::milliseconds{1});
    return !first.is_open();
  }));
}

TEST_F(TagServerTest, HowTheInstrumentDoesIsToldAndToldToWhoComesLater) {
  server.report({DeviceState::no_device, "no MultiHarp is plugged in"});
  Client client(address);
  EXPECT_TRUE(hears(client, DeviceState::no_device, "no MultiHarp is plugged in"));
  server.report({DeviceState::connected, "", "MultiHarp", "sync rate is zero"});
  EXPECT_TRUE(hears(client, DeviceState::connected, "sync rate is zero"));
  server.report({DeviceState::connected, "its FIFO was full", "MultiHarp", "sync rate is zero"});
  EXPECT_TRUE(hears(client, DeviceState::connected, "its FIFO was fullsync rate is zero"));
  server.report({DeviceState::failing, "it sends nothing"});
  EXPECT_TRUE(hears(client, DeviceState::failing, "it sends nothing"));
  server.report({DeviceState::connected, ""});
  EXPECT_TRUE(test::eventually([&] {
    server.publish(0);
    const DeviceReport last = client.reports.all().back();
    return last == DeviceReport{};
  }));
}

TEST_F(TagServerTest, WithoutTagsEmptyBlocksAreSignsOfLife) {
  Client client(address);
  ASSERT_TRUE(heard_by(client, 1000));
  const std::size_t before = client.sink.wait(0).size();
  const auto begin = steady_clock::now();
  while (client.sink.wait(0).size() < before + 3) server.publish(0);
  EXPECT_GE(steady_clock::now() - begin, std::chrono::milliseconds{100});
  EXPECT_EQ(client.sink.wait(0).back(), heartbeat_tag(1000));
}

// More than the socket and 128 blocks hold. What was dropped shows in the numbers of the blocks.
TEST_F(TagServerTest, AClientThatDoesNotReadHoldsPublishUpForItsPatienceAndNoLonger) {
  ClientSocket idle(address);
  ASSERT_TRUE(idle.connect({}));
  std::chrono::duration<double> longest{0};
  const auto begin = steady_clock::now();
  for (int i = 0; i < 300; ++i) {
    const auto before = steady_clock::now();
    publish_full_block();
    longest = std::max(longest, std::chrono::duration<double>(steady_clock::now() - before));
  }
  EXPECT_GE(longest, TagServer::patience);
  EXPECT_LT(steady_clock::now() - begin, 20 * TagServer::patience);
}

// A block that was dropped may have told how the instrument does.
TEST_F(TagServerTest, AClientThatReadsAgainHearsWhatHolds) {
  Tags16Decoder decoder;
  std::vector<std::byte> bytes(1 << 20);
  std::vector<Tag> room(1 << 17);
  ClientSocket client(address);
  ASSERT_TRUE(client.connect({}));
  for (const DeviceReport& told :
       {DeviceReport{DeviceState::no_device, "unplugged"}, DeviceReport{}}) {
    for (int i = 0; i < 300; ++i) publish_full_block();
    server.report(told);
    server.publish(0);
    EXPECT_TRUE(test::eventually([&] {
      server.publish(0);
      while (const std::size_t got = client.read(bytes, std::chrono::milliseconds{1})) {
        decoder.decode(std::span(bytes).first(got), room);
      }
      const Notice last = decoder.notice();
      return last.number > 0 && last.text == told.reason;
    })) << told.reason;
  }
}

}  // namespace
}  // namespace splid::sockets
