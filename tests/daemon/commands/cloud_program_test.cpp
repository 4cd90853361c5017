#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "protocol/truth.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/known_truth.hpp"
#include "tests/support/las_reader.hpp"
#include "tests/support/program.hpp"

// What `splid cloud` makes of 3 x 3 pixels, 5 degrees apart: a plate that moves in the middle, a
// wall behind it, and nothing in the three pixels to the left.

namespace splid {
namespace {

using test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::size_t side = 3;
constexpr double pitch_deg = 5;

std::string pixel_list(bool with_directions) {
  std::string list;
  for (std::size_t input = 1; input <= side * side; ++input) {
    const auto column = static_cast<double>((input - 1) % side);
    const auto row = static_cast<double>((input - 1) / side);
    list += (input == 1 ? "" : ",") + std::string(R"({"input":)") + std::to_string(input);
    if (with_directions) {
      list += R"(,"azimuth_deg":)" + std::to_string(pitch_deg * (column - 1)) +
              R"(,"elevation_deg":)" + std::to_string(pitch_deg * (1 - row));
    }
    list += "}";
  }
  return R"(,"pixels":[)" + list + "]";
}

class CloudProgram : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder = new test::TempFolder;
    const std::string config = config_of("s.json", pixel_list(true));
    const auto made =
        run_program({"simulate", "--config", config, "--seconds", "0.22", "--output", recording()});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  static void TearDownTestSuite() {
    delete folder;
    folder = nullptr;
  }

  static std::string config_of(const std::string& name, const std::string& pixels) {
    return folder->write(
        name,
        R"({"schema":"splid.config","v":[1,0],"source":{"driver":"simulator","pace":"max","array":)"
        R"({"columns":3,"rows":3,"pitch_deg":5,"planes":[)"
        R"({"motion":"linear","distance_m":20,"velocity_mps":1.2,"azimuth_deg":[-2,2],)"
        R"("elevation_deg":[-2,2]},)"
        R"({"motion":"linear","distance_m":25,"velocity_mps":-30,"azimuth_deg":[-2,8]}]}},)"
        R"("pattern":{"file":")" SPLID_SOURCE_DIR R"(/config/patterns/interleaved-180-189.json"})" +
            std::string(test::small_ring) + pixels + "}");
  }
  static std::string recording() { return folder->path("a.ptu"); }

  // Makes the cloud of this name; returns the messages on standard error.
  static std::string make(const std::string& name, const std::vector<std::string>& options = {}) {
    std::vector<std::string> arguments{
        "cloud", recording(), "--config", folder->path("s.json"), "--output", folder->path(name)};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const auto made = run_program(arguments);
    EXPECT_EQ(made.exit_code, 0) << made.err;
    EXPECT_EQ(made.out, "");
    return made.err;
  }

  static test::TempFolder* folder;
};

test::TempFolder* CloudProgram::folder = nullptr;

TEST_F(CloudProgram, EachPointIsWhereItsPixelLooksWithItsVelocity) {
  const std::string said = make("a.las");
  EXPECT_THAT(said, HasSubstr("24 points of 45 frames; left out: 12 no_target, 9 incomplete"));
  const SceneTruth truth = truth_from_json(test::file_text(folder->path("a.truth.json")));
  const test::LasReader las(test::file_text(folder->path("a.las")));
  ASSERT_EQ(las.points.size(), 24U);
  test::Pulls distances, velocities;
  std::map<double, double> last_time;
  for (const auto& point : las.points) {
    const double number = point.extra.at("pixel");
    const SceneTruth::Pixel& pixel = truth.pixels.at(static_cast<std::size_t>(number));
    const double distance_m = std::hypot(point.place[0], point.place[1], point.place[2]);
    const double degree = std::numbers::pi / 180;
    EXPECT_NEAR(std::asin(point.place[2] / distance_m), pixel.elevation_deg * degree, 1e-5);
    EXPECT_NEAR(std::atan2(-point.place[1], point.place[0]), pixel.azimuth_deg * degree, 1e-5);
    // The frames follow each other, and the first begins with the recording.
    double& before = last_time[number];
    if (before > 0) {
      EXPECT_NEAR(point.gps_time - before, 0.05, 1e-4);
    }
    before = point.gps_time;
    const double in_stream_s = point.gps_time - las.points.front().gps_time + 0.025;
    const auto there = truth.at(truth.start_ps + std::llround(in_stream_s * 1e12), pixel).value();
    distances.add(distance_m, there.distance_m, point.extra.at("std_distance"));
    velocities.add(point.extra.at("radial_velocity"), there.velocity_mps,
                   point.extra.at("std_radial_velocity"));
  }
  distances.expect_right("distance");
  velocities.expect_right("velocity");
}

TEST_F(CloudProgram, AllFormatsHaveTheSamePoints) {
  make("a.las", {"--force"});
  make("a.xyzd");
  make("a.bin", {"--layout", "boreas"});
  make("a.pcd", {"--ascii"});
  const test::LasReader las(test::file_text(folder->path("a.las")));
  std::istringstream xyzd(test::file_text(folder->path("a.xyzd")));
  const std::string rows = test::file_text(folder->path("a.bin"));
  const std::string pcd = test::file_text(folder->path("a.pcd"));
  std::istringstream lines(pcd.substr(pcd.find("DATA ascii\n") + 11));
  ASSERT_EQ(rows.size(), las.points.size() * 24);
  for (std::size_t i = 0; i < las.points.size(); ++i) {
    const auto& point = las.points[i];
    std::array<double, 4> in_xyzd{};
    for (double& value : in_xyzd) xyzd >> value;
    std::array<double, 11> in_pcd{};
    for (double& value : in_pcd) lines >> value;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(in_xyzd.at(axis), point.place.at(axis), 6e-5);
      EXPECT_NEAR(in_pcd.at(axis), point.place.at(axis), 6e-5);
      EXPECT_NEAR(test::number_at<float>(rows, 24 * i + 4 * axis), point.place.at(axis), 6e-5);
    }
    const double velocity = point.extra.at("radial_velocity");
    EXPECT_NEAR(in_xyzd[3], velocity, 1e-5);
    EXPECT_NEAR(in_pcd[3], velocity, 1e-5);
    EXPECT_EQ(test::number_at<float>(rows, 24 * i + 16), static_cast<float>(velocity));
    EXPECT_EQ(in_pcd[10], point.extra.at("pixel"));
  }
  EXPECT_TRUE(lines >> std::ws && lines.eof());
}

