#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>
#include <zmq.hpp>

#include "daemon/security/curve_socket.hpp"
#include "daemon/sockets/gate_limits.hpp"
#include "daemon/sockets/subscriber.hpp"
#include "tests/support/fault_scene.hpp"
#include "tests/support/local_connection.hpp"
#include "tests/support/patience.hpp"
#include "tests/support/process_memory.hpp"
#include "tests/support/python_program.hpp"
#include "tests/support/sanitized.hpp"
#include "tests/support/zmtp_peer.hpp"

// Peers that send all they can, or hold all they can, at each endpoint of the built program. Frames
// go on, at the other endpoint and at the same, and the memory stays where it was.

namespace splid::sockets {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using test::LocalConnection;
using test::WatchedDaemon;
using test::ZmtpPeer;
using testing::HasSubstr;

#ifdef SPLID_SANITIZED
constexpr double allowed_mib = 1024;  // the sanitizer keeps what was freed, 256 MiB and more
#else
constexpr double allowed_mib = 64;
#endif

// Makes the next bytes to send.
using Flood = std::function<std::string()>;

struct NamedFlood {
  const char* words;
  Flood next;
};

std::string random_text(std::size_t bytes) {
  static thread_local std::mt19937 random(7);
  std::string text(bytes, '\0');
  for (char& letter : text) letter = static_cast<char>(random());
  return text;
}

std::string many(int count, const std::function<std::string()>& one) {
  std::string all;
  for (int i = 0; i < count; ++i) all += one();
  return all;
}

std::vector<NamedFlood> floods() {
  return {
      {"topics of 1,000 random bytes",
       [] { return many(64, [] { return ZmtpPeer::subscription(random_text(1000)); }); }},
      {"topics of three random bytes",
       [] { return many(5000, [] { return ZmtpPeer::subscription(random_text(3)); }); }},
      {"`frame` again and again",
       [] { return many(5000, [] { return ZmtpPeer::subscription("frame"); }); }},
      {"unsubscriptions",
       [] {
         return many(5000, [] {
           const std::string topic = random_text(3);
           return ZmtpPeer::subscription(topic) + ZmtpPeer::unsubscription(topic);
         });
       }},
      {"messages of its own",
       [] { return many(500, [] { return ZmtpPeer::frame("7" + random_text(100)); }); }},
      {"a message of endless parts",
       [] { return many(100, [] { return ZmtpPeer::frame(random_text(1000), ZmtpPeer::more); }); }},
      {"a frame of a petabyte", [] { return "\2" + std::string("\0\4\0\0\0\0\0\0", 8); }},
      {"heartbeats",
       [] {
         return many(
             5000, [] { return ZmtpPeer::frame(std::string("\4PING\0\0", 7), ZmtpPeer::command); });
       }},
  };
}

class Floods : public test::FaultScene {
 protected:
  // The daemon is watched while `attack` goes on in a thread of its own, until its stop is asked
  // for. said: of the log afterwards.
  void withstand(const std::string& words, const std::string& said,
                 const std::function<void(const std::stop_token&)>& attack) {
    daemon->start_counting();
    const std::string id = std::to_string(daemon->program->id());
    const double before_mib = test::memory_mib("VmRSS", id);
    double highest_mib = before_mib;
    {
      const std::jthread attacker(attack);
      for (int i = 0; i < frames_to_watch; ++i) {
        ASSERT_TRUE(daemon->await_good_frame());
        highest_mib = std::max(highest_mib, test::memory_mib("VmRSS", id));
      }
      // An attacker that is slow has not come to it yet.
      const auto until = steady_clock::now() + test::patience;
      while (daemon->program->err().find(said) == std::string::npos &&
             steady_clock::now() < until) {
        ASSERT_TRUE(daemon->await_good_frame());
      }
    }
    EXPECT_LT(highest_mib - before_mib, allowed_mib);
    EXPECT_EQ(daemon->bad_frames, 0U);
    EXPECT_EQ(daemon->lost_tags, 0U);
    if (!said.empty()) {
      EXPECT_THAT(daemon->program->err(), HasSubstr(said));
    }
    char text[80];
    std::snprintf(text, sizeof text, "; %.1f MiB more", std::max(0.0, highest_mib - before_mib));
    test::record({words, (said.empty() ? "nothing" : "log: refused: " + said) + text, -1,
                  daemon->losses(), 0});
  }

  // Connects as often as it is let go, and floods. Each time it is let go while it sends.
  void flood(const std::function<int()>& connect, const std::string& type, const std::string& first,
             const Flood& next, const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      ZmtpPeer peer(connect(), type);
      (void)peer.send(first);
      while (!stop.stop_requested() && peer.send(next())) {
      }
      if (!stop.stop_requested()) ++let_go;
    }
  }

