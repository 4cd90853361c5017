#include "daemon/view/web_server.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <list>
#include <string>
#include <thread>

#include "tests/support/held_clock.hpp"
#include "tests/support/local_connection.hpp"

// A server of the live page whose time a test tells.

namespace splid::view {
namespace {

using test::LocalConnection;

class WebServerTest : public ::testing::Test {
 protected:
  // What came on a connection; closed: its other end is.
  struct Came {
    std::string text;
    bool closed = false;
  };
  static void receive(const LocalConnection& connection, Came& came) {
    std::array<char, 65536> some{};
    const ssize_t got = ::recv(connection.socket(), some.data(), some.size(), MSG_DONTWAIT);
    if (got > 0) came.text.append(some.data(), static_cast<std::size_t>(got));
    came.closed = came.closed || got == 0 || (got < 0 && errno != EAGAIN);
  }
  // Whether the server does so in the time that it has now.
  template <class Condition>
  bool comes_to(const Condition& condition) {
    // libmicrohttpd has a time of its own, after which it closes what is silent: 15 s.
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds{10};
    bool holds = false;
    while (!holds && std::chrono::steady_clock::now() < deadline) {
      server.run();
      holds = condition();
      if (!holds) std::this_thread::sleep_for(std::chrono::milliseconds{1});
    }
    return holds;
  }
  bool closes(const LocalConnection& connection) {
    Came came;
    return comes_to([&] {
      receive(connection, came);
      return came.closed;
    });
  }
  bool answers(const LocalConnection& connection, const std::string& text) {
    Came came;
    return comes_to([&] {
             receive(connection, came);
             return came.closed || came.text.find(text) != std::string::npos;
           }) &&
           !came.closed;
  }
  [[nodiscard]] int port() const {
    const std::string url = server.url();
    return std::stoi(url.substr(url.rfind(':') + 1));
  }

  HeldClock clock;
  LiveView view{"ipc://nowhere", clock};
  WebServer server{"127.0.0.1:*", view, clock};
  const std::string get = "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n";
  const std::string events = "GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n";
};

// A byte every few seconds is no request.
TEST_F(WebServerTest, ClosesAConnectionWhoseRequestIsNotWholeInTime) {
  const LocalConnection slow(port());
  for (const char byte : get.substr(0, 9)) {
    slow.send({byte});
    server.run();
    clock.advance_ms(1000);
  }
  Came came;
  server.run();
  receive(slow, came);
  EXPECT_FALSE(came.closed);
  slow.send("T");
  clock.advance_ms(1000);
  EXPECT_TRUE(closes(slow));
}

// An event stream has all the time, and a connection the same time again for its next request.
TEST_F(WebServerTest, AnAnswerBeginsTheTimeAnew) {
  const LocalConnection page(port());
  const LocalConnection stream(port());
  stream.send(events);
  EXPECT_TRUE(answers(stream, "event: page"));
  for (int i = 0; i < 3; ++i) {
    page.send(get);
    EXPECT_TRUE(answers(page, "HTTP/1.1 200 OK"));
    clock.advance_ms(9000);
  }
  EXPECT_TRUE(answers(stream, ":\n\n"));
  clock.advance_ms(20'000);  // also if the end of the answer was noticed only now
  EXPECT_TRUE(closes(page));
}

TEST_F(WebServerTest, GivesTheFramesOfATimeAsATable) {
  FrameMessage frame;
  frame.timestamp_s = 1000;
  view.take("frame", to_json(frame));
  const LocalConnection page(port());
  const auto ask = [](const std::string& query) {
    return "GET /frames.csv" + query + " HTTP/1.1\r\nHost: localhost\r\n\r\n";
  };
  page.send(ask("?from=999.5&to=1000.5"));
  EXPECT_TRUE(answers(page, "\n1000,"));
  const LocalConnection wrong(port());
  wrong.send(ask("?from=nan&to=1000"));
  EXPECT_TRUE(answers(wrong, "HTTP/1.1 400"));
}

TEST_F(WebServerTest, OnePeerHasAShareOfThePlaces) {
  std::list<LocalConnection> held;
  for (std::size_t i = 0; i < WebServer::most_connections_a_peer; ++i) held.emplace_back(port());
  held.back().send(get);
  EXPECT_TRUE(answers(held.back(), "HTTP/1.1 200 OK"));
  const LocalConnection more(port());
  more.send(get);
  EXPECT_TRUE(closes(more));
  EXPECT_EQ(server.counts().refused, 1U);
  std::size_t viewers = 0;
  for (const LocalConnection& each : held) {
    if (viewers == WebServer::most_viewers_a_peer) break;
    each.send(events);
    EXPECT_TRUE(answers(each, "event: page"));
    ++viewers;
  }
  held.back().send(events);
  EXPECT_TRUE(answers(held.back(), "HTTP/1.1 503"));
  EXPECT_EQ(server.counts().viewers, WebServer::most_viewers_a_peer);
}

}  // namespace
}  // namespace splid::view
