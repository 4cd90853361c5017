#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "protocol/frame_json.hpp"
#include "protocol/ptu_encode.hpp"
#include "protocol/ptu_header.hpp"
#include "tests/support/json_frames.hpp"
#include "tests/support/light_scene.hpp"
#include "tests/support/program.hpp"
#include "tests/support/python_program.hpp"
#include "tests/support/read_back.hpp"
#include "tests/support/real_recording.hpp"
#include "tests/support/temp_folder.hpp"

// Scans through the built program: a real one, and a scene with the markers of a scanner.

namespace splid {
namespace {

using test::ProgramResult;
using test::run_program;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::int64_t ms = 1'000'000'000;

// Three lines of four dwells of 20 ms, from marker 1 to marker 2, and a fourth without an end; a
// tick on marker 8 every 4 ms.
class ScanProgram : public ::testing::Test {
 protected:
  ScanProgram() {
    const std::string scene = config("scene.json", "");
    const std::string t2 = folder.path("t2.ptu");
    const auto made =
        run_program({"simulate", "--config", scene, "--seconds", "0.4", "--output", t2});
    EXPECT_EQ(made.exit_code, 0) << made.err;
    tags = test::read_back(t2);
    for (int line = 0; line < 4; ++line) {
      tags.push_back(marker_tag((10 + 90 * line) * ms, 1));
      if (line < 3) tags.push_back(marker_tag((90 + 90 * line) * ms, 2));
    }
    for (int tick = 1; tick < 100; ++tick) tags.push_back(marker_tag(4 * tick * ms, 8));
    std::stable_sort(tags.begin(), tags.end(),
                     [](const Tag& a, const Tag& b) { return a.time_ps < b.time_ps; });
  }

  [[nodiscard]] std::string config(const std::string& name, const std::string& more) const {
    return folder.write(
        name, R"({"schema":"splid.config","v":[1,0],"source":{)" + std::string(test::light_source) +
                  R"(,"pace":"max","encoder_rate_hz":0,"target":{"motion":)"
                  R"("linear","distance_m":20,"velocity_mps":2}},)"
                  R"("channels":{"encoder":"marker:8"},"pattern":{"file":")" SPLID_SOURCE_DIR
                  R"(/config/patterns/interleaved-180-189.json"})" +
                  test::with_light_scene(std::string(test::small_ring) + more) + "}");
  }
  // The tags as a recording whose header tells of the scan.
  [[nodiscard]] std::string recording(const std::optional<ScanLines>& scan) const {
    PtuEncoder encoder(0);
    std::vector<std::byte> records;
    encoder.encode(tags, records);
    encoder.flush(records);
    PtuFacts facts;
    facts.record_count = encoder.records();
    facts.inputs = encoder.inputs();
    facts.scan = scan;
    std::vector<std::byte> bytes = make_ptu_header(facts);
    bytes.insert(bytes.end(), records.begin(), records.end());
    return folder.write("scan.ptu", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }

  test::TempFolder folder;
  std::vector<Tag> tags;
};

TEST_F(ScanProgram, ARecordingTellsItsLinesAndEachDwellHasItsDirection) {
  const std::string scan = config("scan.json", R"(,"frame":{"length_ms":20},"scan":{"lines":3,)"
                                               R"("azimuth_deg":[-3,3],"elevation_deg":[2,-2]})");
  const std::string file = recording(ScanLines{1, 2, 4, 0, 0, true, 0});
  EXPECT_THAT(run_program({"check", file}).out,
              HasSubstr(R"(frame.by "line:1:2:4", as the header)"));
  const auto result = run_program({"replay", file, "--config", scan, "--no-publish", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("outside the scan's dwells"));
  EXPECT_THAT(result.err, Not(HasSubstr("warning"))) << "it ends in the middle of a line";
  const auto frames = test::frames_in(result.out);
  ASSERT_EQ(frames.size(), 12U);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const FrameMessage& frame = frames[i];
    const std::size_t line = i / 4, column = line == 1 ? 3 - i % 4 : i % 4;
    ASSERT_TRUE(frame.scan);
    EXPECT_EQ(frame.scan->line, line);
    EXPECT_EQ(frame.scan->column, column);
    EXPECT_DOUBLE_EQ(*frame.scan->azimuth_deg, 2.0 * static_cast<double>(column) - 3);
    EXPECT_DOUBLE_EQ(*frame.scan->elevation_deg, 2 - 2.0 * static_cast<double>(line));
    EXPECT_EQ(frame.start_ps, static_cast<std::int64_t>(10 + 90 * line + 20 * (i % 4)) * ms);
    EXPECT_EQ(frame.duration_ms, 20);
    ASSERT_EQ(frame.status, FrameStatus::ok) << i;
    const double mid_s = static_cast<double>(frame.start_ps) * 1e-12 + 0.01;
    EXPECT_NEAR(*frame.distance_m, 20 + 2 * mid_s, 6 * *frame.std_distance_m) << i;
    EXPECT_NEAR(*frame.velocity_mps, 2, 6 * *frame.std_velocity_mps) << i;
  }
  const auto by_time = config("time.json", R"(,"frame":{"by":"time"})");
  const auto timed = test::frames_in(
      run_program({"replay", file, "--config", by_time, "--no-publish", "--json"}).out);
  ASSERT_FALSE(timed.empty());
  EXPECT_FALSE(timed[0].scan) << "the configuration goes before the recording";
}

