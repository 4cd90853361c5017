#include "daemon/sockets/traffic_account.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace splid::sockets {
namespace {

constexpr std::uint64_t heartbeat = 40;
constexpr std::uint64_t topic = 38;
constexpr std::uint64_t message = 1000;

TEST(TrafficAccount, ASubscriberHasSomeTopicsToSayAndNoMore) {
  PeerUse peer;
  TrafficAccount account(subscriber_limits, peer);
  for (int i = 0; i < subscriber_limits.connection.frames; ++i) account.charge(4);
  EXPECT_FALSE(account.is_overdrawn());
  account.charge(4);
  EXPECT_TRUE(account.is_overdrawn());
}

TEST(TrafficAccount, BytesCountAsFramesDo) {
  PeerUse peer;
  TrafficAccount account(subscriber_limits, peer);
  for (int i = 0; i < 4; ++i) account.charge(1024);
  EXPECT_FALSE(account.is_overdrawn());
  account.charge(1);
  EXPECT_TRUE(account.is_overdrawn());
}

// Ten years of a heartbeat every two seconds, and twenty messages a second.
TEST(TrafficAccount, HeartbeatsAreAnsweredAndCostNothing) {
  PeerUse peer;
  TrafficAccount account(subscriber_limits, peer);
  for (int i = 0; i < 200; ++i) account.charge(20);
  constexpr int ten_years = 10 * 365 * 86'400 / 2 / 1000;  // a thousandth of it
  for (int i = 0; i < ten_years; ++i) {
    account.charge(heartbeat + 2);
    account.give_back(heartbeat);
    for (int k = 0; k < 40; ++k) {
      account.give_back(topic);
      account.give_back(message);
    }
    ASSERT_FALSE(account.is_overdrawn()) << i;
  }
}

// Who is sent messages may not therefore send.
TEST(TrafficAccount, MessagesGiveNothingBack) {
  PeerUse peer;
  TrafficAccount account(subscriber_limits, peer);
  int sent = 0;
  for (; !account.is_overdrawn() && sent < 10'000; ++sent) {
    account.charge(10);
    account.give_back(topic);
    account.give_back(message);
  }
  EXPECT_LT(sent, subscriber_limits.connection.frames + 2);
}

TEST(TrafficAccount, ConnectionsOfAPeerShareAndGiveBackWhenTheyEnd) {
  PeerUse peer;
  std::vector<std::unique_ptr<TrafficAccount>> all;
  const auto connect_and_fill = [&] {
    all.push_back(std::make_unique<TrafficAccount>(subscriber_limits, peer));
    for (int i = 0; i < subscriber_limits.connection.frames; ++i) all.back()->charge(4);
  };
  for (int i = 0; i < 16; ++i) connect_and_fill();
  EXPECT_FALSE(all.front()->is_overdrawn());
  connect_and_fill();
  EXPECT_TRUE(all.back()->is_overdrawn());
  all.pop_back();
  EXPECT_FALSE(all.front()->is_overdrawn());
  all.clear();
  EXPECT_EQ(peer.connections, 0U);
  EXPECT_EQ(peer.spent.frames, 0);
  EXPECT_EQ(peer.spent.bytes, 0);
}

TEST(TrafficAccount, RequestsAreGivenBackByTheirAnswers) {
  PeerUse peer;
  TrafficAccount account(control_limits, peer);
  for (int i = 0; i < 100'000; ++i) {
    account.charge(10);
    account.charge(4096);
    account.give_back(300);
    ASSERT_FALSE(account.is_overdrawn()) << i;
  }
}

}  // namespace
}  // namespace splid::sockets
