#include "daemon/service/control_actions.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "protocol/pattern_json.hpp"
#include "tests/support/awg_double.hpp"
#include "tests/support/control_scene.hpp"
#include "tests/support/read_back.hpp"

// What the built program does when it is asked: record, upload, calibrate.

namespace splid {
namespace {

using test::AwgDouble;
using test::AwgFaults;
using test::eventually;
using test::Program;
using test::ProgramResult;
using test::recordings_in;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Asked : public test::ControlScene {
 protected:
  // Recordings that a calibration takes lie there.
  Asked() {
    std::filesystem::create_directory(scratch);
    ::setenv("TMPDIR", scratch.c_str(), 1);
  }
  ~Asked() override { ::unsetenv("TMPDIR"); }

  [[nodiscard]] int left_in_scratch() const {
    int left = 0;
    for (const auto& entry : std::filesystem::directory_iterator(scratch)) {
      left += entry.path().filename().string().starts_with("splid-calibrate-") ? 1 : 0;
    }
    return left;
  }

  std::string scratch = folder.path("scratch");
};

constexpr const char* config_at_rest =
    R"("driver":"simulator","signal_per_pulse":0.03,"target":{"motion":"linear",)"
    R"("distance_m":30,"velocity_mps":0})";

TEST_F(Asked, RecordsWhenItIsAskedAndNotBefore) {
  run(configure(test::light_source, R"(,"record":{"folder":"kept","when":"asked"})"));
  const test::FrameWatch watch(frames);
  ASSERT_TRUE(eventually([&] { return watch.frames() > 0; }));
  EXPECT_THAT(ctl({"record", "stop"}).err, HasSubstr("it records nothing"));
  EXPECT_THAT(recordings_in(folder.path("kept")), IsEmpty());
  for (std::size_t round = 1; round <= 3; ++round) {
    const ProgramResult started = ctl({"record", "start", "--json"});
    EXPECT_EQ(started.exit_code, 0) << started.err;
    const std::vector<std::string> files = recordings_in(folder.path("kept"));
    ASSERT_EQ(files.size(), round);
    EXPECT_THAT(started.out, HasSubstr("\"file\":\"" + files.back() + '"'));
    EXPECT_THAT(ctl({"record", "start"}).err, HasSubstr("already, into " + files.back()));
    EXPECT_THAT(status(), HasSubstr(R"("recording":true,"file":")"));
    const int before = watch.frames();
    ASSERT_TRUE(eventually([&] { return watch.frames() > before + 4; }));
    EXPECT_THAT(ctl({"record", "stop"}).err, HasSubstr("the last file is " + files.back()));
    EXPECT_THAT(status(), HasSubstr(R"("recording":false)"));
    // Whole, and not growing any more.
    EXPECT_GT(test::read_back(files.back()).size(), 10'000u);
    EXPECT_THAT(test::run_program({"check", files.back()}).out, Not(HasSubstr("not closed")));
  }
  EXPECT_EQ(watch.missing(), 0);
  end();
  EXPECT_EQ(recordings_in(folder.path("kept")).size(), 3u);
}

TEST_F(Asked, ARecordingGoesOnWhereMeasuringDoes) {
  run(configure(test::light_source, R"(,"record":{"folder":"kept"})"));
  EXPECT_THAT(status(), HasSubstr(R"("recording":true)"));
  EXPECT_EQ(ctl({"stop"}).exit_code, 0);
  EXPECT_EQ(recordings_in(folder.path("kept")).size(), 1u);
  EXPECT_EQ(ctl({"start"}).exit_code, 0);
  EXPECT_TRUE(eventually([this] { return recordings_in(folder.path("kept")).size() == 2; }));
  EXPECT_EQ(ctl({"stop"}).exit_code, 0);
  // Asked for while nothing is measured, it holds for what will be.
  EXPECT_THAT(ctl({"record", "stop"}).err, HasSubstr("recorded; the last file is "));
  EXPECT_EQ(ctl({"start"}).exit_code, 0);
  EXPECT_TRUE(eventually([this] { return measures(); }));
  EXPECT_EQ(recordings_in(folder.path("kept")).size(), 2u);
  end();
}

TEST_F(Asked, UploadsItsPatternWhileItMeasures) {
  AwgDouble awg;
  run(configure(test::light_source, R"(,"awg":{"address":")" + awg.address() + "\"}"));
  const test::FrameWatch watch(frames);
  const std::string output = folder.path("played.json");
  const ProgramResult result = ctl({"upload", "--output", output});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("plays interleaved, 40 pulses in 3780 ns"));
  EXPECT_TRUE(awg.playing());
  EXPECT_EQ(pattern_from_json(test::file_text(output), output).mode, Mode::interleaved);
  const ProgramResult again = ctl({"upload", "--output", output});
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("exists; --force overwrites it"));
  EXPECT_EQ(ctl({"upload", "--output", folder.path("absent/p.json")}).exit_code, 3);
  EXPECT_EQ(watch.missing(), 0);
  end();
}

TEST_F(Asked, IsBusyMeanwhileAndEndsAllTheSame) {
  AwgFaults faults;
  faults.silent_at = ":TRAC1:DATA";
  AwgDouble awg(AwgDouble::Model::m8195a, faults);
  run(configure(test::light_source,
                R"(,"awg":{"timeout_s":60,"address":")" + awg.address() + "\"}"));
  Program uploading({"ctl", "--endpoint", endpoint, "upload"});
  ASSERT_TRUE(eventually(
      [this] { return status().find(R"("doing":"upload","progress":")") != std::string::npos; }));
  const ProgramResult refused = ctl({"stop"});
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("busy: upload is running"));
  EXPECT_THAT(ctl({"status"}).out, HasSubstr("doing       upload"));
  end();
  const ProgramResult result = uploading.wait();
  EXPECT_NE(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr("stopped"));
}

TEST_F(Asked, CalibratesFromItsSourceAndMeasuresOn) {
  run(configure(config_at_rest));
  const test::FrameWatch watch(frames);
  ASSERT_TRUE(eventually([&] { return watch.frames() > 0; }));
  const std::string output = folder.path("found.json");
  const ProgramResult result =
      ctl({"calibrate", "--seconds", "1", "--distance-m", "30", "--output", output});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("pulse         time ps       +-  amplitude       +-"));
  EXPECT_THAT(result.err, AllOf(HasSubstr(output + ": interleaved, 40 pulses"),
                                HasSubstr("\"file\":\"" + output)));
  const Pattern found = pattern_from_json(test::file_text(output), output);
  ASSERT_TRUE(found.calibration);
  EXPECT_EQ(found.calibration->distance_m, 30);
  EXPECT_EQ(found.segments[0].pulse_times_ps.size(), 40u);
  const int before = watch.frames();
  EXPECT_TRUE(eventually([&] { return watch.frames() > before + 2; }));
  EXPECT_EQ(watch.missing(), 0);

  const ProgramResult refused = ctl(
      {"calibrate", "--seconds", "0.2", "--time-ps", "0.01", "--output", folder.path("none.json")});
  EXPECT_EQ(refused.exit_code, 4);
  EXPECT_THAT(refused.err, HasSubstr("0.2 s of simulator: too few photons"));
  EXPECT_FALSE(std::filesystem::exists(folder.path("none.json")));
  EXPECT_TRUE(eventually([this] { return measures(); }));
  // One that was stopped stays so.
  EXPECT_EQ(ctl({"stop"}).exit_code, 0);
  EXPECT_EQ(ctl({"calibrate", "--seconds", "0.5", "--output", output, "--force"}).exit_code, 0);
  EXPECT_THAT(status(), HasSubstr("stopped by control"));
  EXPECT_EQ(left_in_scratch(), 0);
  end();
}

// Whatever it is that an action throws.
TEST_F(Asked, MeasuresOnWhereCalibratingCannotBegin) {
  run(configure());
  std::filesystem::remove_all(scratch);
  (void)folder.write("scratch", "a file where the daemon's TMPDIR was");
  ::setenv("TMPDIR", folder.path("").c_str(), 1);
  const ProgramResult result =
      ctl({"calibrate", "--seconds", "1", "--output", folder.path("pattern.json")});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, AllOf(HasSubstr("scratch, the daemon's TMPDIR: Not a directory"),
                                HasSubstr("set it to a folder")));
  EXPECT_TRUE(eventually([this] { return measures(); })) << status();
}

TEST_F(Asked, CalibratingEndsWithTheDaemonAndGoesOnWithoutTheClient) {
  run(configure(config_at_rest));
  Program waiting({"ctl", "--endpoint", endpoint, "calibrate", "--seconds", "600", "--output",
                   folder.path("found.json")});
  const auto taken = [this] { return status().find("s taken") != std::string::npos; };
  ASSERT_TRUE(eventually(taken));
  waiting.signal(SIGINT);
  const ProgramResult stopped = waiting.wait();
  EXPECT_EQ(stopped.exit_code, 2);
  EXPECT_THAT(stopped.err, HasSubstr("calibrate, which goes on in the daemon"));
  EXPECT_TRUE(taken());
  end();
  EXPECT_FALSE(std::filesystem::exists(folder.path("found.json")));
  EXPECT_EQ(left_in_scratch(), 0);
}

}  // namespace
}  // namespace splid