TEST_F(ScanProgram, AnglesOfTheScannerMakeACloud) {
  std::string angles = "azimuth_deg,elevation_deg\n";
  for (int tick = 1; tick < 60; ++tick) {
    angles += std::to_string(0.25 * tick) + "," + std::to_string(-0.125 * tick) + "\n";
  }
  const std::string scan =
      config("scan.json", R"(,"frame":{"by":"line:1:2:4","length_ms":20},"scan":{"angles":")" +
                              folder.write("angles.csv", angles) + "\"}");
  const std::string file = recording(std::nullopt);
  const auto lines = test::frames_in(
      run_program({"replay", file, "--config", scan, "--no-publish", "--json"}).out);
  ASSERT_EQ(lines.size(), 12U);
  EXPECT_NEAR(*lines[0].scan->azimuth_deg, 1.25, 1e-9) << "at 20 ms, tick 4";
  EXPECT_NEAR(*lines[5].scan->elevation_deg, -0.125 * 130 / 4, 1e-9) << "between two ticks";
  const std::string output = folder.path("a.xyzd");
  const auto made = run_program({"cloud", file, "--config", scan, "--output", output});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.err, HasSubstr("10 points of 12 frames"));
  EXPECT_THAT(made.err, HasSubstr("2 frames have no direction: /scan/angles has no row"));
}

TEST_F(ScanProgram, ACloudWithoutDirectionsIsRefused) {
  const std::string file = recording(ScanLines{1, 2, 4});
  const auto cloud = [&](const std::string& more) {
    return run_program(
        {"cloud", file, "--config", config("c.json", more), "--output", folder.path("a.ply")});
  };
  const auto named = cloud(R"(,"frame":{"by":"line:1:2:4"})");
  EXPECT_EQ(named.exit_code, 2);
  EXPECT_THAT(named.err, HasSubstr("/scan: a cloud of a scan needs the directions of its dwells"));
  const auto told = cloud("");
  EXPECT_EQ(told.exit_code, 2);
  EXPECT_THAT(told.err, HasSubstr("set the angles of /scan for a scan"));
}

TEST_F(ScanProgram, MarkersThatDoNotComeEndTheReplay) {
  const std::string file = recording(std::nullopt);
  const auto replay = [&](const std::string& by) {
    const std::string named = config("c.json", R"(,"frame":{"by":")" + by + "\"}");
    return run_program({"replay", file, "--config", named, "--no-publish"});
  };
  const ProgramResult no_start = replay("line:4:2:4");
  EXPECT_EQ(no_start.exit_code, 4);
  EXPECT_THAT(no_start.err, HasSubstr("no line of the scan has begun"));
  const ProgramResult no_stop = replay("line:1:4:4");
  EXPECT_EQ(no_stop.exit_code, 4);
  EXPECT_THAT(no_stop.err, HasSubstr("4 of 4 lines of the scan have no end"));
}

TEST_F(ScanProgram, AFirstPictureThatIsNotWholeIsAWarning) {
  const std::string scan =
      config("scan.json", R"(,"frame":{"length_ms":20},"scan":{"lines":3,"picture":"marker:4"})");
  tags.push_back({95 * ms, 4, TagKind::marker, {}});  // before the second line
  std::stable_sort(tags.begin(), tags.end(),
                   [](const Tag& a, const Tag& b) { return a.time_ps < b.time_ps; });
  const std::string file = recording(ScanLines{1, 2, 4, 0, 0, false, 0});
  const auto result = run_program({"replay", file, "--config", scan, "--no-publish", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("picture 0 of the scan began before the first tag: it has 1 "));
  const auto frames = test::frames_in(result.out);
  ASSERT_EQ(frames.size(), 12U);
  EXPECT_EQ(frames[4].scan->picture, 1);
  EXPECT_EQ(frames[4].scan->line, 0);
}

TEST(RealScan, HasThePictureOfAnotherReader) {
  const std::string file = test::real_recording_path("scan_t3.ptu").string();
  if (!std::filesystem::exists(file)) {
    GTEST_SKIP() << file << " is not there; SPLID_DATA names the folder of the recordings";
  }
  const test::TempFolder folder;
  folder.write("pattern.json",
               R"({"schema":"splid.pattern","v":[1,0],"mode":"baseline","unambiguous_delay_ps":)"
               R"(12817.22635221738,"segments":[{"period_ps":12817.22635221738,)"
               R"("pulse_times_ps":[0],"amplitudes":[1],"repeats":0}]})");
  const std::string config = folder.write(
      "scan.json", R"({"schema":"splid.config","v":[1,0],"source":{"driver":"replay",)"
                   R"("recording":"scan.ptu"},"channels":{"encoder":""},"pattern":{"file":)"
                   R"("pattern.json"},"frame":{"length_ms":0.1},"scene":{"motion":"static"},)"
                   R"("estimator":{"effort":"fast"}})");
  const std::string table = folder.path("frames.csv");
  const auto made =
      run_program({"replay", file, "--config", config, "--no-publish", "--output", table});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const ProgramResult compared =
      test::python("tests/support/python/scan_picture.py", {file, table}).wait();
  EXPECT_EQ(compared.out,
            R"({"photons": 722402, "in_lines": 722402, "shape": [256, 256], "frames": 65536, )"
            R"("brightest": 84, "different": 0})"
            "\n")
      << compared.err;
}

}  // namespace
}  // namespace splid
