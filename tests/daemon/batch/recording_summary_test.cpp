#include "daemon/batch/recording_summary.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "protocol/frame_columns.hpp"

namespace splid::batch {
namespace {

std::string row_of(FrameStatus status, double timestamp_s, double distance_m) {
  FrameMessage message;
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
  EXPECT_EQ(summary.frames(), 5U);
  EXPECT_EQ(RecordingSummary::columns(),
            "frames,valid,ok,no_target,ambiguous,incomplete,no_sync,saturated,photons,lost_tags,"
            "first_timestamp,last_timestamp,least_distance_m,median_distance_m,largest_distance_m,"
            "median_std_distance_m");
  EXPECT_EQ(summary.line(), "5,3,2,1,1,0,0,1,500,10,10,14,3,5,7,0.005");
}

TEST(RecordingSummary, OfNoFramesHasNoValuesButCounts) {
  const std::string line = RecordingSummary().line();
  EXPECT_EQ(line, "0,0,0,0,0,0,0,0,0,0,,,,,,");
  const std::string columns = RecordingSummary::columns();
  EXPECT_EQ(std::count(line.begin(), line.end(), ','),
            std::count(columns.begin(), columns.end(), ','));
}

}  // namespace
}  // namespace splid::batch
