#include "config/scan_options.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace splid {
namespace {

using ::testing::HasSubstr;

std::string fault_of(const ScanOptions& options, const ChannelOptions& channels = {}) {
  const auto fault = options.validate(channels);
  return fault ? fault->pointer + ": " + fault->what : "";
}

TEST(ScanOptions, FramesAreCutByLinesOrMarkers) {
  EXPECT_EQ(scan_lines("line:1:2:256", {}, std::nullopt), (ScanLines{1, 2, 256}));
  EXPECT_EQ(scan_lines("marker:4", {}, std::nullopt), (ScanLines{4, 4, 1}));
  EXPECT_EQ(scan_lines("time", {}, ScanLines{1, 2, 256}), std::nullopt);
}

TEST(ScanOptions, WhereTheConfigurationIsSilentTheRecordingTells) {
  const ScanLines told{1, 2, 256, 4, 0, true, 80};
  EXPECT_EQ(scan_lines("auto", {}, told), told);
  EXPECT_EQ(scan_lines("auto", {}, std::nullopt), std::nullopt);
  EXPECT_EQ(scan_lines("line:2:1:8", {}, told), (ScanLines{2, 1, 8}));
  ScanOptions options;
  options.picture = "marker:8";
  options.lines = 64;
  options.sine_percent = 50;
  EXPECT_EQ(scan_lines("auto", options, told), (ScanLines{1, 2, 256, 8, 64, true, 50}));
}

TEST(ScanOptions, OtherTextIsAFault) {
  for (const char* by : {"auto", "time", "marker:15", "line:1:1:65536"}) {
    EXPECT_FALSE(frame_by_fault(by)) << by;
  }
  for (const char* by : {"", "marker:0", "marker:16", "marker:1:2", "line:1:2", "line:1:2:0",
                         "line:1:2:65537", "line:1:2:3:4", "line:1:2:8x", "lines:1:2:3"}) {
    const auto fault = frame_by_fault(by);
    ASSERT_TRUE(fault) << by;
    EXPECT_EQ(fault->pointer, "/by");
    EXPECT_THAT(fault->what, HasSubstr("line:START:STOP:PIXELS"));
  }
}

TEST(ScanOptions, KeysThatDoNotFitEachOtherAreFaults) {
  ScanOptions options;
  EXPECT_EQ(fault_of(options), "");
  options.picture = "sync";
  EXPECT_THAT(fault_of(options), HasSubstr("/picture: \"sync\" is no marker"));
  options = {};
  options.azimuth_deg = {1};
  EXPECT_THAT(fault_of(options), HasSubstr("/azimuth_deg: has 1 angles; two are needed"));
  options = {};
  options.elevation_deg = {1, -1};
  EXPECT_THAT(fault_of(options), HasSubstr("/elevation_deg: is of the first and the last line"));
  options.lines = 64;
  EXPECT_EQ(fault_of(options), "");
  options.angles = "a.csv";
  EXPECT_THAT(fault_of(options), HasSubstr("/angles: the angles already come from a scale"));
  options = {};
  options.angles = "a.csv";
  EXPECT_EQ(fault_of(options), "");
  EXPECT_THAT(fault_of(options, {{"1"}, "sync", ""}), HasSubstr("/angles: its rows are joined"));
}

}  // namespace
}  // namespace splid
