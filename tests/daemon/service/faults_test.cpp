#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/bridge_server.hpp"
#include "tests/support/control_peer.hpp"
#include "tests/support/fault_scene.hpp"
#include "tests/support/full_table.hpp"
#include "tests/support/local_connection.hpp"
#include "tests/support/small_disk.hpp"

// Something goes wrong around the daemon: with a subscriber, a stranger at a socket, the
// configuration, the encoder, the disk. Frames go on. What is promised within a time is asserted
// beside the machine's slowness.

namespace splid {
namespace {

using std::chrono::milliseconds;
using test::WatchedDaemon;

class Faults : public test::FaultScene {
 protected:
  // 40 connections to the port, one a frame, all held: garbage, the begin of what should come,
  // silence.
  void greet_as_strangers(int port, const std::string& half_said) {
    ASSERT_NE(port, 0);
    daemon->start_counting();
    std::vector<std::unique_ptr<test::LocalConnection>> held;
    for (int i = 0; i < 40; ++i) {
      held.push_back(std::make_unique<test::LocalConnection>(port));
      if (i % 3 == 0) held.back()->send(test::noise_text(60'000));
      if (i % 3 == 1) held.back()->send(half_said);
      ASSERT_TRUE(daemon->await_good_frame());
    }
    EXPECT_EQ(daemon->bad_frames, 0U);
    EXPECT_EQ(daemon->lost_tags, 0U);
  }

  // Of a disk for the metrics or the recordings: what the status says when it is full, and after,
  // each within the time between two attempts.
  void fill_and_clear(const test::SmallDisk& disk, const std::string& words,
                      const std::string& full, const std::string& well, double between_ms) {
    daemon->start_counting();
    const auto begin = WatchedDaemon::Clock::now();
    disk.fill_but(0);
    ASSERT_TRUE(daemon->await_status(full));
    const double said_ms = WatchedDaemon::ms_since(begin);
    const std::string said = daemon->said;
    EXPECT_EQ(said.find(full), said.rfind(full)) << "said twice: " << said;
    EXPECT_TRUE(yardstick.keeps(between_ms, said_ms));
    const auto cleared = WatchedDaemon::Clock::now();
    disk.clear();
    ASSERT_TRUE(daemon->await_status(well));
    EXPECT_TRUE(yardstick.keeps(between_ms, WatchedDaemon::ms_since(cleared)));
    EXPECT_EQ(daemon->bad_frames, 0U);
    EXPECT_EQ(daemon->lost_tags, 0U);
    test::record({"disk of " + words, said, said_ms, daemon->losses(), 0});
  }
};

// What comes is no block at all, for as long as it takes.
TEST_F(Faults, ABridgeThatSpeaksAnotherLanguageIsSaid) {
  start();
  daemon->start_counting();
  auto begin = WatchedDaemon::Clock::now();
  bridge.sender.set_version(2);
  ASSERT_TRUE(daemon->await_status("what comes is no tags16 block of version 1"));
  const double said_ms = WatchedDaemon::ms_since(begin);
  begin = WatchedDaemon::Clock::now();
  bridge.sender.set_version(1);
  ASSERT_TRUE(daemon->await_good_frame());
  test::record({"bridge sends blocks of another version", daemon->said, said_ms, daemon->losses(),
                WatchedDaemon::ms_since(begin)});
}

// A second without the processor, as when the machine is suspended or overloaded.
TEST_F(Faults, AHaltedDaemonGoesOnWithoutALoss) {
  start();
  daemon->start_counting();
  daemon->program->signal(SIGSTOP);
  std::this_thread::sleep_for(milliseconds{1000});
  const auto begin = WatchedDaemon::Clock::now();
  daemon->program->signal(SIGCONT);
  ASSERT_TRUE(daemon->await_frame(
      [](const FrameMessage& frame) { return frame.latency_ms.value_or(0) > 0; }));
  // Those of the second before, and then ten.
  for (int i = 0; i < 30; ++i) ASSERT_TRUE(daemon->await_good_frame());
  EXPECT_EQ(daemon->lost_tags, 0U);
  EXPECT_EQ(daemon->bad_frames, 0U);
  test::record({"daemon is halted for 1 s (SIGSTOP)", "frames come late, none is missing", -1,
                daemon->losses(), WatchedDaemon::ms_since(begin)});
}

struct BadConfig {
  const char* name;
  const char* words;
  const char* said;
  std::function<void()> inject;
};

TEST_F(Faults, AConfigurationThatIsNoneIsNotReloaded) {
  start();
  const std::vector<BadConfig> all = {
      {"garbage", "configuration replaced by garbage, SIGHUP", "not reloaded",
       [this] { (void)folder.write("config.json", test::noise_text(5000)); }},
      {"gone", "configuration removed, SIGHUP", "No such file",
       [this] { std::filesystem::remove(folder.path("config.json")); }},
      {"value", "configuration with a value out of its range, SIGHUP", "/frame/min_seen_fraction",
       [this] { config(R"(,"frame":{"min_seen_fraction":2})"); }}};
  for (const BadConfig& bad : all) {
    SCOPED_TRACE(bad.name);
    daemon->start_counting();
    bad.inject();
    const auto begin = WatchedDaemon::Clock::now();
    daemon->program->signal(SIGHUP);
    ASSERT_TRUE(daemon->await_status(bad.said));
    const double said_ms = WatchedDaemon::ms_since(begin);
    for (int i = 0; i < 10; ++i) ASSERT_TRUE(daemon->await_good_frame());
    EXPECT_EQ(daemon->bad_frames, 0U);
    EXPECT_EQ(daemon->lost_tags, 0U);
    test::record({bad.words, daemon->said, said_ms, daemon->losses(), 0});
  }
}

TEST_F(Faults, AStoppedSubscriberCostsTheOthersNothing) {
  start();
  const test::Program listener(
      {"listen", "--endpoint",
       "tcp://127.0.0.1:" + std::to_string(port_after("publishing at tcp://127.0.0.1:"))});
  while (listener.out().empty()) ASSERT_TRUE(daemon->await_good_frame());
  listener.signal(SIGSTOP);
  daemon->start_counting();
  for (int i = 0; i < 40; ++i) ASSERT_TRUE(daemon->await_good_frame());
  EXPECT_EQ(daemon->bad_frames, 0U);
  test::record({"a subscriber is stopped (SIGSTOP) for 2 s", "nothing: nobody is waited for", -1,
                daemon->losses(), 0});
}

// Bytes of no meaning, the begin of what should come, and connections that say nothing.
TEST_F(Faults, StrangersAtThePublishersPortCostNothing) {
  start();
  greet_as_strangers(port_after("publishing at tcp://127.0.0.1:"),
                     std::string("\xff\0\0\0\0\0\0\0\x01\x7f\x03", 11));
  test::record({"40 strangers at the publisher's port: garbage, half a greeting, silence",
                "nothing: they are not listened to", -1, daemon->losses(), 0});
}

TEST_F(Faults, StrangersAtTheMetricsPortCostNothing) {
  start(R"(,"metrics":{"http":"127.0.0.1:*"})");
  greet_as_strangers(port_after("metrics at http://127.0.0.1:"), "GET /metr");
  test::record({"40 strangers at the metrics' port: garbage, half a request, silence",
                "nothing: they are refused", -1, daemon->losses(), 0});
}

TEST_F(Faults, StrangersAtTheControlSocketCostNothing) {
  control = "ipc://" + folder.path("control");
  start();
  daemon->start_counting();
  for (int i = 0; i < 40; ++i) {
    // The first is cut off.
    test::ControlPeer loud(control);
    loud.send({test::noise_text(60'000)});
    test::ControlPeer many(control);
    many.send(std::vector<std::string>(20, "{}"));
    ASSERT_TRUE(daemon->await_good_frame());
    EXPECT_THAT(many.receive(), testing::HasSubstr("must be one part"));
  }
  EXPECT_EQ(daemon->bad_frames, 0U);
  EXPECT_EQ(daemon->lost_tags, 0U);
  EXPECT_EQ(test::run_program({"ctl", "--endpoint", control, "status"}).exit_code, 0);
  test::record({"40 strangers at the control socket: garbage, messages of 20 parts",
                "nothing: they are cut off or told what is wrong", -1, daemon->losses(), 0});
}

TEST_F(Faults, WithAFullFileTableStrangersAreTurnedAwayAndFramesGoOn) {
  start();
  const int port = port_after("publishing at tcp://127.0.0.1:");
  daemon->start_counting();
  {
    const test::FullTable full(daemon->program->id());
    for (int i = 0; i < 20; ++i) {
      EXPECT_EQ(test::LocalConnection(port).receive(), "");  // closed without a word
      ASSERT_TRUE(daemon->await_good_frame());
    }
  }
  EXPECT_EQ(daemon->bad_frames, 0U);
  EXPECT_EQ(daemon->lost_tags, 0U);
  EXPECT_THAT(daemon->program->err(), testing::HasSubstr("no file can be opened any more"));
  test::record({"no file can be opened any more, and 20 strangers connect",
                "log: no file can be opened any more; each is turned away", -1, daemon->losses(),
                0});
}

TEST_F(Faults, AnEncoderThatSpeaksGarbageCostsItsReferenceAlone) {
  test::BridgeServer encoder;
  std::jthread speaker([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      if (encoder.accept(20)) (void)encoder.send(test::noise_text(5000));
    }
  });
  start(R"(,"encoder":{"address":")" + encoder.address() + "\"}");
  daemon->start_counting();
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(daemon->await_good_frame());
  EXPECT_EQ(daemon->bad_frames, 0U);
  EXPECT_EQ(daemon->lost_tags, 0U);
  EXPECT_THAT(daemon->program->err(), testing::HasSubstr("encoder: "));
  test::record({"the encoder's socket sends garbage", "log: is not FIRST_INDEX,COUNT[,COUNT...]",
                -1, daemon->losses(), 0});
}

TEST_F(Faults, AFullDiskForTheRecordingsIsSaidAndFramesGoOn) {
  const test::SmallDisk disk(16);
  if (!disk.mounted()) GTEST_SKIP() << "takes root, to mount a small disk";
  start(R"(,"record":{"folder":")" + disk.path("kept") + "\"}");
  fill_and_clear(disk, "the recordings is full", "nothing is recorded", "recording again", 5000);
}

TEST_F(Faults, AFullDiskForTheMetricsIsSaid) {
  const test::SmallDisk disk(1);
  if (!disk.mounted()) GTEST_SKIP() << "takes root, to mount a small disk";
  start(R"(,"metrics":{"file":")" + disk.path("splid.prom") + "\"}");
  fill_and_clear(disk, "the metrics' file is full", "cannot be written", "is written again", 1000);
}

}  // namespace
}  // namespace splid
