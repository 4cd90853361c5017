#include "tests/support/bridging.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "protocol/ptu_header.hpp"
#include "tests/support/bridged_fault.hpp"
#include "tests/support/bridged_frames.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/laser_recording.hpp"
#include "tests/support/notify_socket.hpp"
#include "tests/support/program.hpp"
#include "tests/support/real_recording.hpp"
#include "tests/support/watched_daemon.hpp"
#include "tests/support/yardstick.hpp"

// `splid bridge picoquant` as a program, with the double of a library in it, and `splid run` at the
// other end of its socket.

namespace splid {
namespace {

using test::Bridging;
using test::PicoQuantInstrument;
using test::ProgramResult;
using test::WatchedDaemon;
using testing::HasSubstr;

class BridgingFamily : public ::testing::TestWithParam<int> {};

TEST_P(BridgingFamily, ItsRecordsBecomeFrames) {
  Bridging bridging(test::picoquant_kinds.at(static_cast<std::size_t>(GetParam())));
  bridging.instrument.give_scene();
  const auto bridge = bridging.start_bridge();
  WatchedDaemon daemon(bridging.write_scene_config(), "tcp://127.0.0.1:*");
  ASSERT_TRUE(daemon.await_good_frame()) << bridge->err();
  const double period_ps = bridging.instrument.scene_period_ps();
  EXPECT_NEAR(daemon.last_frame->distance_m.value_or(0), period_ps / 4 * test::m_per_ps, 0.1);
  EXPECT_NEAR(daemon.last_frame->sync->period_ps.value_or(0), period_ps, 1e-3);
  EXPECT_EQ(daemon.last_frame->lost_tags, 0U);
  EXPECT_EQ(daemon.stop().exit_code, 0);
}

INSTANTIATE_TEST_SUITE_P(All, BridgingFamily, ::testing::Range(0, 4), [](const auto& family) {
  return std::string(test::picoquant_kinds.at(static_cast<std::size_t>(family.param)).instrument);
});

class BridgingProgram : public ::testing::Test {
 protected:
  Bridging bridging{test::picoquant_kinds[0]};
  PicoQuantInstrument& instrument = bridging.instrument;
};

TEST_F(BridgingProgram, AStopClosesTheInstrumentAndRemovesTheSocket) {
  test::Yardstick yardstick;
  instrument.give_scene();
  const auto bridge = bridging.start_bridge();
  ASSERT_TRUE(test::eventually([&] { return instrument.control().records > 0; }));
  const auto begin = WatchedDaemon::Clock::now();
  bridge->signal(SIGTERM);
  const ProgramResult result = bridge->wait();
  EXPECT_TRUE(yardstick.keeps(500, WatchedDaemon::ms_since(begin)));
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(instrument.log(), testing::EndsWith("StopMeas\nCloseDevice 0\n"));
  EXPECT_FALSE(std::filesystem::exists(bridging.socket()));
  EXPECT_THAT(result.err, HasSubstr("MultiHarp: listening at unix:"));
  EXPECT_THAT(result.err, HasSubstr("MultiHarp 150 1045678: tags come"));
}

TEST_F(BridgingProgram, TheServiceManagerHearsHowItDoes) {
  test::NotifySocket manager("200000");
  instrument.plug("");
  const auto bridge = bridging.start_bridge();
  EXPECT_TRUE(manager.hears("READY=1"));
  EXPECT_TRUE(manager.hears("STATUS=no MultiHarp is plugged in"));
  EXPECT_TRUE(manager.hears("WATCHDOG=1"));
  EXPECT_TRUE(manager.hears("WATCHDOG=1"));
  instrument.give_scene();
  instrument.plug("1045678");
  EXPECT_TRUE(manager.hears("STATUS=MultiHarp 150 1045678: tags come"));
  bridge->signal(SIGTERM);
  EXPECT_TRUE(manager.hears("STOPPING=1"));
}

TEST_F(BridgingProgram, ACallThatHangsEndsTheBridge) {
  instrument.give_scene();
  const auto bridge = bridging.start_bridge();
  ASSERT_TRUE(test::eventually([&] { return instrument.control().records > 0; }));
  instrument.control().hangs = 1;
  const ProgramResult result = bridge->wait();
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("MH_ReadFiFo has not returned"));
}

TEST_F(BridgingProgram, AStopWhileACallHangsEndsItToo) {
  instrument.give_scene();
  const auto bridge = bridging.start_bridge();
  ASSERT_TRUE(test::eventually([&] { return instrument.control().records > 0; }));
  instrument.control().hangs = 1;
  ASSERT_TRUE(test::eventually([&] { return instrument.control().hung > 0; }));
  bridge->signal(SIGTERM);
  const ProgramResult result = bridge->wait();
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr("ends without closing the instrument"));
}

