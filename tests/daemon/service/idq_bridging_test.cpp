#include "tests/support/idq_bridging.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "daemon/recording/ptu_writer.hpp"
#include "daemon/stream/device_clock.hpp"
#include "tests/support/bridged_fault.hpp"
#include "tests/support/bridged_frames.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/laser_recording.hpp"
#include "tests/support/real_recording.hpp"
#include "tests/support/watched_daemon.hpp"
#include "tests/support/yardstick.hpp"

// `splid bridge idq` as a program, with a double of the instrument and of the maker's program at
// its ZeroMQ sockets, and `splid run` at the other end of its own.

namespace splid {
namespace {

using test::IdqBridging;
using test::Program;
using test::ProgramResult;
using test::TimeControllerDouble;
using test::TimeControllerScene;
using test::WatchedDaemon;
using testing::HasSubstr;

constexpr double scene_distance_m = TimeControllerScene::period_ps / 4.0 * test::m_per_ps;

class IdqBridgingProgram : public ::testing::Test {
 protected:
  IdqBridging bridging;
};

// The latency is that of a whole sub-acquisition and what the way costs.
TEST_F(IdqBridgingProgram, TimesBecomeFrames) {
  test::Yardstick yardstick;
  const auto bridge = bridging.start_bridge();
  WatchedDaemon daemon(bridging.write_scene_config(), "tcp://127.0.0.1:*");
  std::vector<double> latencies_ms;
  for (int i = 0; i < 8; ++i) {
    ASSERT_TRUE(daemon.await_good_frame()) << bridge->err();
    const FrameMessage& frame = *daemon.last_frame;
    latencies_ms.push_back(WatchedDaemon::ms_since(bridging.instrument.played()) -
                           static_cast<double>(frame.start_ps) * 1e-9 - frame.duration_ms);
  }
  EXPECT_NEAR(daemon.last_frame->distance_m.value_or(0), scene_distance_m, 0.1);
  EXPECT_NEAR(daemon.last_frame->sync->period_ps.value_or(0), TimeControllerScene::period_ps, 1e-3);
  EXPECT_EQ(daemon.last_frame->lost_tags.value_or(0), 0U);
  const double latency_ms = test::median(latencies_ms);
  std::printf("LATENCY | %.0f ms\n", latency_ms);
  EXPECT_GT(latency_ms, 200);
  EXPECT_TRUE(yardstick.keeps(350, latency_ms));
  EXPECT_EQ(daemon.stop().exit_code, 0);
}

TEST_F(IdqBridgingProgram, TheInstrumentIsSetAsConfiguredAndStopped) {
  const auto bridge = bridging.start_bridge();
  TimeControllerDouble& instrument = bridging.instrument;
  ASSERT_TRUE(test::eventually([&] { return instrument.plays() > 0; }));
  bridge->signal(SIGTERM);
  EXPECT_EQ(bridge->wait().exit_code, 0);
  const auto input = [](int n) {
    const std::string i = std::to_string(n);
    return "INPU" + i + ":COUP DC\nINPU" + i + ":EDGE RISING\nINPU" + i + ":THRE 0.100V\nINPU" + i +
           ":SELE UNSHAPED\nINPU" + i + ":ENAB ON\nDELA" + i + ":LINK INPU" + i + "\nDELA" + i +
           ":VALU 0\nTSCO" + std::to_string(n + 4) + ":FIR:LINK DELA" + i + "\nTSCO" +
           std::to_string(n + 4) + ":OPIN ONLYFIR\nTSCO" + std::to_string(n + 4) +
           ":OPOU ONLYFIR\nTSCO" + std::to_string(n + 4) + ":WIND:ENAB OFF\nRAW" + i +
           ":STOP:LINK TSCO" + std::to_string(n + 4) + "\nRAW" + i + ":REF:LINK NONE\n";
  };
  const auto stream = [&](int n) {
    const std::string i = std::to_string(n);
    return "RAW" + i + ":ERRORS:CLEAR\nstart-stream --address 127.0.0.1 --channel " + i +
           " --stream-port " + std::to_string(instrument.stream_port() + n) + "\nRAW" + i +
           ":SEND ON\n";
  };
  EXPECT_EQ(instrument.log(),
            "list\nREC:STOP\nDEVI:SYNC INTERNAL\nDEVI:RES HIRES\n" + input(1) + input(2) +
                input(4) +
                "REC:TRIG:ARM:MODE MANUal\nREC:ENABle ON\nREC:NUM INF\n"
                "REC:PWID 200000000000;PPER 200000040000\n" +
                stream(1) + stream(2) + stream(4) +
                "REC:PLAY\nREC:STOP\nRAW1:SEND OFF\nRAW2:SEND OFF\nRAW4:SEND OFF\n"
                "stop --id 127.0.0.1:5556\nstop --id 127.0.0.1:5557\nstop --id 127.0.0.1:5559\n");
}

// A bridge that was killed leaves a measurement and streams behind.
TEST_F(IdqBridgingProgram, WhatAKilledBridgeLeftIsTakenOver) {
  TimeControllerDouble& instrument = bridging.instrument;
  {
    const auto bridge = bridging.start_bridge();
    ASSERT_TRUE(test::eventually([&] { return instrument.plays() == 1; }));
    bridge->signal(SIGKILL);
    (void)bridge->wait();
  }
  const auto bridge = bridging.start_bridge();
  EXPECT_TRUE(test::eventually([&] { return instrument.plays() == 2; })) << bridge->err();
  EXPECT_THAT(instrument.log(), HasSubstr("list\nstop --id 127.0.0.1:5556\n"));
}

TEST_F(IdqBridgingProgram, ItIsTriedThroughItsSocket) {
  const auto bridge = bridging.start_bridge();
  ASSERT_TRUE(test::eventually([&] { return bridging.instrument.plays() > 0; }));
  const ProgramResult result =
      test::run_program({"devices", "--try", "unix:" + bridging.socket(), "--seconds", "0.5"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, testing::ContainsRegex("input 1 +[0-9]+ /s\n"));
  EXPECT_THAT(result.out, testing::ContainsRegex("input 4 +[0-9]+ /s   one each 10000.000 ns\n"));
  EXPECT_THAT(result.out, HasSubstr("\"sync\": \"4\""));
}

TEST_F(IdqBridgingProgram, AConfigurationThatIsNoneIsAUsageError) {
  const auto error_of = [&](const std::string& text) {
    const ProgramResult result =
        test::run_program({"bridge", "idq", "--config", bridging.folder.write("bad.json", text)});
    EXPECT_EQ(result.exit_code, 2) << result.err;
    return result.err;
  };
  const std::string head = R"({"schema":"splid.bridge.idq","listen":"unix:/tmp/none.sock")";
  const auto with = [&](const std::string& more) { return error_of(head + more + "}"); };
  EXPECT_THAT(with(""), HasSubstr("address"));
  EXPECT_THAT(with(R"(,"address":"192.168.1.5")"), HasSubstr("/address: \"192.168.1.5\" must"));
  EXPECT_THAT(with(R"(,"address":"unix:/a")"),
              HasSubstr("/address: \"unix:/a\" must begin with tcp:"));
  const std::string good = R"(,"address":"tcp:192.168.1.5:5555")";
  EXPECT_THAT(with(good + R"(,"data_link":"tcp:a")"), HasSubstr("/data_link: \"tcp:a\""));
  EXPECT_THAT(with(good + R"(,"sub_acquisition_ms":199)"), HasSubstr("/sub_acquisition_ms: 199"));
  EXPECT_THAT(with(good + R"(,"inputs":[])"), HasSubstr("/inputs: is empty"));
  EXPECT_THAT(with(good + R"(,"inputs":[{"input":5}])"), HasSubstr("/inputs/0/input: 5"));
  EXPECT_THAT(with(good + R"(,"inputs":[{"input":2},{"input":2}])"),
              HasSubstr("/inputs/1/input: 2 is there already"));
}

using IdqFault = test::BridgedFault<TimeControllerDouble>;

class IdqInstrumentFault : public ::testing::TestWithParam<IdqFault> {
 protected:
  IdqBridging bridging;
};

TEST_P(IdqInstrumentFault, IsToldAndGoodFramesComeAgain) {
  test::expect_told_and_mended(bridging, GetParam(), scene_distance_m,
                               [this] { return bridging.start_bridge(); });
}

std::vector<IdqFault> idq_faults() {
  using Double = TimeControllerDouble;
  std::vector<IdqFault> faults = {
      {"InstrumentGone", "Time Controller: nobody answers at its address, and then it does",
       [](Double& it) { it.faults.instrument_is_gone = true; }, "the Time Controller at 127.0.0.1:",
       [](Double& it) { it.faults.instrument_is_gone = false; }},
      {"ProgramGone", "Time Controller: the data link program ends, and is started again",
       [](Double& it) { it.faults.program_is_gone = true; }, "the data link program at 127.0.0.1:",
       [](Double& it) { it.faults.program_is_gone = false; }},
      {"AnotherVersion", "Time Controller comes back with a firmware that lacks a command",
       [](Double& it) {
         it.faults.is_older = true;
         it.faults.is_stopped = true;
       },
       "does not know REC:PWID 200000000000;PPER 200000040000: its firmware is of a version that",
       [](Double& it) { it.faults.is_older = false; }},
      {"Refused", "Time Controller: the data link program refuses a stream",
       [](Double& it) {
         it.faults.refuses_streams = true;
         it.faults.is_stopped = true;
       },
       "refuses: the port is used by another program",
       [](Double& it) { it.faults.refuses_streams = false; }},
      // The one after it counts too where it ends before the bridge gives up, as nothing tells
      // which came.
      {"LostSubAcquisition", "Time Controller: a sub-acquisition of an input does not come",
       [](Double& it) { it.faults.drops = 1; }, "did not come whole"},
      {"ClockRestart", "Time Controller: another program stops the measurement",
       [](Double& it) { it.faults.is_stopped = true; },
       "its acquisition was stopped by somebody else; its clock begins anew"},
      {"Garbage", "Time Controller: a message whose times are none",
       [](Double& it) { it.faults.garbage = 1; }, "were no times of a sub-acquisition"},
      {"LostTimes", "Time Controller: an input has more events than it can send",
       [](Double& it) { it.faults.errors = 3; }, "it lost times of input"},
      {"Silent", "Time Controller: no sub-acquisition ends",
       [](Double& it) { it.faults.is_silent = true; }, "no sub-acquisition came for 2 s",
       [](Double& it) { it.faults.is_silent = false; }},
  };
  for (IdqFault& fault : faults) fault.costs_frames = true;
  return faults;
}

INSTANTIATE_TEST_SUITE_P(Idq, IdqInstrumentFault, ::testing::ValuesIn(idq_faults()),
                         [](const auto& fault) { return std::string(fault.param.name); });

// Frames of a recording, by its replay and by a bridge whose instrument sees its events.
class IdqRecording : public ::testing::Test {
 protected:
  static constexpr std::int64_t width_ps = 200'000'000'000;
  static constexpr std::int64_t period_ps = width_ps + 40'000;

  // The tags without those in the dead times, which are losses.
  static void write_with_dead_times(const std::vector<Tag>& tags, const std::string& file) {
    const DeviceClock clock{SourceInfo{"made", false, 1.6e9}, host_clock()};
    recording::PtuWriter writer(file, {}, clock, true);
    std::int64_t end_ps = width_ps;
    std::vector<Tag> seen;
    for (const Tag& tag : tags) {
      for (; tag.time_ps >= end_ps; end_ps += period_ps) {
        seen.push_back({end_ps, 0, TagKind::loss_begin, {}});
        seen.push_back({end_ps + period_ps - width_ps, -1, TagKind::loss_end, {}});
      }
      if (tag.time_ps >= end_ps - width_ps) seen.push_back(tag);
    }
    writer.write(seen);
    writer.close();
  }

  // first_input: of the instrument, for input 0 of the recording. Syncs come on input 4.
  static void expect_same(std::vector<Tag> tags, int photon, int first_input, double pattern_ps,
                          const std::string& recording) {
    std::map<int, std::vector<std::int64_t>> of_input;
    for (const Tag& tag : tags) {
      if (!is_event(tag.kind)) continue;
      of_input[tag.kind == TagKind::sync ? 4 : tag.value + first_input].push_back(tag.time_ps);
    }
    IdqBridging bridging([&](int input, std::int64_t begin_ps, std::int64_t end_ps) {
      const std::vector<std::int64_t>& all = of_input[input];
      const auto begin = std::lower_bound(all.begin(), all.end(), begin_ps);
      return std::vector<std::int64_t>(begin, std::lower_bound(begin, all.end(), end_ps));
    });
    const auto config = [&](const std::string& file) {
      return bridging.write_config(R"({"driver":"replay","recording":")" + file + "\"}",
                                   std::to_string(photon), pattern_ps, test::short_frames);
    };
    const std::string with_dead_times = bridging.folder.path("dead.ptu");
    write_with_dead_times(tags, with_dead_times);
    std::vector<std::string> expected = test::replayed(with_dead_times, config(with_dead_times));
    ASSERT_GT(expected.size(), 4U);
    expected.pop_back();  // ends with the recording: a live stream would go on
    const std::string live =
        bridging.write_config(bridging.source(), std::to_string(photon + first_input), pattern_ps,
                              test::short_frames, "4");
    bridging.instrument.faults.instrument_is_gone = true;
    const auto frames = test::bridged(
        live, expected.size(), [&] { return bridging.start_bridge(); }, "does not answer",
        [&] { bridging.instrument.faults.instrument_is_gone = false; });
    ASSERT_EQ(frames.size(), expected.size());
    for (std::size_t i = 0; i < frames.size(); ++i) EXPECT_EQ(frames[i], expected[i]) << i;
    // All but those with a dead time are those of the recording itself.
    const auto whole = test::replayed(recording, config(recording), origin_ps(recording));
    ASSERT_GE(whole.size(), frames.size());
    std::size_t same = 0;
    for (std::size_t i = 0; i < frames.size(); ++i) same += frames[i] == whole[i] ? 1U : 0U;
    EXPECT_GE(same + static_cast<std::size_t>(tags.back().time_ps / period_ps), frames.size());
  }

  static std::int64_t origin_ps(const std::string& recording) {
    return parse_ptu_header(test::file_bytes(recording), true).value().origin_ps;
  }
  // From the origin on.
  static std::vector<Tag> tags_of(const std::string& recording) {
    std::vector<Tag> tags = test::ptu_tags(recording);
    std::erase_if(tags, [](const Tag& tag) { return !is_event(tag.kind); });
    const std::int64_t from_ps = origin_ps(recording);
    for (Tag& tag : tags) tag.time_ps -= from_ps;
    return tags;
  }
};

TEST_F(IdqRecording, HasTheFramesOfItsReplay) {
  const std::string recording = test::real_recording_path("qutag_sync_t2.ptu").string();
  if (!std::filesystem::exists(recording)) GTEST_SKIP() << recording << " is not there";
  expect_same(tags_of(recording), 1, 0, 12512.62584, recording);
}

TEST_F(IdqRecording, OfALaserHasThemToo) {
  const test::TempFolder folder;
  const std::string recording = folder.path("made.ptu");
  test::LaserRecording::write(recording);
  expect_same(tags_of(recording), 1, 0, test::LaserRecording::period_ps, recording);
}

}  // namespace
}  // namespace splid
