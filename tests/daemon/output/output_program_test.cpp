#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/light_scene.hpp"
#include "tests/support/program.hpp"
#include "tests/support/small_disk.hpp"
#include "tests/support/strict_ptu.hpp"

// What the built program writes where it was told to: never over what it reads from.

namespace splid {
namespace {

using test::file_text;
using test::ProgramResult;
using test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
namespace fs = std::filesystem;

class Outputs : public ::testing::Test {
 protected:
  Outputs() {
    fs::copy(SPLID_SOURCE_DIR "/config/patterns/interleaved-180-189.json", pattern);
    scene = write("scene.json", R"("driver":"simulator","pace":"max","seconds":0.1)");
    run_program({"record", "--config", scene, "--output", recording});
    player = write("player.json", R"("driver":"replay","recording":"a.ptu","speed":0)");
  }

  std::string write(const std::string& name, const std::string& source) const {
    return folder.write(name, R"({"schema":"splid.config","v":[1,0],"source":{)" + source +
                                  R"(},"pattern":{"file":"p.json"},"publish":{"endpoint":"ipc://)" +
                                  folder.path("socket") + "\"}" + test::small_ring + "}");
  }

  // With these arguments each of the files would be destroyed, by any of its names.
  void expect_refused(std::vector<std::string> arguments, const std::string& option,
                      const std::string& file) const {
    const std::string before = file_text(file);
    const std::string link = folder.path("link");
    const std::string hard = folder.path("hard");
    fs::create_symlink(file, link);
    fs::create_hard_link(file, hard);
    const std::string dotted = folder.path("") + "./" + fs::path(file).filename().string();
    for (const std::string& name : {file, link, hard, dotted}) {
      std::vector<std::string> all = arguments;
      all.insert(all.end(), {option, name});
      const ProgramResult result = run_program(all);
      EXPECT_EQ(result.exit_code, 2) << all[0] << " " << name << ": " << result.err;
      EXPECT_THAT(result.err, AllOf(HasSubstr(option), HasSubstr("would destroy it")));
      EXPECT_EQ(file_text(file), before) << all[0] << " " << name;
    }
    fs::remove(link);
    fs::remove(hard);
  }