TEST_F(BridgingProgram, AConfigurationThatIsNoneIsAUsageError) {
  const auto error_of = [&](const std::string& text) {
    const ProgramResult result = test::run_program(
        {"bridge", "picoquant", "--config", bridging.folder.write("bad.json", text)});
    EXPECT_EQ(result.exit_code, 2) << result.err;
    return result.err;
  };
  const std::string good = bridging.bridge_json("");
  const auto with = [&](const std::string& more) { return bridging.bridge_json(more); };
  EXPECT_THAT(error_of("{}"), HasSubstr("\"schema\":\"splid.bridge.NAME\""));
  EXPECT_THAT(error_of(R"({"schema":"splid.config"})"),
              HasSubstr("/schema: \"splid.config\" is not \"splid.bridge.picoquant\""));
  EXPECT_THAT(error_of(R"({"schema":"splid.bridge.picoquant","instrument":"multiharp"})"),
              HasSubstr("listen"));
  EXPECT_THAT(error_of(R"({"schema":"splid.bridge.picoquant","instrument":"multiharp",)"
                       R"("listen":"bridge.sock"})"),
              HasSubstr("/listen: \"bridge.sock\" must begin with unix: or tcp:"));
  EXPECT_THAT(error_of(with(R"(,"sync":{"level":-50})")), HasSubstr("level_mv"));
  EXPECT_THAT(error_of(with(R"(,"sync":{"level_mv":1300})")), HasSubstr("/sync/level_mv: 1300"));
  EXPECT_THAT(error_of(with(R"(,"inputs":[{"level_mv":5}])")), HasSubstr("/inputs/0"));
  EXPECT_THAT(error_of(with(R"(,"inputs":[{"input":1},{"input":1}])")),
              HasSubstr("/inputs/1/input: 1 is there already"));
}

TEST_F(BridgingProgram, TwoBridgesAtOneSocketAreOneTooMany) {
  const auto bridge = bridging.start_bridge();
  ASSERT_TRUE(test::eventually([&] { return std::filesystem::exists(bridging.socket()); }));
  const auto second = bridging.start_bridge();
  const ProgramResult result = second->wait();
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("listens there"));
}

using PicoQuantFault = test::BridgedFault<PicoQuantInstrument>;

class PicoQuantInstrumentFault : public ::testing::TestWithParam<PicoQuantFault> {
 protected:
  Bridging bridging{test::picoquant_kinds[0]};
};

TEST_P(PicoQuantInstrumentFault, IsToldAndGoodFramesComeAgain) {
  bridging.instrument.give_scene();
  const double distance_m = bridging.instrument.scene_period_ps() / 4 * test::m_per_ps;
  test::expect_told_and_mended(bridging, GetParam(), distance_m, [this] {
    bridging.instrument.control().hangs = 0;
    return bridging.start_bridge(R"(,"serial":"1045678")");
  });
}