// The numbers behind the head of a PCD of text.
std::vector<double> numbers_of(const std::string& pcd) {
  const std::string data = "DATA ascii\n";
  std::istringstream in(pcd.substr(pcd.find(data) + data.size()));
  std::vector<double> numbers;
  for (double number = 0; in >> number;) numbers.push_back(number);
  return numbers;
}

// What a program of pcl-tools makes of a cloud: the PCD of text `out`.
std::vector<double> read_by_pcl(const std::string& program, const std::string& out,
                                const std::vector<std::string>& arguments) {
  const auto done = test::Program(arguments, program).wait();
  EXPECT_EQ(done.exit_code, 0) << done.out << done.err;
  return numbers_of(test::file_text(out));
}

// PCL prints seven or eight digits.
void expect_read_back(const std::vector<double>& read, const std::vector<double>& written) {
  ASSERT_EQ(read.size(), 24U * 11);
  ASSERT_EQ(read.size(), written.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_NEAR(read[i], written[i], 1e-6 * std::abs(written[i])) << i;
  }
}

TEST_F(CloudProgram, PclReadsItBack) {
  if (!std::filesystem::exists("/usr/bin/pcl_ply2pcd")) {
    GTEST_SKIP() << "pcl-tools is not installed; scripts/setup does so";
  }
  make("p.pcd");
  make("p.ply");
  make("text.pcd", {"--ascii"});
  make("text.ply", {"--ascii"});
  const std::string out = folder->path("out.pcd");
  const auto written = numbers_of(test::file_text(folder->path("text.pcd")));
  expect_read_back(
      read_by_pcl("/usr/bin/pcl_convert_pcd_ascii_binary", out, {folder->path("p.pcd"), out, "0"}),
      written);
  for (const char* name : {"p.ply", "text.ply"}) {
    expect_read_back(
        read_by_pcl("/usr/bin/pcl_ply2pcd", out, {"-format", "0", folder->path(name), out}),
        written);
  }
}

TEST_F(CloudProgram, CopcReadsItBack) {
  if (std::getenv("SPLID_LONG_TESTS") == nullptr)
    GTEST_SKIP() << "SPLID_LONG_TESTS=1 fetches copc by npm";
  const auto fetched = test::Program({"install", "--prefix", folder->path("npm"),
                                      "--ignore-scripts", "--no-audit", "--no-fund", "copc@0.0.8"},
                                     "/usr/bin/npm")
                           .wait();
  if (fetched.exit_code != 0) GTEST_SKIP() << "npm cannot fetch copc: " << fetched.err;
  make("c.las");
  const std::string script = folder->path("npm/read_las.mjs");
  std::filesystem::copy(SPLID_SOURCE_DIR "/tests/daemon/cloud/read_las.mjs", script);
  const auto read = test::Program({script, folder->path("c.las")}, "/usr/bin/node").wait();
  ASSERT_EQ(read.exit_code, 0) << read.err;
  std::istringstream in(read.out);
  const test::LasReader las(test::file_text(folder->path("c.las")));
  ASSERT_EQ(las.points.size(), 24U);
  for (const auto& point : las.points) {
    std::vector<double> expected{point.place[0], point.place[1], point.place[2], point.gps_time};
    for (const auto& extra : las.extras) expected.push_back(point.extra.at(extra.name));
    for (const double value : expected) {
      double number = 0;
      ASSERT_TRUE(in >> number);
      EXPECT_NEAR(number, value, 1e-9 * std::abs(value));
    }
  }
  EXPECT_TRUE(in >> std::ws && in.eof());
}

