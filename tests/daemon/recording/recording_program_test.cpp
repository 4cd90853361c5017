#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <string>
#include <thread>

#include "daemon/sockets/subscriber.hpp"
#include "drivers/replay/recording_info.hpp"
#include "protocol/frame_json.hpp"
#include "protocol/json_value.hpp"
#include "protocol/status_json.hpp"
#include "tests/support/fault_record.hpp"
#include "tests/support/light_scene.hpp"
#include "tests/support/patience.hpp"
#include "tests/support/program.hpp"
#include "tests/support/read_back.hpp"
#include "tests/support/small_disk.hpp"
#include "tests/support/strict_ptu.hpp"
#include "tests/support/yardstick.hpp"

// What the built program keeps while it measures.

namespace splid::recording {
namespace {

using splid::test::Program;
using splid::test::ProgramResult;
using splid::test::read_back;
using splid::test::read_strictly;
using splid::test::recordings_in;
using splid::test::run_program;
using splid::test::SmallDisk;
using Message = sockets::Subscriber::Message;
using std::chrono::milliseconds;
using ::testing::HasSubstr;

using test::patience;

class RecordingProgram : public ::testing::Test {
 protected:
  // The pattern's syncs and 60,000 photons a second, at their own pace, and an encoder's samples.
  std::string config(const std::string& record, const std::string& source = "",
                     const std::string& pace = R"("pace":"live","encoder_rate_hz":1000)") const {
    return folder.write("config.json",
                        R"({"schema":"splid.config","v":[1,0],"source":{"driver":"simulator")" +
                            (pace.empty() ? "" : "," + pace) + source +
                            R"(},"pattern":{"file":")" SPLID_SOURCE_DIR
                            R"(/config/patterns/interleaved-180-189.json"},"record":{)" +
                            record + R"(},"publish":{"endpoint":")" + endpoint + "\"}" +
                            test::with_light_scene(test::small_ring) + "}");
  }

  // SPLID_KILLS: more of them, for a table.
  static int killed_rounds() {
    const char* rounds = std::getenv("SPLID_KILLS");
    return rounds == nullptr ? 4 : std::atoi(rounds);
  }

  // Whether such a message comes.
  template <class Wanted>
  static bool hear(sockets::Subscriber& subscriber, Wanted wanted) {
    const auto until = std::chrono::steady_clock::now() + patience;
    while (std::chrono::steady_clock::now() < until) {
      const auto message = subscriber.receive(milliseconds{200});
      if (message && wanted(*message)) return true;
    }
    return false;
  }

  splid::test::TempFolder folder;
  std::string endpoint = "ipc://" + folder.path("frames");
};

TEST_F(RecordingProgram, RelativeFoldersAreBesideTheConfigurationAndCountsBesideTheTags) {
  const std::string file = config(R"("folder":"kept","max_file_s":1)", R"(,"seconds":1.5)");
  const ProgramResult result = run_program({"run", "--config", file});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("2 recordings; 0 tags lost to the disk"));
  const std::vector<std::string> files = recordings_in(folder.path("kept"));
  ASSERT_EQ(files.size(), 2u);
  for (const std::string& recording : files) {
    const ProgramResult checked = run_program({"check", recording});
    EXPECT_EQ(checked.exit_code, 0);
    EXPECT_THAT(checked.out, HasSubstr("counts of its encoder are beside it"));
    EXPECT_TRUE(std::filesystem::exists(recording + ".encoder.csv"));
  }
  // A replay measures, and records nothing.
  EXPECT_THAT(run_program({"replay", files[0], "--config", file, "--json"}).out,
              HasSubstr("\"reference\":{"));
  EXPECT_EQ(recordings_in(folder.path("kept")).size(), 2u);
}

