#include "protocol/frame_columns.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>

namespace splid {
namespace {

const FrameColumn& column(std::string_view name) {
  const auto& all = frame_columns();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.name == name; });
  EXPECT_NE(found, all.end()) << name;
  return *found;
}

template <class Value>
Value value_in(const std::string& row, std::string_view name) {
  Value value{};
  std::memcpy(&value, row.data() + column(name).offset, sizeof value);
  return value;
}

std::string text_in(const std::string& row, std::string_view name) {
  return row.substr(column(name).offset, column(name).bytes).c_str();
}

TEST(FrameColumns, FollowEachOtherWithoutGaps) {
  std::size_t offset = 0;
  for (const FrameColumn& one : frame_columns()) {
    EXPECT_EQ(one.offset, offset) << one.name;
    offset += one.bytes;
  }
  EXPECT_EQ(frame_row_bytes(), offset);
  std::string rows;
  append_frame_row({}, rows);
  append_frame_row({}, rows);
  EXPECT_EQ(rows.size(), 2 * offset);
}

TEST(FrameColumns, WhatIsNotKnownIsNaNOrMinusOneOrEmpty) {
  std::string row;
  FrameMessage message;
  message.velocity_mps = HUGE_VAL;  // no number of JSON either
  append_frame_row(message, row);
  EXPECT_TRUE(std::isnan(value_in<double>(row, "distance_m")));
  EXPECT_TRUE(std::isnan(value_in<double>(row, "velocity_mps")));
  EXPECT_EQ(value_in<std::int64_t>(row, "photons"), -1);
  EXPECT_EQ(value_in<std::int64_t>(row, "sync_count"), -1);
  EXPECT_EQ(value_in<std::int64_t>(row, "uncounted_losses"), 0);
  EXPECT_EQ(text_in(row, "findings"), "");
  EXPECT_EQ(text_in(row, "status"), "not_run");
}

TEST(FrameColumns, ARowHoldsTheSameBits) {
  FrameMessage message;
  message.status = FrameStatus::ok;
  message.mode = Mode::interleaved;
  message.start_ps = std::numeric_limits<std::int64_t>::max();
  message.distance_m = 0.1 + 0.2;
  message.sync = FrameMessage::Sync{5, 0, 1, 3.5, {}, {}};
  message.findings.resize(2);
  message.findings[0].name = "jerk";
  message.findings[1].name = "fading";
  message.effort = "exhaustive and then some";
  std::string row;
  append_frame_row(message, row);
  EXPECT_EQ(value_in<std::int64_t>(row, "start_ps"), message.start_ps);
  EXPECT_EQ(value_in<double>(row, "distance_m"), 0.1 + 0.2);
  EXPECT_EQ(value_in<std::int64_t>(row, "sync_spurious"), 1);
  EXPECT_EQ(value_in<double>(row, "sync_period_ps"), 3.5);
  EXPECT_EQ(row[column("valid").offset], 1);
  EXPECT_EQ(text_in(row, "status"), "ok");
  EXPECT_EQ(text_in(row, "findings"), "jerk;fading");
  EXPECT_EQ(row.substr(column("effort").offset, 16), "exhaustive and t");
}

TEST(FrameColumns, LinesOfTextHaveAFieldForEachColumn) {
  FrameMessage message;
  message.distance_m = 1e300;
  for (const std::string& line : {frame_csv_head(), frame_csv_row(message)}) {
    EXPECT_EQ(static_cast<std::size_t>(std::count(line.begin(), line.end(), ',')) + 1,
              frame_columns().size());
    EXPECT_EQ(line.find('\n'), line.size() - 1);
  }
  EXPECT_EQ(frame_csv_head().rfind("timestamp,sequence,status,valid,", 0), 0U);
  EXPECT_EQ(frame_csv_row(message).rfind("0,0,not_run,false,baseline,0,0,1e+300,,", 0), 0U);
}

}  // namespace
}  // namespace splid