  std::atomic<int> let_go{0};
  int frames_to_watch = test::times(25);
};

TEST_F(Floods, WhatASubscriberSendsCostsNobodyElse) {
  publish = R"(,"local_endpoint":"tcp://lo:*")";
  start();
  const int port = port_after("for this machine, at tcp://127.0.0.1:");
  ASSERT_NE(port, 0);
  for (const NamedFlood& one : floods()) {
    SCOPED_TRACE(one.words);
    let_go = 0;
    withstand(std::string("a subscriber sends ") + one.words + ", and connects again", "it sent",
              [&](const std::stop_token& stop) {
                flood([port] { return test::connect_to_port(port); }, "SUB",
                      ZmtpPeer::subscription("frame"), one.next, stop);
              });
    EXPECT_GT(let_go, 0);
  }
}

// A new subscriber is told the version meanwhile, at the very endpoint.
TEST_F(Floods, ANewSubscriberIsGreetedWhileAnotherFloods) {
  start();
  const int port = port_after("publishing at tcp://127.0.0.1:");
  withstand("a subscriber sends `frame` again and again, another one comes", "it sent",
            [&](const std::stop_token& stop) {
              const std::jthread flooder([&] {
                flood([port] { return test::connect_to_port(port); }, "SUB", "",
                      [] { return many(5000, [] { return ZmtpPeer::subscription("frame"); }); },
                      stop);
              });
              while (!stop.stop_requested()) {
                Subscriber fresh("tcp://127.0.0.1:" + std::to_string(port), {"version"});
                EXPECT_TRUE(fresh.receive(std::chrono::seconds{30}));
              }
            });
}

// What a library makes of it: pyzmq, from the other side of an XPUB, and with SUB.
TEST_F(Floods, WhatPythonSendsCostsNobodyElse) {
  publish = R"(,"local_endpoint":"ipc://)" + folder.path("frames") + "\"";
  start();
  for (const char* kind : {"long", "short", "repeat", "unsubscribe", "message", "parts"}) {
    SCOPED_TRACE(kind);
    withstand(std::string("pyzmq floods the local endpoint: ") + kind, "it sent",
              [&](const std::stop_token& stop) {
                test::Program flooder = test::python("tests/support/python/flood.py",
                                                     {"ipc://" + folder.path("frames"), kind});
                while (!stop.stop_requested()) std::this_thread::sleep_for(milliseconds{10});
              });
  }
}

// 200 connections of one peer that take up all they are given and read nothing.
TEST_F(Floods, ManyWhoDoNotReadCostNobodyElse) {
  publish = R"(,"local_endpoint":"tcp://lo:*")";
  start();
  const int port = port_after("for this machine, at tcp://127.0.0.1:");
  withstand("200 connections of one peer subscribe and read nothing", "connections already",
            [&](const std::stop_token& stop) {
              std::vector<std::unique_ptr<ZmtpPeer>> held;
              for (int i = 0; i < 200; ++i) {
                held.push_back(std::make_unique<ZmtpPeer>(test::connect_to_port(port), "SUB"));
                // libzmq ends a connection that says more before it has read the other side's
                // READY.
                (void)held.back()->await_ready();
                held.back()->reads = false;
                (void)held.back()->send(ZmtpPeer::subscription(""));
              }
              while (!stop.stop_requested()) std::this_thread::sleep_for(milliseconds{10});
            });
}

TEST_F(Floods, ConnectingAgainAndAgainCostsNobodyElse) {
  publish = R"(,"local_endpoint":"tcp://lo:*")";
  start();
  const int port = port_after("for this machine, at tcp://127.0.0.1:");
  withstand("a peer connects again and again", "connect", [&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      ZmtpPeer peer(test::connect_to_port(port), "SUB");
      (void)peer.send(ZmtpPeer::subscription("frame"));
    }
  });
}

// Within its allowance each time, so that nobody lets it go: what it leaves behind is a table that
// libzmq goes through whenever a connection ends.
TEST_F(Floods, WhatEndedConnectionsLeaveBehindCostsNobodyElse) {
  publish = R"(,"local_endpoint":"tcp://lo:*")";
  start();
  const int port = port_after("for this machine, at tcp://127.0.0.1:");
  frames_to_watch = test::times(200);
  withstand("a peer subscribes to all it may and more, 500 times", "it sent",
            [&](const std::stop_token& stop) {
              for (int i = 0; i < 500 && !stop.stop_requested(); ++i) {
                ZmtpPeer peer(test::connect_to_port(port), "SUB");
                if (!peer.await_ready()) continue;
                while (peer.send(ZmtpPeer::subscription(random_text(1000)))) {
                }
              }
            });
}

