#include "daemon/security/authenticator.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <vector>
#include <zmq.hpp>

#include "daemon/output/publisher.hpp"
#include "daemon/security/curve_socket.hpp"
#include "daemon/security/server_security.hpp"
#include "daemon/sockets/subscriber.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/local_connection.hpp"
#include "tests/support/patience.hpp"
#include "tests/support/tcp_recorder.hpp"
#include "tests/support/yardstick.hpp"

namespace splid::security {
namespace {

using splid::test::LocalConnection;
using splid::test::TcpRecorder;
using std::chrono::milliseconds;
using std::chrono::steady_clock;
using testing::AllOf;
using testing::AnyOf;
using testing::Each;
using testing::Ge;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Le;
using testing::Not;
using State = HandshakeWatch::State;

constexpr const char* any_port = "tcp://127.0.0.1:*";
using test::patience;

int port_of(const std::string& endpoint) {
  return std::stoi(endpoint.substr(endpoint.rfind(':') + 1));
}

AllowList list_of(const CurveKeyPair& keys, const std::string& name) {
  return AllowList::parse(keys.public_key + " " + name, "list");
}

// A publisher with keys and a plain local endpoint, and a viewer that is on the list.
class Secured : public testing::Test {
 protected:
  Secured() { authenticator.allow(publish_domain, list_of(viewer, "viewer")); }

  std::optional<CurveClient> as(const CurveKeyPair& keys) const {
    return CurveClient{keys, server.public_key};
  }

  std::unique_ptr<sockets::Subscriber> connect(const std::optional<CurveClient>& client,
                                               const std::string& endpoint) const {
    return std::make_unique<sockets::Subscriber>(endpoint, std::vector<std::string>{""}, client);
  }

  // Publishes until the subscriber heard something.
  bool hears(sockets::Subscriber& subscriber) {
    const auto deadline = steady_clock::now() + patience;
    while (steady_clock::now() < deadline) {
      publisher.publish_frame("test");
      if (subscriber.receive(milliseconds{20})) return true;
    }
    return false;
  }

  // The viewer who is let in; all that came to it so far has been taken.
  std::unique_ptr<sockets::Subscriber> good_viewer() {
    auto good = connect(as(viewer), publisher.endpoint());
    EXPECT_TRUE(hears(*good));
    while (good->receive(milliseconds{100})) {
    }
    return good;
  }

  // Publishes frames one after the other and expects the viewer to hear each.
  void expect_all_heard(sockets::Subscriber& good, int count) {
    for (int i = 0; i < count; ++i) {
      const std::string json = std::to_string(next_++);
      publisher.publish_frame(json);
      const auto message = good.receive(patience);
      ASSERT_TRUE(message) << json;
      ASSERT_EQ(message->json, json);
    }
  }

  // Until it is in that state; publishes meanwhile what it should not hear. Whichever end sees
  // another mechanism first breaks the handshake off: on a busy machine it may be the server each
  // time.
  void expect_kept_out(sockets::Subscriber& subscriber, State state) {
    const auto is_there = [&] {
      const State now = subscriber.state();
      return now == state || (state == State::other_mechanism && now == State::broken_off);
    };
    const auto deadline = steady_clock::now() + patience;
    while (!is_there() && steady_clock::now() < deadline) {
      publisher.publish_frame("secret");
      ASSERT_FALSE(subscriber.receive(milliseconds{20}));
    }
    ASSERT_TRUE(is_there());
    for (int i = 0; i < 10; ++i) {
      publisher.publish_frame("secret");
      ASSERT_FALSE(subscriber.receive(milliseconds{20}));
    }
  }

  void expect_refusals(std::uint64_t count) const {
    const auto deadline = steady_clock::now() + patience;
    while (refusals.kept_out() < count && steady_clock::now() < deadline) {
      std::this_thread::sleep_for(milliseconds{10});
    }
    EXPECT_GE(refusals.kept_out(), count);
  }

  std::vector<std::string> notices() {
    const std::scoped_lock lock(mutex_);
    return notices_;
  }

  const CurveKeyPair server = make_curve_keys();
  const CurveKeyPair viewer = make_curve_keys();
  const CurveKeyPair stranger = make_curve_keys();

 private:
  std::mutex mutex_;
  std::vector<std::string> notices_;  // guarded by mutex_
  int next_ = 0;