// Recorded from the start, or when asked to: subscribers hear of each file that is begun, and of
// the end.
TEST_F(RecordingProgram, TheStatusNamesTheFileThatIsBeingWritten) {
  const std::string control = "ipc://" + folder.path("control");
  Program daemon({"run", "--config", folder.write("asked.json", [&] {
                    std::string text = test::file_text(config(R"("folder":"kept","max_file_s":1)"));
                    return text.insert(1, R"("control":{"endpoint":")" + control + R"("},)");
                  }())});
  sockets::Subscriber subscriber(endpoint, {topic_status});
  std::set<std::string> named;
  EXPECT_TRUE(hear(subscriber, [&](const Message& message) {
    const auto status = json_value(message.json);
    if (status.contains("recording") && status["recording"]["state"] == "writing") {
      named.insert(status["recording"]["file"].get<std::string>());
      EXPECT_GT(status["recording"]["bytes"], 0);
    }
    return named.size() >= 3;
  })) << daemon.err();
  EXPECT_EQ(run_program({"ctl", "--endpoint", control, "record", "stop"}).exit_code, 0);
  EXPECT_TRUE(hear(subscriber, [](const Message& message) {
    return message.json.find("\"recording\"") == std::string::npos;
  }));
  EXPECT_EQ(run_program({"ctl", "--endpoint", control, "record", "start"}).exit_code, 0);
  EXPECT_TRUE(hear(subscriber, [&](const Message& message) {
    const auto status = json_value(message.json);
    return status.contains("recording") && status["recording"]["state"] == "writing" &&
           named.insert(status["recording"]["file"].get<std::string>()).second;
  }));
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait().exit_code, 0);
  const std::vector<std::string> files = recordings_in(folder.path("kept"));
  for (const std::string& file : named) EXPECT_THAT(files, ::testing::Contains(file));
}