// Silent ones make way.
TEST_F(Floods, SilentConnectionsKeepNobodyOut) {
  start();
  const int port = port_after("publishing at tcp://127.0.0.1:");
  withstand("224 silent connections to the publisher's port", "connections already",
            [&](const std::stop_token& stop) {
              std::vector<std::unique_ptr<LocalConnection>> held;
              while (!stop.stop_requested() && held.size() < 224) {
                held.push_back(std::make_unique<LocalConnection>(port));
              }
              Subscriber fresh("tcp://127.0.0.1:" + std::to_string(port), {"version"});
              EXPECT_TRUE(fresh.receive(std::chrono::seconds{60}));
              while (!stop.stop_requested()) std::this_thread::sleep_for(milliseconds{10});
            });
}

TEST_F(Floods, SilentConnectionsDoNotStopTheMetrics) {
  start(R"(,"metrics":{"http":"127.0.0.1:*"})");
  const int port = port_after("metrics at http://127.0.0.1:");
  withstand("224 silent connections to the metrics' port", "for which others wait",
            [&](const std::stop_token& stop) {
              std::vector<std::unique_ptr<LocalConnection>> held;
              for (int i = 0; i < 224; ++i) {
                held.push_back(std::make_unique<LocalConnection>(port));
              }
              do {
                const LocalConnection scrape(port);
                scrape.send("GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n");
                EXPECT_THAT(scrape.receive(60'000), HasSubstr("splid_frames_total"));
              } while (!stop.stop_requested());
            });
}

TEST_F(Floods, WhatIsSentToTheControlSocketCostsNobodyElse) {
  control = "ipc://" + folder.path("control");
  start();
  const std::string request = R"({"schema":"splid.control","request":"status"})";
  const std::vector<NamedFlood> all = {
      {"a message of endless parts",
       [] { return many(100, [] { return ZmtpPeer::frame(random_text(4000), ZmtpPeer::more); }); }},
      {"requests, and reads no answer",
       [&] { return many(1000, [&] { return ZmtpPeer::frame(request); }); }},
  };
  for (const NamedFlood& one : all) {
    SCOPED_TRACE(one.words);
    withstand(std::string("a client of control sends ") + one.words, "it sent",
              [&](const std::stop_token& stop) {
                const std::jthread flooder([&] {
                  while (!stop.stop_requested()) {
                    ZmtpPeer peer(test::connect_to_file(folder.path("control")), "DEALER");
                    peer.reads = false;
                    while (!stop.stop_requested() && peer.send(one.next())) {
                    }
                  }
                });
                while (!stop.stop_requested()) {
                  const auto asked = test::run_program({"ctl", "--endpoint", control, "status"});
                  EXPECT_EQ(asked.exit_code, 0) << asked.err;
                }
              });
  }
}

// A reader whose key is on the list, with keys made for it.
TEST_F(Floods, AListedReaderCannotFloodEither) {
  const security::CurveKeyPair server = security::make_curve_keys();
  const security::CurveKeyPair reader = security::make_curve_keys();
  (void)folder.write("server.key_secret", "secret-key = \"" + server.secret_key + "\"\n");
  (void)folder.write("allowed.keys", reader.public_key + " reader\n");
  std::filesystem::permissions(folder.path("server.key_secret"),
                               std::filesystem::perms::owner_read);
  // The one that is watched has none: it listens at the plain endpoint.
  const std::string frames = "ipc://" + folder.path("frames");
  config(R"(,"security":{"server_key":"server.key_secret","allow_list":"allowed.keys"})");
  publish = R"(,"local_endpoint":")" + frames + "\"";
  config(R"(,"security":{"server_key":"server.key_secret","allow_list":"allowed.keys"})");
  daemon = std::make_unique<WatchedDaemon>(folder.path("config.json"), frames);
  ASSERT_TRUE(daemon->await_good_frame());
  const std::string endpoint =
      "tcp://127.0.0.1:" + std::to_string(port_after("publishing at tcp://127.0.0.1:"));
  withstand("a listed reader subscribes to 70,000 topics over CURVE, again and again", "it sent",
            [&](const std::stop_token& stop) {
              while (!stop.stop_requested()) {
                zmq::context_t context;
                zmq::socket_t sub(context, zmq::socket_type::xsub);
                sub.set(zmq::sockopt::linger, 0);
                sub.set(zmq::sockopt::sndtimeo, 100);
                security::use_as_curve_client(sub, {reader, server.public_key});
                sub.connect(endpoint);
                for (int i = 0; i < 70'000 && !stop.stop_requested(); ++i) {
                  (void)sub.send(zmq::buffer('\1' + random_text(1000)), zmq::send_flags::none);
                }
              }
            });
}

}  // namespace
}  // namespace splid::sockets