  test::TempFolder folder;
  std::string pattern = folder.path("p.json");
  std::string recording = folder.path("a.ptu");
  std::string scene;
  std::string player;
};

TEST_F(Outputs, OfRecordAreNoneOfItsInputs) {
  for (const std::string& file : {recording, player, pattern}) {
    expect_refused({"record", "--config", player, "--force"}, "--output", file);
  }
  const std::string copy = folder.path("b.ptu");
  EXPECT_EQ(run_program({"record", "--config", player, "--output", copy}).exit_code, 0);
  EXPECT_EQ(run_program({"record", "--config", player, "--output", copy, "--force"}).exit_code, 0);
  EXPECT_EQ(test::read_strictly(copy).syncs, test::read_strictly(recording).syncs);
}

TEST_F(Outputs, OfSimulateAreNoneOfItsInputsNorIsItsTruth) {
  for (const std::string& file : {scene, pattern}) {
    expect_refused({"simulate", "--config", scene, "--seconds", "0.1", "--force"}, "--output",
                   file);
  }
  const std::string named_so = folder.path("c.truth.json");
  fs::copy(scene, named_so);
  const std::vector<std::string> simulate{
      "simulate", "--config", named_so, "--seconds", "0.1", "--output", folder.path("c.ptu")};
  EXPECT_EQ(run_program(simulate).exit_code, 2);
  EXPECT_EQ(file_text(named_so), file_text(scene));
  // A truth of another scene is kept as a recording is.
  (void)folder.write("d.truth.json", "precious");
  const ProgramResult kept = run_program(
      {"simulate", "--config", scene, "--seconds", "0.1", "--output", folder.path("d.ptu")});
  EXPECT_EQ(kept.exit_code, 2);
  EXPECT_THAT(kept.err, AllOf(HasSubstr("d.truth.json"), HasSubstr("--force")));
  EXPECT_EQ(file_text(folder.path("d.truth.json")), "precious");
}

TEST_F(Outputs, OfAnEncoderAreKeptAsRecordingsAre) {
  const std::string counted =
      write("counted.json", R"("driver":"simulator","pace":"max","seconds":0.5,)"
                            R"("encoder_rate_hz":1000)");
  const std::string counts = folder.write("e.ptu.encoder.csv", "precious");
  const std::vector<std::string> record{"record", "--config", counted, "--output",
                                        folder.path("e.ptu")};
  const ProgramResult kept = run_program(record);
  EXPECT_EQ(kept.exit_code, 2);
  EXPECT_THAT(kept.err, AllOf(HasSubstr(counts), HasSubstr("--force")));
  EXPECT_EQ(file_text(counts), "precious");
}

TEST_F(Outputs, OfCalibrateTradeoffAndUploadAreNoneOfTheirInputs) {
  const std::vector<std::string> calibrate{"calibrate", recording, "--config", player, "--force"};
  expect_refused(calibrate, "--output", recording);
  expect_refused(calibrate, "--output", player);
  std::vector<std::string> plotted = calibrate;
  plotted.insert(plotted.end(), {"--output", folder.path("found.json")});
  expect_refused(plotted, "--csv", recording);
  expect_refused(plotted, "--plot", recording);
  expect_refused(plotted, "--plot", pattern);
  for (const std::string option : {"--csv", "--plot"}) {
    for (const std::string& file : {recording, player, pattern}) {
      expect_refused({"tradeoff", recording, "--config", player}, option, file);
    }
  }
  expect_refused({"upload", "--config", player, "--dry-run", "--force"}, "--output", player);
}

TEST_F(Outputs, OfPatternReplacePatternsAlone) {
  const std::vector<std::string> made{"pattern", "periodic", "--output"};
  for (const std::string& file : {recording, scene}) {
    const std::string before = file_text(file);
    std::vector<std::string> all = made;
    all.push_back(file);
    const ProgramResult result = run_program(all);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("is not a pattern"));
    EXPECT_EQ(file_text(file), before);
  }
  std::vector<std::string> all = made;
  all.push_back(pattern);
  EXPECT_EQ(run_program(all).exit_code, 0);
  EXPECT_THAT(run_program({"check", pattern}).out, HasSubstr("baseline"));
  all.back() = "/dev/stdout";
  EXPECT_THAT(run_program(all).out, HasSubstr("splid.pattern"));
}

TEST_F(Outputs, OnAFullDiskLeaveTheFileThatWasThere) {
  const test::SmallDisk disk(4);
  if (!disk.mounted()) GTEST_SKIP() << "takes root, to mount a small disk";
  const std::string kept = disk.path("p.json");
  fs::copy(pattern, kept);
  const std::string before = file_text(kept);
  disk.fill_but(0);
  const ProgramResult result =
      run_program({"pattern", "random", "--pulses", "300", "--output", kept});
  EXPECT_EQ(result.exit_code, 3) << result.err;
  EXPECT_THAT(result.err, HasSubstr("it stays as it was"));
  EXPECT_EQ(file_text(kept), before);
  EXPECT_EQ(run_program({"record", "--config", scene, "--output", kept, "--force"}).exit_code, 3);
  EXPECT_EQ(file_text(kept), before);
}

TEST_F(Outputs, OnAFullDiskLeaveNothingNew) {
  const test::SmallDisk disk(4);
  if (!disk.mounted()) GTEST_SKIP() << "takes root, to mount a small disk";
  disk.fill_but(0);
  const std::string made = disk.path("p.json");
  EXPECT_EQ(run_program({"pattern", "random", "--pulses", "300", "--output", made}).exit_code, 3);
  EXPECT_FALSE(fs::exists(made));
  const std::string recorded = disk.path("a.ptu");
  const ProgramResult result = run_program({"record", "--config", scene, "--output", recorded});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, AllOf(HasSubstr("within the recording's header"),
                                Not(HasSubstr("these can be read"))));
  EXPECT_FALSE(fs::exists(recorded));
}

// One seed gives one file, byte for byte, with a date that no reader takes for a broken clock.
TEST_F(Outputs, OfASceneHaveADateThatRepeatsItself) {
  const std::string again = folder.path("b.ptu");
  run_program({"record", "--config", scene, "--output", again});
  EXPECT_EQ(file_text(recording), file_text(again));
  constexpr double days_of_2026_01_01 = 46'023;
  EXPECT_NEAR(test::read_strictly(again).created_days, days_of_2026_01_01, 1);
}

}  // namespace
}  // namespace splid
