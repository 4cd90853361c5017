#include "daemon/batch/slice_choice.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <set>
#include <vector>

namespace splid::batch {
namespace {

// A recording of 100 frames of 20 photons, with a header of 40 bytes.
constexpr std::uint64_t recorded_frames = 100;
constexpr std::uint64_t photons_a_frame = 20;
constexpr std::uint64_t recorded_bytes = 40 + 4 * photons_a_frame * recorded_frames;

std::set<std::uint64_t> wanted_frames(SliceChoice& choice) {
  std::set<std::uint64_t> wanted;
  Frame frame({photons_a_frame, 1, 1, 1});
  frame.photons_ps.resize(photons_a_frame);
  for (frame.sequence = 0; frame.sequence < recorded_frames; ++frame.sequence) {
    if (choice.wants(frame)) wanted.insert(frame.sequence);
  }
  return wanted;
}

TEST(SliceChoice, EachFrameIsInOnePart) {
  Recording recording;
  recording.bytes = recorded_bytes;
  for (const std::uint64_t count : {1U, 2U, 7U, 300U}) {
    std::multiset<std::uint64_t> all;
    for (std::uint64_t index = 1; index <= count; ++index) {
      SliceChoice choice({8}, recorded_bytes, part_of({index, count}, recording, recorded_bytes),
                         {});
      for (const std::uint64_t frame : wanted_frames(choice)) all.insert(frame);
    }
    EXPECT_EQ(all.size(), recorded_frames) << count;
    EXPECT_EQ(std::set<std::uint64_t>(all.begin(), all.end()).size(), recorded_frames) << count;
  }
}

TEST(SliceChoice, PartsAreEvenAndOfWholeSlices) {
  Recording recording;
  recording.bytes = recorded_bytes;
  SliceChoice choice({8}, recorded_bytes, part_of({2, 4}, recording, recorded_bytes), {});
  const std::set<std::uint64_t> wanted = wanted_frames(choice);
  EXPECT_EQ(wanted.size() % 8, 0U);
  EXPECT_NEAR(static_cast<double>(wanted.size()), 25, 8);
  EXPECT_NEAR(static_cast<double>(*wanted.begin()), 25, 8);
  EXPECT_TRUE(choice.passed());
}

// Slices of 8 frames begin every 640 bytes.
TEST(SliceChoice, ASliceThatBeginsAtTheEndOfAPartIsInTheNext) {
  constexpr std::uint64_t slice = 8 * 4 * photons_a_frame;
  SliceChoice choice({8}, recorded_bytes, {slice, 3 * slice}, {});
  const std::set<std::uint64_t> wanted = wanted_frames(choice);
  EXPECT_EQ(wanted.size(), 16U);
  EXPECT_EQ(*wanted.begin(), 8U);
  EXPECT_EQ(*wanted.rbegin(), 23U);
  EXPECT_TRUE(choice.passed());
  SliceChoice last({8}, recorded_bytes, {0, 12 * slice + 1}, {});
  wanted_frames(last);
  EXPECT_FALSE(last.passed());
  SliceChoice but_one({8}, recorded_bytes, {0, 12 * slice}, {});
  wanted_frames(but_one);
  EXPECT_TRUE(but_one.passed());
}

// Of a format with records of 10 bytes.
TEST(SliceChoice, PartsOfLongerRecordsAreEvenToo) {
  Recording recording;
  recording.bytes = recorded_bytes * 10 / 4;
  SliceChoice choice({8}, recording.bytes, part_of({4, 4}, recording, recording.bytes), {}, 10);
  EXPECT_NEAR(static_cast<double>(wanted_frames(choice).size()), 25, 8);
}

TEST(SliceChoice, TheLastPartIsNeverPassedAndMeasuredSlicesAreLeftOut) {
  SliceChoice choice({8}, recorded_bytes, {0, recorded_bytes}, {0, 2});
  const std::set<std::uint64_t> wanted = wanted_frames(choice);
  EXPECT_EQ(wanted.size(), recorded_frames - 16);
  EXPECT_FALSE(wanted.contains(7));
  EXPECT_TRUE(wanted.contains(8));
  EXPECT_FALSE(wanted.contains(16));
  EXPECT_FALSE(choice.passed());
}

// T3 records can give two tags each, so that there may be more tags than the file has room for.
TEST(SliceChoice, MoreTagsThanRecordsStayInTheLastPart) {
  SliceChoice choice({8}, recorded_bytes / 2, {recorded_bytes / 4, recorded_bytes / 2}, {});
  EXPECT_TRUE(wanted_frames(choice).contains(recorded_frames - 1));
  EXPECT_FALSE(choice.passed());
  EXPECT_EQ(choice.position(), recorded_bytes / 2 - 1);
}

TEST(SliceChoice, AWholeRecordingIsInThePartOfItsFirstByte) {
  SliceChoice first(Slicing::whole(), recorded_bytes, {0, 1}, {});
  EXPECT_EQ(wanted_frames(first).size(), recorded_frames);
  SliceChoice second(Slicing::whole(), recorded_bytes, {1, recorded_bytes}, {});
  EXPECT_TRUE(wanted_frames(second).empty());
}

}  // namespace
}  // namespace splid::batch
