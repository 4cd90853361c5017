#include "daemon/output/scan_watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace splid {
namespace {

using ::testing::HasSubstr;

constexpr std::int64_t second_ns = 1'000'000'000;

FramerTotals totals_of(std::uint64_t frames, std::uint64_t lines, std::uint64_t cut_lines) {
  FramerTotals totals;
  totals.frames = frames;
  totals.lines = lines;
  totals.cut_lines = cut_lines;
  totals.outside = lines > 0 ? 100 : 0;
  return totals;
}

TEST(ScanWatch, SaysNothingOfFramesByTime) {
  ScanWatch watch;
  EXPECT_EQ(watch.look(totals_of(0, 0, 0), second_ns), "");
  EXPECT_EQ(watch.look(totals_of(0, 0, 0), 100 * second_ns), "");
}

TEST(ScanWatch, TellsThatMarkersDoNotComeOrStop) {
  ScanWatch watch;
  FramerTotals none;
  none.outside = 10;
  EXPECT_EQ(watch.look(none, second_ns), "");
  EXPECT_THAT(watch.look(none, 7 * second_ns), HasSubstr("no line of the scan has begun"));
  EXPECT_EQ(watch.look(totals_of(64, 1, 0), 8 * second_ns), "");
  EXPECT_EQ(watch.look(totals_of(64, 2, 0), 20 * second_ns), "") << "a line may take as long";
  EXPECT_THAT(watch.look(totals_of(64, 2, 0), 30 * second_ns),
              HasSubstr("no line of the scan ends any more"));
  EXPECT_EQ(watch.look(totals_of(128, 2, 0), 31 * second_ns), "");
}

TEST(ScanWatch, TellsOfALineWithoutAnEndForAWhile) {
  ScanWatch watch;
  EXPECT_EQ(watch.look(totals_of(64, 1, 0), second_ns), "");
  EXPECT_THAT(watch.look(totals_of(128, 3, 1), 2 * second_ns),
              HasSubstr("1 of 3 lines of the scan have no end"));
  EXPECT_NE(watch.look(totals_of(192, 4, 1), 6 * second_ns), "");
  EXPECT_EQ(watch.look(totals_of(256, 5, 1), 8 * second_ns), "");
  FramerTotals ended = totals_of(256, 6, 1);
  ended.open_lines = 1;
  EXPECT_EQ(watch.look(ended, 8 * second_ns), "") << "a stream ends in the middle of a line";
}

TEST(ScanWatch, RenewsItsCountsOnceASecond) {
  ScanWatch watch;
  EXPECT_EQ(watch.look(totals_of(64, 1, 0), second_ns), "");
  const std::string said = watch.look(totals_of(64, 3, 2), 2 * second_ns);
  EXPECT_THAT(said, HasSubstr("2 of 3 lines"));
  EXPECT_EQ(watch.look(totals_of(64, 4, 3), 3 * second_ns - 1), said);
  EXPECT_THAT(watch.look(totals_of(64, 5, 4), 3 * second_ns), HasSubstr("4 of 5 lines"));
}

}  // namespace
}  // namespace splid
