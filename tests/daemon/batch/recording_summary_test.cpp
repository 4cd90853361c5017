#include "daemon/batch/recording_summary.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "protocol/frame_columns.hpp"

namespace splid::batch {
namespace {

std::string row_of(FrameStatus status, double timestamp_s, double distance_m,
                   const std::string& pixel = "") {
  FrameMessage message;
  message.pixel = pixel;
  message.status = status;
  message.timestamp_s = timestamp_s;
  message.photons = 100;
  message.lost_tags = 2;
  message.distance_m = distance_m;
  message.std_distance_m = distance_m / 1000;
  std::string row;
  append_frame_row(message, row);
  return row;
}

TEST(RecordingSummary, CountsWhatTheRowsSay) {
  RecordingSummary summary;
  summary.take(row_of(FrameStatus::ok, 10, 7) + row_of(FrameStatus::no_target, 11, 1));
  summary.take(row_of(FrameStatus::ambiguous, 12, 3) + row_of(FrameStatus::saturated, 13, 2));
  summary.take(row_of(FrameStatus::ok, 14, 5));
  EXPECT_EQ(RecordingSummary::columns(),
            "frames,valid,ok,no_target,ambiguous,incomplete,no_sync,saturated,photons,lost_tags,"
            "first_timestamp,last_timestamp,least_distance_m,median_distance_m,largest_distance_m,"
            "median_std_distance_m,pixel");
  EXPECT_EQ(summary.lines(), "5,3,2,1,1,0,0,1,500,10,10,14,3,5,7,0.005,\n");
}

// Rows may also be missing, as where a slice begins anew.
TEST(RecordingSummary, HasALineForEachPixel) {
  RecordingSummary summary;
  summary.take(row_of(FrameStatus::ok, 10, 7, "b") + row_of(FrameStatus::no_target, 10, 1, "a"));
  summary.take(row_of(FrameStatus::ok, 11, 9, "b") + row_of(FrameStatus::ok, 11, 2, "a"));
  summary.take(row_of(FrameStatus::ok, 12, 3, "a"));
  EXPECT_EQ(summary.lines(),
            "2,2,2,0,0,0,0,0,200,4,10,11,7,9,9,0.009,b\n"
            "3,2,2,1,0,0,0,0,300,6,10,12,2,3,3,0.003,a\n");
}

TEST(RecordingSummary, OfNoFramesHasNoValuesButCounts) {
  const std::string line = RecordingSummary().lines();
  EXPECT_EQ(line, "0,0,0,0,0,0,0,0,0,0,,,,,,,\n");
  const std::string columns = RecordingSummary::columns();
  EXPECT_EQ(std::count(line.begin(), line.end(), ','),
            std::count(columns.begin(), columns.end(), ','));
}

}  // namespace
}  // namespace splid::batch