std::vector<PicoQuantFault> picoquant_faults() {
  const auto plug_in = [](PicoQuantInstrument& instrument) { instrument.plug("1045678"); };
  return {
      {"FifoFull", "MultiHarp: its FIFO was full",
       [](PicoQuantInstrument& it) { it.control().fifo_is_full = 1; }, "its FIFO was full"},
      {"ShortReads", "MultiHarp: the library hands out 100 records at a time",
       [](PicoQuantInstrument& it) { it.control().most_a_read = 100; }, ""},
      {"Garbage", "MultiHarp: 1,000 words that are no records",
       [](PicoQuantInstrument& it) { it.control().garbage_reads = 1; }, "not T2 records"},
      {"ClockRestart", "MultiHarp: a measurement of 100 h is over, its clock begins anew",
       [](PicoQuantInstrument& it) { it.control().measurement_ends = 1; },
       "longest measurement is over; its clock begins anew"},
      {"Unplugged", "MultiHarp is unplugged, and plugged in again",
       [](PicoQuantInstrument& it) { it.plug(""); }, "it was unplugged or switched off", plug_in},
      {"AnotherSerial", "another MultiHarp is plugged in in its place",
       [](PicoQuantInstrument& it) {
         it.plug("1099999");
         it.control().failing_code = -37;
       },
       "there is 1099999",
       [](PicoQuantInstrument& it) {
         it.control().failing_code = 0;
         it.plug("1045678");
       }},
      {"Busy", "MultiHarp is unplugged, and another program has it when it comes back",
       [](PicoQuantInstrument& it) {
         it.control().open_code = -2;
         it.control().failing_code = -37;
       },
       "is in use",
       [](PicoQuantInstrument& it) {
         it.control().open_code = 0;
         it.control().failing_code = 0;
       }},
      {"Silent", "MultiHarp sends nothing",
       [](PicoQuantInstrument& it) { it.control().is_silent = 1; }, "it sends nothing",
       [](PicoQuantInstrument& it) { it.control().is_silent = 0; }},
      {"Warning", "MultiHarp's library warns",
       [](PicoQuantInstrument& it) { it.control().warnings = 1; }, "Sync rate is zero"},
      {"Crash", "MultiHarp's library crashes; the bridge is started again",
       [](PicoQuantInstrument& it) { it.control().crashes = 1; }, "closed the connection", nullptr,
       true},
      {"Hang", "a call into MultiHarp's library hangs; the bridge ends and is started again",
       [](PicoQuantInstrument& it) { it.control().hangs = 1; }, "nothing came for a second",
       nullptr, true},
  };
}

INSTANTIATE_TEST_SUITE_P(PicoQuant, PicoQuantInstrumentFault,
                         ::testing::ValuesIn(picoquant_faults()),
                         [](const auto& fault) { return std::string(fault.param.name); });

// Frames of a recording, by its replay and by a bridge whose library hands out its records.
class BridgedRecording : public ::testing::Test {
 protected:
  // photon: as the recording numbers it, from 0.
  void expect_same(const test::PicoQuantKind& kind, const std::string& recording, int photon,
                   double period_ps) {
    const auto bytes = test::file_bytes(recording);
    const RecordingHeader header = parse_ptu_header(bytes, true).value();
    Bridging bridging(kind);
    bridging.instrument.control().resolution_ps = header.resolution_s * 1e12;
    bridging.instrument.give_file(recording, header.header_bytes);
    const std::string replay =
        bridging.write_config(R"({"driver":"replay","recording":")" + recording + "\"}",
                              std::to_string(photon), period_ps, test::short_frames);
    std::vector<std::string> expected = test::replayed(recording, replay, header.origin_ps);
    ASSERT_GT(expected.size(), 4U);
    expected.pop_back();  // ends with the recording: a live stream would go on
    const std::string live = bridging.write_config(bridging.source(), std::to_string(photon + 1),
                                                   period_ps, test::short_frames);
    bridging.instrument.plug("");
    const auto frames = test::bridged(
        live, expected.size(), [&] { return bridging.start_bridge(); }, "is plugged in",
        [&] { bridging.instrument.plug("1045678"); });
    ASSERT_EQ(frames.size(), expected.size());
    for (std::size_t i = 0; i < frames.size(); ++i) EXPECT_EQ(frames[i], expected[i]) << i;
  }
};

TEST_F(BridgedRecording, HasTheFramesOfItsReplay) {
  const std::string name = "qutag_sync_t2.ptu";
  const std::string recording = test::real_recording_path(name).string();
  if (!std::filesystem::exists(recording)) GTEST_SKIP() << recording << " is not there";
  expect_same(test::picoquant_kinds[1], recording, 1, 12512.62584);
}

TEST_F(BridgedRecording, OfAHydraHarpWithoutSyncsHasThemToo) {
  const std::string name = "hydraharp400_t2_hbt.ptu";
  const std::string recording = test::real_recording_path(name).string();
  if (!std::filesystem::exists(recording)) GTEST_SKIP() << recording << " is not there";
  expect_same(test::picoquant_kinds[1], recording, 0, 1'000'000);
}

TEST_F(BridgedRecording, OfALaserHasThemToo) {
  const test::TempFolder folder;
  const std::string recording = folder.path("made.ptu");
  test::LaserRecording::write(recording);
  expect_same(test::picoquant_kinds[1], recording, 1, test::LaserRecording::period_ps);
}

}  // namespace
}  // namespace splid
