#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "protocol/pattern_json.hpp"
#include "tests/support/faulty_bridge.hpp"
#include "tests/support/local_connection.hpp"
#include "tests/support/small_disk.hpp"
#include "tests/support/watched_daemon.hpp"

// The built program measures a live instrument behind a bridge, and something goes wrong: with the
// instrument, its clock, the light, the syncs, a subscriber, a stranger at a socket, the
// configuration, the disk. Each is said or shown, what is lost is counted, and good frames come
// again. Times are printed, not asserted.

namespace splid {
namespace {

using std::chrono::milliseconds;
using test::FaultyBridge;
using test::Tags16Record;
using test::WatchedDaemon;

constexpr const char* pattern_file = SPLID_SOURCE_DIR "/config/patterns/interleaved-180-189.json";
constexpr std::int64_t second_ps = 1'000'000'000'000;
constexpr int sync_input = 8;

SimulatorOptions scene_options() {
  SimulatorOptions options;
  options.target.distance_m = 284.5;
  return options;
}

std::vector<std::byte> noise(std::size_t bytes) {
  std::mt19937 random(5);
  std::vector<std::byte> made(bytes);
  for (std::byte& byte : made) byte = static_cast<std::byte>(random());
  return made;
}

std::string noise_text(std::size_t bytes) {
  const std::vector<std::byte> made = noise(bytes);
  return {reinterpret_cast<const char*>(made.data()), made.size()};
}

class Faults : public ::testing::Test {
 protected:
  void start(const std::string& more = "") {
    config(more);
    daemon = std::make_unique<WatchedDaemon>(folder.path("config.json"), "tcp://127.0.0.1:*");
    ASSERT_TRUE(daemon->await_good_frame());
  }
  void config(const std::string& more) const {
    (void)folder.write(
        "config.json",
        R"({"schema":"splid.config","v":[1,0],"control":{"endpoint":"off"},"source":{"driver":"bridge","address":")" +
            bridge.address() +
            R"("},"channels":{"photon":[1],"sync":"8"},"estimator":{"effort":"fast"},)"
            R"("pipeline":{"ring_capacity_tags":524288},"pattern":{"file":")" +
            pattern_file + R"("},"publish":{"endpoint":"tcp://127.0.0.1:*"})" + more + "}");
  }

  // Where the log says that the daemon listens, after these words.
  [[nodiscard]] int port_after(const std::string& words) const {
    const std::string err = daemon->program->err();
    const auto at = err.find(words);
    return at == std::string::npos ? 0 : std::stoi(err.substr(at + words.size()));
  }

  void TearDown() override {
    if (daemon == nullptr) return;
    const test::ProgramResult result = daemon->stop();
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }

  test::TempFolder folder;
  FaultyBridge bridge{
      folder.path("bridge"),
      test::SceneRecords(pattern_from_json(test::file_text(pattern_file), pattern_file),
                         scene_options())};
  std::unique_ptr<WatchedDaemon> daemon;
};

struct Fault {
  const char* name;
  const char* words;  // what it is, for the table
  std::function<void(FaultyBridge&)> inject;
  const char* said;                // words of the status; empty: the frames show it
  WatchedDaemon::FrameTest shows;  // then a frame that shows it
  std::function<void(FaultyBridge&)> heal = nullptr;  // null: it is over by itself
  std::int64_t lost_tags = -1;                        // exactly; -1: as the moment has it
};

void PrintTo(const Fault& fault, std::ostream* out) { *out << fault.name; }

class InstrumentFault : public Faults, public ::testing::WithParamInterface<Fault> {};

TEST_P(InstrumentFault, IsToldAndCountedAndGoodFramesComeAgain) {
  const Fault& fault = GetParam();
  start();
  daemon->start_counting();
  auto begin = WatchedDaemon::Clock::now();
  fault.inject(bridge);
  const bool is_said = *fault.said != '\0';
  ASSERT_TRUE(is_said ? daemon->await_status(fault.said) : daemon->await_frame(fault.shows));
  const double said_ms = WatchedDaemon::ms_since(begin);
  const std::string shown =
      is_said ? daemon->said : "a frame: " + std::string(to_string(daemon->last_frame->status));
  if (fault.heal) {
    begin = WatchedDaemon::Clock::now();
    fault.heal(bridge);
  }
  ASSERT_TRUE(daemon->await_good_frame());
  const double good_ms = WatchedDaemon::ms_since(begin);
  EXPECT_NEAR(daemon->last_frame->distance_m.value_or(0), 284.5, 0.5);
  if (fault.lost_tags >= 0) {
    EXPECT_EQ(daemon->lost_tags, static_cast<std::uint64_t>(fault.lost_tags));
  }
  test::record({fault.words, shown, said_ms, daemon->losses(), good_ms});
}