 protected:
  Refusals refusals{[this](const std::string& sentence) {
                      const std::scoped_lock lock(mutex_);
                      notices_.push_back(sentence);
                    },
                    host_clock()};
  Authenticator authenticator{server, refusals};
  Publisher publisher{any_port, 1000, {any_port, &authenticator, &refusals}};
};

TEST_F(Secured, WhoIsOnTheListHearsEveryFrame) {
  const auto good = good_viewer();
  expect_all_heard(*good, 200);
  EXPECT_EQ(good->state(), State::connected);
  EXPECT_EQ(refusals.kept_out(), 0u);
  EXPECT_THAT(notices(), IsEmpty());
}

TEST_F(Secured, NobodyElseHearsAnything) {
  const auto good = good_viewer();
  const auto unknown = connect(as(stranger), publisher.endpoint());
  expect_kept_out(*unknown, State::refused);
  EXPECT_THAT(notices(), AllOf(Not(IsEmpty()), Each("refused 127.0.0.1: its key " +
                                                    stranger.public_key.substr(0, 8) +
                                                    "... is not on the allow-list")));
  const auto without = connect(std::nullopt, publisher.endpoint());
  expect_kept_out(*without, State::other_mechanism);
  const auto elsewhere = connect(CurveClient{viewer, stranger.public_key}, publisher.endpoint());
  expect_kept_out(*elsewhere, State::broken_off);
  // A public key of somebody who is let in, without its secret.
  const auto pretender =
      connect(CurveClient{{viewer.public_key, stranger.secret_key}, server.public_key},
              publisher.endpoint());
  expect_kept_out(*pretender, State::broken_off);
  expect_refusals(4);
  while (good->receive(milliseconds{100})) {
  }
  expect_all_heard(*good, 50);
}

TEST_F(Secured, APasswordIsNoKey) {
  zmq::context_t context;
  zmq::socket_t sub(context, zmq::socket_type::sub);
  sub.set(zmq::sockopt::plain_username, "admin");
  sub.set(zmq::sockopt::plain_password, "admin");
  sub.set(zmq::sockopt::subscribe, "");
  sub.set(zmq::sockopt::rcvtimeo, 10);
  HandshakeWatch watch(context, sub, host_clock());
  sub.connect(publisher.endpoint());
  zmq::message_t message;
  const auto deadline = steady_clock::now() + patience;
  while (watch.state() == State::pending && steady_clock::now() < deadline) {
    publisher.publish_frame("secret");
    ASSERT_FALSE(sub.recv(message));
  }
  // Or the server saw it first.
  EXPECT_THAT(watch.state(), AnyOf(State::other_mechanism, State::broken_off));
}

TEST_F(Secured, TheLocalEndpointIsPlainAndHasTheSameMessages) {
  const auto good = good_viewer();
  const auto local = connect(std::nullopt, publisher.local_endpoint());
  ASSERT_TRUE(hears(*local));
  while (good->receive(milliseconds{100}) || local->receive(milliseconds{100})) {
  }
  for (int i = 0; i < 50; ++i) {
    publisher.publish_frame(std::to_string(i));
    for (sockets::Subscriber* one : {good.get(), local.get()}) {
      const auto message = one->receive(patience);
      ASSERT_TRUE(message);
      ASSERT_EQ(message->json, std::to_string(i));
    }
  }
  const auto with_keys = connect(as(viewer), publisher.local_endpoint());
  expect_kept_out(*with_keys, State::other_mechanism);
}

// As in publisher_test: queues of a thousand, twenty thousand bytes a message.
TEST_F(Secured, WhoDoesNotReadAtOneEndpointCostsTheOtherNothing) {
  const auto local = connect(std::nullopt, publisher.local_endpoint());
  ASSERT_TRUE(hears(*local));
  while (local->receive(milliseconds{100})) {
  }
  zmq::context_t context;
  zmq::socket_t idle(context, zmq::socket_type::sub);
  idle.set(zmq::sockopt::rcvhwm, 1);
  idle.set(zmq::sockopt::subscribe, "");
  use_as_curve_client(idle, *as(viewer));
  idle.connect(publisher.endpoint());
  zmq::message_t message;
  const auto deadline = steady_clock::now() + patience;
  while (!idle.recv(message, zmq::recv_flags::dontwait) && steady_clock::now() < deadline) {
    publisher.publish_frame("hello");
    ASSERT_TRUE(local->receive(patience));
  }
  ASSERT_EQ(message.to_string(), "frame");
  const std::string json(20'000, 'x');
  for (int i = 0; i < 2000; ++i) {
    publisher.publish_frame(json);
    ASSERT_TRUE(local->receive(patience)) << i;
  }
}

TEST_F(Secured, AListThatIsReloadedHoldsForNewConnections) {
  const auto good = good_viewer();
  const auto waiting = connect(as(stranger), publisher.endpoint());
  expect_kept_out(*waiting, State::refused);
  authenticator.allow(publish_domain, list_of(stranger, "stranger"));
  EXPECT_TRUE(hears(*waiting)) << "the one that is let in now has to come by itself";
  const auto late = connect(as(viewer), publisher.endpoint());
  expect_kept_out(*late, State::refused);
  while (good->receive(milliseconds{100})) {
  }
  expect_all_heard(*good, 20);
}

TEST_F(Secured, ADomainWithoutAListIsForNobody) {
  Publisher other(any_port, 10, {});
  zmq::socket_t xpub(authenticator.context(), zmq::socket_type::xpub);
  authenticator.protect(xpub, "control");
  xpub.bind(any_port);
  const auto client = connect(as(viewer), xpub.get(zmq::sockopt::last_endpoint));
  expect_kept_out(*client, State::refused);
}

TEST_F(Secured, ASocketThatAsksWithoutKeysGetsNo) {
  zmq::socket_t xpub(authenticator.context(), zmq::socket_type::xpub);
  xpub.set(zmq::sockopt::zap_domain, publish_domain);
  xpub.bind(any_port);
  const auto client = connect(std::nullopt, xpub.get(zmq::sockopt::last_endpoint));
  expect_kept_out(*client, State::refused);
  EXPECT_THAT(notices(), Each(HasSubstr("127.0.0.1: it gives no CURVE key")));
}

TEST_F(Secured, MessagesCarryTheNameOfWhoSentThem) {
  zmq::socket_t router(authenticator.context(), zmq::socket_type::router);
  authenticator.protect(router, publish_domain);
  router.bind(any_port);
  router.set(zmq::sockopt::rcvtimeo, 30'000);
  zmq::context_t context;
  zmq::socket_t dealer(context, zmq::socket_type::dealer);
  dealer.set(zmq::sockopt::linger, 0);
  use_as_curve_client(dealer, *as(viewer));
  dealer.connect(router.get(zmq::sockopt::last_endpoint));
  dealer.send(zmq::str_buffer("hello"));
  zmq::message_t message;
  ASSERT_TRUE(router.recv(message));
  EXPECT_STREQ(message.gets("User-Id"), "viewer");
}

TEST_F(Secured, ABindThatFailsLeavesNothingBehind) {
  EXPECT_ANY_THROW(Publisher(publisher.endpoint(), 10, {"", &authenticator, nullptr}));
  const auto good = good_viewer();
  expect_all_heard(*good, 10);
}

// Who listened in between has what a good client sent, to the last byte.
TEST_F(Secured, ARepeatedHandshakeIsRefused) {
  const auto good = good_viewer();
  std::vector<std::string> recorded;
  {
    const TcpRecorder recorder(port_of(publisher.endpoint()));
    const auto overheard = connect(as(viewer), "tcp://" + recorder.address());
    ASSERT_TRUE(hears(*overheard));
    recorded = recorder.sent_by_client();
  }
  while (good->receive(milliseconds{100})) {
  }
  const std::uint64_t before = refusals.kept_out();
  const LocalConnection attacker(port_of(publisher.endpoint()));
  std::string sent;
  std::string answer;
  for (const std::string& piece : recorded) {
    attacker.send(piece);
    answer += attacker.receive(200);
    sent += piece;
    expect_all_heard(*good, 5);
  }
  EXPECT_THAT(sent, AllOf(HasSubstr("CURVE"), HasSubstr("HELLO"), HasSubstr("INITIATE")));
  // Greeting and welcome come to everybody; the repeated INITIATE is not of this welcome's cookie.
  constexpr std::size_t greeting_bytes = 64;
  constexpr std::size_t welcome_bytes = 2 + 168;
  EXPECT_EQ(answer.size(), greeting_bytes + welcome_bytes);
  EXPECT_THAT(answer, AllOf(HasSubstr("WELCOME"), Not(HasSubstr("READY"))));
  expect_refusals(before + 1);
  EXPECT_THAT(notices(), testing::ElementsAre(HasSubstr("a repetition of an old one")));
}

// The keys of two peers are never checked at once. Who has the server's public key can send all up
// to a part of the frame that has its own key.
TEST_F(Secured, WhoStopsWithinItsKeyHoldsUpNobodysCheck) {
  std::vector<std::string> pieces;
  {
    const TcpRecorder recorder(port_of(publisher.endpoint()));
    const auto overheard = connect(as(viewer), "tcp://" + recorder.address());
    ASSERT_TRUE(hears(*overheard));
    pieces = recorder.sent_by_client();
  }
  std::vector<std::unique_ptr<LocalConnection>> stopped;
  for (int i = 0; i < 8; ++i) {
    stopped.push_back(std::make_unique<LocalConnection>(port_of(publisher.endpoint())));
    const LocalConnection& connection = *stopped.back();
    const auto key = std::find_if(pieces.begin(), pieces.end(), [](const std::string& piece) {
      return piece.find("INITIATE") != std::string::npos;
    });
    ASSERT_NE(key, pieces.end());
    for (auto piece = pieces.begin(); piece != key; ++piece) connection.send(*piece);
    std::string answer;
    ASSERT_TRUE(test::eventually([&] {
      answer += connection.receive(1);
      return answer.find("WELCOME") != std::string::npos;
    }));
    connection.send(key->substr(0, 20));
  }
  const auto late = connect(as(viewer), publisher.endpoint());
  EXPECT_TRUE(hears(*late));
  // The viewer was let in before the others' 5 s for the handshake were over.
  char byte = 0;
  EXPECT_EQ(::recv(stopped.back()->socket(), &byte, 1, MSG_DONTWAIT), -1);
  EXPECT_EQ(errno, EAGAIN);
}

TEST_F(Secured, GarbageAndHalfAGreetingHarmNobody) {
  const auto good = good_viewer();
  std::mt19937 random(1);
  std::vector<std::unique_ptr<LocalConnection>> clients;
  const std::string greeting = std::string("\xff\0\0\0\0\0\0\0\1\x7f\3", 11);
  for (int i = 0; i < 60; ++i) {
    clients.push_back(std::make_unique<LocalConnection>(port_of(publisher.endpoint())));
    std::string bytes(1 + random() % 5000, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    if (i % 3 == 0) clients.back()->send(bytes);
    if (i % 3 == 1) clients.back()->send(greeting + bytes);
    expect_all_heard(*good, 2);  // the third kind says nothing at all
  }
  // Nobody may hold a connection open without an end: each is closed within the handshake's 5 s.
  const test::Yardstick yardstick;
  const auto begin = std::chrono::steady_clock::now();
  for (const auto& client : clients) EXPECT_THAT(client->receive(), Not(HasSubstr("READY")));
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
  EXPECT_TRUE(yardstick.keeps(5000, took.count()));
  expect_all_heard(*good, 20);
  EXPECT_THAT(notices().size(), Le(2U)) << "one peer, two reasons at most";
}

TEST_F(Secured, TwoHundredStrangersAtOnceHarmNobody) {
  const auto good = good_viewer();
  zmq::context_t context;
  std::vector<zmq::socket_t> strangers;
  for (int i = 0; i < 200; ++i) {
    zmq::socket_t& sub = strangers.emplace_back(context, zmq::socket_type::sub);
    sub.set(zmq::sockopt::linger, 0);
    sub.set(zmq::sockopt::subscribe, "");
    use_as_curve_client(sub, *as(stranger));
    sub.connect(publisher.endpoint());
  }
  for (int round = 0; round < 100 && refusals.kept_out() < 200; ++round) {
    expect_all_heard(*good, 20);
  }
  expect_refusals(200);
  expect_all_heard(*good, 20);
  for (zmq::socket_t& sub : strangers) {
    zmq::message_t message;
    EXPECT_FALSE(sub.recv(message, zmq::recv_flags::dontwait));
  }
  EXPECT_THAT(notices().size(), Le(2U)) << "one peer, two reasons at most";
}

// libzmq by itself would let in whoever has the server's public key.
TEST(CurveServer, WithoutAnAuthenticatorIsForNobody) {
  const CurveKeyPair server = make_curve_keys();
  zmq::context_t context;
  zmq::socket_t xpub(context, zmq::socket_type::xpub);
  use_as_curve_server(xpub, server.secret_key, publish_domain);
  xpub.bind(any_port);
  sockets::Subscriber client(xpub.get(zmq::sockopt::last_endpoint), {""},
                             CurveClient{make_curve_keys(), server.public_key});
  const auto deadline = steady_clock::now() + patience;
  while (client.state() == State::pending && steady_clock::now() < deadline) {
    xpub.send(zmq::str_buffer("secret"), zmq::send_flags::dontwait);
    ASSERT_FALSE(client.receive(milliseconds{20}));
  }
  EXPECT_EQ(client.state(), State::broken_off);
}

}  // namespace
}  // namespace splid::security