// The daemon's last frame was there when it was killed: what the files lack of it is what was lost.
// Half a second at most, in one file and in files of a second each.
TEST_F(RecordingProgram, AKilledDaemonLosesHalfASecondAtMost) {
  const test::Yardstick yardstick;
  std::mt19937 random(7);
  double most_lost_ms = 0;
  for (int round = 0; round < 4; ++round) {
    std::filesystem::remove_all(folder.path("kept"));
    const std::string file =
        config(round % 2 == 0 ? R"("folder":"kept")" : R"("folder":"kept","max_file_s":1)",
               R"(,"sync":{"missing_fraction":0.95})");
    Program daemon({"run", "--config", file});
    sockets::Subscriber subscriber(endpoint, {""});
    const auto wanted_ps =
        static_cast<std::int64_t>(std::uniform_real_distribution<double>(0.7, 2.4)(random) * 1e12);
    std::int64_t seen_ps = 0;
    ASSERT_TRUE(hear(subscriber, [&](const Message& message) {
      if (message.topic == topic_frame) seen_ps = frame_from_json(message.json).start_ps;
      return seen_ps >= wanted_ps;
    })) << daemon.err();
    daemon.signal(SIGKILL);
    (void)daemon.wait();
    const std::vector<std::string> files = recordings_in(folder.path("kept"));
    ASSERT_FALSE(files.empty());
    std::int64_t before_ps = 0;
    for (const std::string& recording : files) {
      EXPECT_EQ(run_program({"check", recording}).exit_code, 0);
      const std::vector<Tag> tags = read_back(recording);
      if (tags.empty()) continue;  // just begun
      EXPECT_LT(tags.front().time_ps - before_ps, 1'000'000'000);
      before_ps = tags.back().time_ps;
    }
    const std::int64_t end_ps = seen_ps + 50'000'000'000;
    most_lost_ms = std::max(most_lost_ms, static_cast<double>(end_ps - before_ps) / 1e9);
  }
  EXPECT_TRUE(yardstick.keeps(500, most_lost_ms));
  splid::test::record({"daemon is killed (kill -9) while it records, four times",
                       "all files can be read", -1,
                       splid::test::in_ms(most_lost_ms) + " of the stream at most", -1});
}

// As fast as the scene can be made, so that a kill may come between any two writes: whoever
// believes the header gets what is there, but for what is handed over at once (1 MiB, or 0.4 s).
TEST_F(RecordingProgram, AKilledRecordingCountsItsRecordsForReadersThatBelieveIt) {
  constexpr std::uint64_t at_once = 2 * (1U << 20U) / 4;
  std::mt19937 random(11);
  std::uniform_int_distribution<int> instant_ms(0, 300);
  const std::string file =
      config(R"("folder":"kept","max_file_mib":2)", R"(,"pace":"max","signal_per_pulse":0.5)", "");
  for (const bool is_rotated : {false, true}) {
    for (int round = 0; round < killed_rounds(); ++round) {
      std::filesystem::remove_all(folder.path("kept"));
      std::filesystem::create_directory(folder.path("kept"));
      Program recorder(is_rotated ? std::vector<std::string>{"run", "--config", file}
                                  : std::vector<std::string>{"record", "--config", file, "--output",
                                                             folder.path("kept/a.ptu")});
      std::vector<std::string> files;
      const auto until = std::chrono::steady_clock::now() + std::chrono::seconds{60};
      while (files.empty() || (files.size() < 2 && test::counted_in_header(files[0]) == 0)) {
        ASSERT_LT(std::chrono::steady_clock::now(), until) << recorder.err();
        std::this_thread::sleep_for(milliseconds{5});
        files = recordings_in(folder.path("kept"));
      }
      std::this_thread::sleep_for(milliseconds{instant_ms(random)});
      recorder.signal(SIGKILL);
      (void)recorder.wait();
      files = recordings_in(folder.path("kept"));
      for (const std::string& recording : files) {
        const auto strict = read_strictly(recording);
        ASSERT_TRUE(strict.readable) << strict.counted << " of " << strict.held;
        EXPECT_LE(strict.held - strict.counted, recording == files.back() ? at_once : 0);
        // splid's reader agrees, but reads all that is there where no count was written yet.
        const std::size_t read = read_back(recording).size();
        if (strict.counted > 0) {
          EXPECT_EQ(read, strict.counted - strict.overflows);
        } else {
          EXPECT_LE(read, strict.held);
        }
      }
      EXPECT_GT(read_strictly(files.front()).photons, 0u);
    }
  }
}

TEST_F(RecordingProgram, FramesGoOnWhenTheDiskIsFullAndItRecordsAgainWhenThereIsRoom) {
  const SmallDisk disk(16);
  if (!disk.mounted()) GTEST_SKIP() << "takes root, to mount a small disk";
  disk.fill_but(1 << 20);
  Program daemon({"run", "--config", config("\"folder\":\"" + disk.path("kept") + "\"")});
  sockets::Subscriber subscriber(endpoint, {""});
  const auto full = [](const Message& message) {
    return message.topic == topic_status &&
           message.json.find("nothing is recorded: ") != std::string::npos &&
           message.json.find("\"degraded\"") != std::string::npos;
  };
  ASSERT_TRUE(hear(subscriber, full)) << daemon.err();
  int frames = 0;
  EXPECT_TRUE(hear(subscriber, [&](const Message& message) {
    if (message.topic == topic_frame) frames += frame_from_json(message.json).valid() ? 1 : 0;
    return frames >= 10;
  }));
  EXPECT_TRUE(hear(subscriber, full));
  disk.clear();
  EXPECT_TRUE(hear(subscriber, [](const Message& message) {
    return message.json.find("recording again, into ") != std::string::npos;
  }));
  // Whatever else it says: where a sanitizer makes the daemon slow, its effort is lowered.
  EXPECT_TRUE(hear(subscriber, [](const Message& message) {
    return message.topic == topic_status &&
           message.json.find("nothing is recorded") == std::string::npos;
  }));
  daemon.signal(SIGTERM);
  const ProgramResult result = daemon.wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("2 recordings; "));
  const std::vector<std::string> files = recordings_in(disk.path("kept"));
  ASSERT_EQ(files.size(), 2u);
  EXPECT_FALSE(scan_recording(files[1]).header.losses.empty());
  EXPECT_GT(read_back(files[1]).front().time_ps, read_back(files[0]).back().time_ps);
}

}  // namespace
}  // namespace splid::recording