TEST_F(CloudProgram, SeveralRecordingsAreOneCloud) {
  const auto made = run_program({"cloud", recording(), recording(), "--config",
                                 folder->path("s.json"), "--output", folder->path("twice.las")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(test::LasReader(test::file_text(folder->path("twice.las"))).points.size(), 48U);
}

// The recording has five frames, of which the last is cut short.
TEST_F(CloudProgram, EachFrameIsACloudWhereTheNameSaysSo) {
  EXPECT_THAT(make("f-%02d.bin", {"--layout", "dicp"}),
              HasSubstr("points of 45 frames in 4 files"));
  make("whole.bin", {"--layout", "dicp"});
  std::string together;
  for (const char* name : {"f-00.bin", "f-01.bin", "f-02.bin", "f-03.bin"}) {
    const std::string bytes = test::file_text(folder->path(name));
    EXPECT_EQ(bytes.size(), 6U * 16) << name;
    together += bytes;
  }
  EXPECT_EQ(together, test::file_text(folder->path("whole.bin")));
}

TEST_F(CloudProgram, WhatHasNoDirectionIsRefused) {
  const std::string config = config_of("n.json", pixel_list(false));
  const auto made =
      run_program({"cloud", recording(), "--config", config, "--output", folder->path("n.pcd")});
  EXPECT_EQ(made.exit_code, 2);
  EXPECT_THAT(made.err, AllOf(HasSubstr("n.json: /pixels"), HasSubstr("azimuth_deg")));
  EXPECT_FALSE(std::filesystem::exists(folder->path("n.pcd")));
  EXPECT_FALSE(std::filesystem::exists(folder->path("n.pcd.part")));
}

TEST_F(CloudProgram, ACloudThatIsThereStays) {
  const std::string cloud = folder->write("there.pcd", "mine");
  const auto made =
      run_program({"cloud", recording(), "--config", folder->path("s.json"), "--output", cloud});
  EXPECT_EQ(made.exit_code, 2);
  EXPECT_THAT(made.err, HasSubstr("--force"));
  EXPECT_EQ(test::file_text(cloud), "mine");
}

TEST_F(CloudProgram, ARecordingThatCannotBeReadLeavesNoCloud) {
  const auto made = run_program({"cloud", folder->path("none.ptu"), "--config",
                                 folder->path("s.json"), "--output", folder->path("none.pcd")});
  EXPECT_NE(made.exit_code, 0);
  EXPECT_THAT(made.err, HasSubstr("none.ptu"));
  EXPECT_FALSE(std::filesystem::exists(folder->path("none.pcd")));
}

TEST_F(CloudProgram, WhatWasMeasuredBeforeABadRecordingIsKept) {
  const auto made =
      run_program({"cloud", recording(), folder->write("bad.ptu", "no recording"), "--config",
                   folder->path("s.json"), "--output", folder->path("kept.las")});
  EXPECT_EQ(made.exit_code, 4);
  EXPECT_THAT(made.err, AllOf(HasSubstr("kept.las: 24 points"), HasSubstr("bad.ptu")));
  EXPECT_EQ(test::LasReader(test::file_text(folder->path("kept.las"))).points.size(), 24U);
}

TEST_F(CloudProgram, AStopLeavesNoCloud) {
  std::vector<std::string> arguments(500, recording());
  arguments.insert(arguments.begin(), "cloud");
  const std::string cloud = folder->path("stopped.pcd");
  arguments.insert(arguments.end(), {"--config", folder->path("s.json"), "--output", cloud});
  test::Program program(arguments);
  EXPECT_TRUE(test::eventually([&] { return std::filesystem::exists(cloud + ".part"); }));
  program.signal(SIGINT);
  const auto stopped = program.wait();
  EXPECT_EQ(stopped.exit_code, 130) << stopped.err;
  EXPECT_THAT(stopped.err, HasSubstr("stopped.pcd was not written"));
  EXPECT_FALSE(std::filesystem::exists(cloud));
  EXPECT_FALSE(std::filesystem::exists(cloud + ".part"));
}

}  // namespace
}  // namespace splid