// Changes one block, and no other.
void once(FaultyBridge& bridge, FaultyBridge::Damage damage) {
  bridge.damage([damage = std::move(damage), done = false](auto& records) mutable {
    if (!std::exchange(done, true)) damage(records);
  });
}

void undo(FaultyBridge& bridge) { bridge.damage({}); }

// After the block's first record, in its place in time.
void put_second(std::vector<Tags16Record>& records, std::vector<Tags16Record> more) {
  const std::int64_t at_ps = records.front().time_ps;
  for (Tags16Record& record : more) record.time_ps = at_ps;
  records.insert(records.begin() + 1, more.begin(), more.end());
}

bool is_dark(const FrameMessage& frame) { return frame.status == FrameStatus::no_target; }
bool is_unseen(const FrameMessage& frame) { return frame.seen_fraction.value_or(1) < 1; }
WatchedDaemon::FrameTest lost(std::uint64_t tags) {
  return [tags](const FrameMessage& frame) { return frame.lost_tags.value_or(0) == tags; };
}

const std::vector<Fault>& faults() {
  static const std::vector<Fault> all = {
      {"hangsUp",
       "bridge closes the connection and takes the next",
       [](FaultyBridge& bridge) { bridge.hang_up(false); },
       "closed the connection",
       {}},
      {"goesAway",
       "bridge goes away",
       [](FaultyBridge& bridge) { bridge.hang_up(true); },
       "closed the connection",
       {},
       [](FaultyBridge& bridge) { bridge.come_back(); }},
      {"silent",
       "bridge sends nothing",
       [](FaultyBridge& bridge) { bridge.set_silent(true); },
       "sends nothing, not even a heartbeat",
       {},
       [](FaultyBridge& bridge) { bridge.set_silent(false); }},
      {"silentForLong",
       "bridge sends nothing for 3 s, as after a power failure",
       [](FaultyBridge& bridge) { bridge.set_silent(true); },
       "silent for 3 s; connecting anew",
       {},
       [](FaultyBridge& bridge) { bridge.set_silent(false); }},
      {"garbage", "5,003 bytes of garbage in place of 3 ms of blocks",
       [](FaultyBridge& bridge) {
         bridge.sender.skip(3);
         bridge.insert(noise(5003));
       },
       "", is_unseen},
      {"gap", "3 ms of blocks are missing", [](FaultyBridge& bridge) { bridge.sender.skip(3); }, "",
       is_unseen},
      {"missed", "instrument says that 500 tags were missed",
       [](FaultyBridge& bridge) {
         once(bridge, [](auto& records) { put_second(records, {{0, 1, 4, 500}}); });
       },
       "", lost(500), undo, 500},
      {"overflow", "instrument's memory overflows, 1,234 tags missed",
       [](FaultyBridge& bridge) {
         once(bridge, [](auto& records) {
           put_second(records, {{0, 0, 2, 0}, {0, 1, 4, 1234}, {0, 0, 3, 0}});
         });
       },
       "", lost(1234), undo, 1234},
      {"timeBase", "instrument says that its time base broke",
       [](FaultyBridge& bridge) {
         once(bridge, [](auto& records) { put_second(records, {{0, 0, 1, 0}}); });
       },
       "", is_unseen, undo},
      {"clockAhead", "clock jumps 10 s forward, unsaid",
       [](FaultyBridge& bridge) { bridge.sender.step(10 * second_ps); }, "",
       [](const FrameMessage& frame) { return frame.start_ps > 9 * second_ps; }},
      {"clockBack", "clock jumps 10 s back, unsaid",
       [](FaultyBridge& bridge) { bridge.sender.step(-10 * second_ps); }, "",
       [](const FrameMessage& frame) { return frame.start_ps < -5 * second_ps; }},
      {"clockOfDays", "clock jumps to 3.4e17 ps, an epoch of 3.9 days",
       [](FaultyBridge& bridge) { bridge.sender.step(340'000 * second_ps); }, "",
       [](const FrameMessage& frame) { return frame.start_ps > 339'000 * second_ps; }},
      {"noSync",
       "sync cable comes off",
       [](FaultyBridge& bridge) {
         bridge.damage([](auto& records) {
           std::erase_if(records, [](const auto& r) { return r.channel == sync_input; });
         });
       },
       "too few pattern syncs",
       {},
       undo},
      {"doubledSync", "every sync comes twice, 20 ns apart",
       [](FaultyBridge& bridge) {
         bridge.damage([](auto& records) {
           std::vector<Tags16Record> made;
           for (const Tags16Record& record : records) {
             made.push_back(record);
             if (record.channel != sync_input) continue;
             made.push_back({record.time_ps + 20'000, sync_input, 0, 0});
           }
           records = made;
         });
       },
       "", [](const FrameMessage& frame) { return frame.sync->spurious > 10'000; }, undo, 0},
      {"dark", "detector is covered",
       [](FaultyBridge& bridge) {
         bridge.damage([](auto& records) {
           std::erase_if(records, [](const auto& r) { return r.channel != sync_input; });
         });
       },
       "", is_dark, undo, 0},
      {"flood", "200,000 photons in one millisecond",
       [](FaultyBridge& bridge) {
         once(bridge, [](auto& records) {
           put_second(records, std::vector<Tags16Record>(200'000, {0, 1, 0, 0}));
         });
       },
       "", [](const FrameMessage& frame) { return frame.photons.value_or(0) > 200'000; }, undo, 0},
      {"stray", "one time stamp is an hour ahead",
       [](FaultyBridge& bridge) {
         once(bridge, [](auto& records) {
           records.insert(records.begin() + 1,
                          {records.front().time_ps + 3600 * second_ps, 1, 0, 0});
         });
       },
       "", [](const FrameMessage& frame) { return frame.lost_tags.value_or(0) > 0; }, undo},
  };
  return all;
}

INSTANTIATE_TEST_SUITE_P(List, InstrumentFault, ::testing::ValuesIn(faults()),
                         [](const auto& fault) { return fault.param.name; });

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
       [this] { (void)folder.write("config.json", noise_text(5000)); }},
      {"gone", "configuration removed, SIGHUP", "not reloaded",
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

// Bytes of no meaning, a half-said greeting of ZeroMQ, and connections that say nothing.
TEST_F(Faults, StrangersAtThePublishersPortCostNothing) {
  start();
  const int port = port_after("publishing at tcp://127.0.0.1:");
  ASSERT_NE(port, 0);
  daemon->start_counting();
  std::vector<std::unique_ptr<test::LocalConnection>> held;
  for (int i = 0; i < 40; ++i) {
    held.push_back(std::make_unique<test::LocalConnection>(port));
    if (i % 3 == 0) held.back()->send(noise_text(60'000));
    if (i % 3 == 1) held.back()->send(std::string("\xff\0\0\0\0\0\0\0\x01\x7f\x03", 11));
    ASSERT_TRUE(daemon->await_good_frame());
  }
  EXPECT_EQ(daemon->bad_frames, 0U);
  EXPECT_EQ(daemon->lost_tags, 0U);
  test::record({"40 strangers at the publisher's port: garbage, half a greeting, silence",
                "nothing: they are not listened to", -1, daemon->losses(), 0});
}

TEST_F(Faults, StrangersAtTheMetricsPortCostNothing) {
  start(R"(,"metrics":{"http":"127.0.0.1:*"})");
  const int port = port_after("metrics at http://127.0.0.1:");
  ASSERT_NE(port, 0);
  daemon->start_counting();
  std::vector<std::unique_ptr<test::LocalConnection>> held;
  for (int i = 0; i < 40; ++i) {
    held.push_back(std::make_unique<test::LocalConnection>(port));
    if (i % 3 == 0) held.back()->send(noise_text(60'000));
    if (i % 3 == 1) held.back()->send("GET /metr");
    ASSERT_TRUE(daemon->await_good_frame());
  }
  EXPECT_EQ(daemon->bad_frames, 0U);
  EXPECT_EQ(daemon->lost_tags, 0U);
  test::record({"40 strangers at the metrics' port: garbage, half a request, silence",
                "nothing: they are refused", -1, daemon->losses(), 0});
}

TEST_F(Faults, AnEncoderThatSpeaksGarbageCostsItsReferenceAlone) {
  test::BridgeServer encoder;
  std::jthread speaker([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      if (encoder.accept(20)) (void)encoder.send(noise_text(5000));
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

TEST_F(Faults, AFullDiskForTheMetricsIsSaid) {
  const test::SmallDisk disk(1);
  if (!disk.mounted()) GTEST_SKIP() << "takes root, to mount a small disk";
  start(R"(,"metrics":{"file":")" + disk.path("splid.prom") + "\"}");
  daemon->start_counting();
  const auto begin = WatchedDaemon::Clock::now();
  disk.fill_but(0);
  ASSERT_TRUE(daemon->await_status("cannot be written"));
  const double said_ms = WatchedDaemon::ms_since(begin);
  const std::string said = daemon->said;
  disk.clear();
  ASSERT_TRUE(daemon->await_status("is written again"));
  EXPECT_EQ(daemon->bad_frames, 0U);
  EXPECT_EQ(daemon->lost_tags, 0U);
  test::record({"disk of the metrics' file is full", said, said_ms, daemon->losses(), 0});
}

}  // namespace
}  // namespace splid
