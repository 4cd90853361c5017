#include "daemon/stream/scan_cutter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "tests/support/framed.hpp"

namespace splid {
namespace {

using namespace test;

constexpr std::int64_t us = 1'000'000;

ChannelOptions with_ticks() { return {{"1"}, "sync", "marker:8"}; }

// Lines of 4 dwells from marker 1 to marker 2, with pictures that begin at marker 4.
ScanLines four_pixels() { return {1, 2, 4, 4, 0, false, 0}; }

Framed scanned(const std::vector<Tag>& tags, const ScanLines& scan, std::size_t block = 1'000'000,
               std::size_t room = 1 << 16) {
  FramerOptions options = options_of_10_ms();
  options.scan = scan;
  const FrameCapacity small{256, 64, 64, 16};  // there are hundreds of frames
  Framed result{FrameList(small), {}, {}};
  const ChannelMap channels{with_ticks()};
  Framer framer(options, channels, result.frames);
  ScanCutter cutter(scan, channels, room, framer);
  for (std::size_t at = 0; at < tags.size(); at += block) {
    cutter.push(std::span(tags).subspan(at, std::min(block, tags.size() - at)), 7);
  }
  cutter.finish();
  framer.finish();
  result.totals = framer.totals();
  return result;
}

// Each tag is in a dwell, outside, on another channel or lost.
void expect_all_told(const Framed& r, const std::vector<Tag>& tags) {
  const FramerTotals& t = r.totals;
  EXPECT_EQ(t.events, events_in(tags));
  EXPECT_EQ(t.events, t.photons + t.syncs + t.markers - t.shared + t.ignored + t.late + t.surplus +
                          t.outside);
  expect_frames_whole(r);
}

std::vector<std::size_t> photons_of(const Framed& r) {
  std::vector<std::size_t> counts;
  for (const auto& frame : r.frames.frames) counts.push_back(frame->photons_ps.size());
  return counts;
}

std::vector<ScanPlace> places_of(const Framed& r) {
  std::vector<ScanPlace> places;
  for (const auto& frame : r.frames.frames) {
    places.push_back(frame->scan.value());
    places.back().tick = 0;
  }
  return places;
}

ScanPlace at(std::int64_t picture, std::int64_t line, std::int64_t column) {
  return {picture, line, column, 4, 0};
}

// A line from start_us to stop_us with k photons in dwell k of 4, in the middle.
void add_line(std::vector<Tag>& tags, std::int64_t start_us, std::int64_t stop_us) {
  const std::int64_t dwell_ps = (stop_us - start_us) * us / 4;
  tags.push_back(marker_tag(start_us * us, 1));
  for (int k = 0; k < 4; ++k) {
    for (int n = 0; n < k; ++n) {
      tags.push_back(photon_tag(start_us * us + k * dwell_ps + dwell_ps / 2, 1));
    }
  }
  tags.push_back(marker_tag(stop_us * us, 2));
}

TEST(ScanCutter, CutsALineIntoEqualDwells) {
  std::vector<Tag> tags;
  add_line(tags, 100, 140);
  tags.push_back(photon_tag(160 * us, 1));
  add_line(tags, 200, 280);
  const Framed r = scanned(tags, four_pixels());
  expect_all_told(r, tags);
  EXPECT_EQ(photons_of(r), (std::vector<std::size_t>{0, 1, 2, 3, 0, 1, 2, 3}));
  EXPECT_EQ(places_of(r), (std::vector{at(0, 0, 0), at(0, 0, 1), at(0, 0, 2), at(0, 0, 3),
                                       at(0, 1, 0), at(0, 1, 1), at(0, 1, 2), at(0, 1, 3)}));
  EXPECT_EQ(r.frames[1].start_ps, 110 * us);
  EXPECT_EQ(r.frames[1].end_ps, 120 * us);
  EXPECT_EQ(r.frames[6].start_ps, 240 * us);
  EXPECT_EQ(r.frames[6].end_ps, 260 * us);
  EXPECT_EQ(r.frames[6].arrival_ns, 7);
  EXPECT_EQ(r.totals.outside, 1U);
  EXPECT_EQ(r.totals.ignored, 4U) << "the scan's own markers";
  EXPECT_EQ(r.totals.lines, 2U);
  EXPECT_EQ(r.totals.cut_lines, 0U);
}

TEST(ScanCutter, BlocksOfAnySizeAndTagsOutOfOrderMakeTheSameFrames) {
  std::vector<Tag> tags;
  std::mt19937 random(1);
  for (int line = 0; line < 50; ++line) {
    tags.push_back(marker_tag(line * 100 * us, line % 10 == 0 ? 7 : 3));  // also the stop before it
    for (int n = 0; n < 200; ++n) {
      tags.push_back(photon_tag(line * 100 * us + static_cast<int>(random() % (100 * us)), 1));
    }
  }
  tags.push_back(marker_tag(5000 * us, 2));
  std::stable_sort(tags.begin(), tags.end(),
                   [](const Tag& a, const Tag& b) { return a.time_ps < b.time_ps; });
  const Framed whole = scanned(tags, four_pixels());
  expect_all_told(whole, tags);
  ASSERT_EQ(whole.frames.size(), 200U);
  EXPECT_EQ(whole.totals.photons, 10'000U);
  EXPECT_EQ(places_of(whole)[44], at(1, 1, 0));
  expect_seamless(whole);
  for (const std::size_t block : {1, 7, 1000})
    expect_same(whole, scanned(tags, four_pixels(), block));

  std::vector<Tag> shuffled = tags;
  std::stable_sort(shuffled.begin(), shuffled.end(), [&](const Tag& a, const Tag& b) {
    const auto late = [](const Tag& t) { return t.time_ps + t.time_ps * 7 % (us / 2); };
    return late(a) < late(b);
  });
  ASSERT_NE(shuffled, tags);
  expect_same(whole, scanned(shuffled, four_pixels(), 64));
}

TEST(ScanCutter, AStopIsBeforeAStartOfTheSameTimeInAnyOrder) {
  for (const bool start_first : {true, false}) {
    std::vector<Tag> tags{marker_tag(0, 1), photon_tag(39 * us, 1), photon_tag(40 * us, 1)};
    tags.push_back(marker_tag(40 * us, start_first ? 1 : 2));
    tags.push_back(marker_tag(40 * us, start_first ? 2 : 1));
    tags.push_back(marker_tag(80 * us, 2));
    const Framed r = scanned(tags, four_pixels());
    expect_all_told(r, tags);
    EXPECT_EQ(photons_of(r), (std::vector<std::size_t>{0, 0, 0, 1, 1, 0, 0, 0}));
    EXPECT_EQ(r.totals.cut_lines, 0U);
  }
}

TEST(ScanCutter, ALineThatRunsBackHasItsColumnsTurnedRound) {
  std::vector<Tag> tags;
  for (int line = 0; line < 3; ++line) add_line(tags, 100 * line, 100 * line + 40);
  ScanLines scan = four_pixels();
  scan.both_ways = true;
  const Framed r = scanned(tags, scan);
  ASSERT_EQ(r.frames.size(), 12U);
  EXPECT_EQ(places_of(r)[4], at(0, 1, 3));
  EXPECT_EQ(places_of(r)[7], at(0, 1, 0));
  EXPECT_EQ(places_of(r)[8], at(0, 2, 0));
}

TEST(ScanCutter, PicturesAreCountedByTheirMarkerOrTheirLines) {
  std::vector<Tag> tags;
  for (int line = 0; line < 4; ++line) {
    if (line == 3) tags.push_back(marker_tag(295 * us, 4));
    add_line(tags, 100 * line, 100 * line + 40);
  }
  const std::vector<ScanPlace> by_marker = places_of(scanned(tags, four_pixels()));
  ASSERT_EQ(by_marker.size(), 16U);
  EXPECT_EQ(by_marker[8], at(0, 2, 0));
  EXPECT_EQ(by_marker[12], at(1, 0, 0));
  ScanLines of_four = four_pixels();
  EXPECT_EQ(scanned(tags, of_four).totals.half_picture_lines, 0U) << "scan.lines is not known";
  of_four.lines = 3;
  EXPECT_EQ(scanned(tags, of_four).totals.half_picture_lines, 0U);
  of_four.lines = 4;
  EXPECT_EQ(scanned(tags, of_four).totals.half_picture_lines, 3U);
  const ScanLines two_lines{1, 2, 4, 0, 2, false, 0};
  const std::vector<ScanPlace> by_lines = places_of(scanned(tags, two_lines));
  EXPECT_EQ(by_lines[4], at(0, 1, 0));
  EXPECT_EQ(by_lines[8], at(1, 0, 0));
}

TEST(ScanCutter, FramesFromMarkerToMarkerLeaveOutTheHalfOnes) {
  std::vector<Tag> tags{photon_tag(10 * us, 1), marker_tag(20 * us, 4), photon_tag(25 * us, 1),
                        marker_tag(50 * us, 4), marker_tag(60 * us, 4), photon_tag(70 * us, 1)};
  const Framed r = scanned(tags, ScanLines{4, 4});
  expect_all_told(r, tags);
  EXPECT_EQ(photons_of(r), (std::vector<std::size_t>{1, 0}));
  EXPECT_EQ(r.frames[0].start_ps, 20 * us);
  EXPECT_EQ(r.frames[1].end_ps, 60 * us);
  EXPECT_EQ(r.totals.outside, 2U) << "before the first marker and after the last";
}

TEST(ScanCutter, ALineWithoutAnEndIsCountedAndKeepsItsPlace) {
  std::vector<Tag> tags;
  add_line(tags, 0, 40);
  add_line(tags, 100, 140);
  tags.pop_back();  // its stop
  add_line(tags, 200, 240);
  tags.push_back(marker_tag(300 * us, 1));
  tags.push_back(photon_tag(310 * us, 1));
  const Framed r = scanned(tags, four_pixels());
  expect_all_told(r, tags);
  EXPECT_EQ(places_of(r)[4], at(0, 2, 0));
  EXPECT_EQ(r.frames.size(), 8U);
  EXPECT_EQ(r.totals.lines, 4U);
  EXPECT_EQ(r.totals.cut_lines, 1U);
  EXPECT_EQ(r.totals.open_lines, 1U);
  EXPECT_EQ(r.totals.outside, 7U);
}

TEST(ScanCutter, MarkersThatStopLoseNothing) {
  std::vector<Tag> tags;
  add_line(tags, 0, 40);
  tags.push_back(marker_tag(100 * us, 1));
  for (int n = 0; n < 5000; ++n) tags.push_back(photon_tag((101 + n) * us, 1));
  add_line(tags, 9000, 9040);
  const Framed r = scanned(tags, four_pixels(), 500, 1000);
  expect_all_told(r, tags);
  EXPECT_EQ(r.frames.size(), 8U);
  EXPECT_EQ(r.totals.outside, 5000U);
  EXPECT_EQ(r.totals.cut_lines, 1U);
}

TEST(ScanCutter, LossesReachTheDwellsThatTheyTouch) {
  std::vector<Tag> tags{marker_tag(0, 1),
                        {15 * us, 0, TagKind::loss_begin, {}},
                        {30 * us, 5, TagKind::loss_end, {}},
                        marker_tag(40 * us, 2),
                        {90 * us, 0, TagKind::loss_begin, {}},
                        marker_tag(100 * us, 1),
                        {105 * us, 2, TagKind::loss_end, {}},
                        marker_tag(140 * us, 2),
                        {150 * us, 3, TagKind::missed, {}},
                        marker_tag(200 * us, 1),
                        marker_tag(240 * us, 2)};
  const Framed r = scanned(tags, four_pixels());
  expect_all_told(r, tags);
  ASSERT_EQ(r.frames.size(), 12U);
  EXPECT_EQ(r.frames[0].seen_fraction, 1);
  EXPECT_EQ(r.frames[1].seen_fraction, 0.5);
  EXPECT_EQ(r.frames[2].seen_fraction, 0);
  EXPECT_EQ(r.frames[3].seen_fraction, 1);
  EXPECT_EQ(r.frames[3].lost_tags, 5U) << "the loss ends at its begin";
  EXPECT_EQ(r.frames[4].seen_fraction, 0.5);
  EXPECT_EQ(r.frames[4].lost_tags, 2U);
  EXPECT_EQ(r.frames[8].lost_tags, 3U) << "of the time between two lines";
  EXPECT_EQ(r.totals.reported, 10U);
}

TEST(ScanCutter, AClockThatBreaksEndsTheLine) {
  std::vector<Tag> tags{marker_tag(1000 * us, 1), photon_tag(1010 * us, 1),
                        Tag{0, 0, TagKind::clock_break, {}}};
  add_line(tags, 100, 140);
  const Framed r = scanned(tags, four_pixels());
  expect_all_told(r, tags);
  EXPECT_EQ(r.frames.size(), 4U);
  EXPECT_EQ(r.totals.resets, 1U);
  EXPECT_EQ(r.totals.cut_lines, 1U);
}

TEST(ScanCutter, ADwellSaysWhereTheTicksAre) {
  std::vector<Tag> tags;
  for (int n = 0; n < 30; ++n) tags.push_back(marker_tag((50 + 10 * n) * us, 8));
  add_line(tags, 100, 140);
  add_line(tags, 200, 240);
  std::stable_sort(tags.begin(), tags.end(),
                   [](const Tag& a, const Tag& b) { return a.time_ps < b.time_ps; });
  const Framed r = scanned(tags, four_pixels());
  expect_all_told(r, tags);
  ASSERT_EQ(r.frames.size(), 8U);
  EXPECT_DOUBLE_EQ(r.frames[0].scan->tick, 5.5);
  EXPECT_DOUBLE_EQ(r.frames[3].scan->tick, 8.5);
  EXPECT_DOUBLE_EQ(r.frames[7].scan->tick, 18.5);
  EXPECT_EQ(r.frames[0].markers.size(), 1U);
}

TEST(ScanCutter, ASinusoidalLineHasDwellsOfEqualAngle) {
  ScanLines scan{1, 2, 4, 0, 0, false, 100};
  EXPECT_EQ(dwell_start_ps(scan, 0, 1'000'000, 0), 0);
  EXPECT_EQ(dwell_start_ps(scan, 0, 1'000'000, 1), 333'333) << "half of the way to the middle";
  EXPECT_EQ(dwell_start_ps(scan, 0, 1'000'000, 2), 500'000);
  EXPECT_EQ(dwell_start_ps(scan, 0, 1'000'000, 3), 666'667);
  EXPECT_EQ(dwell_start_ps(scan, 0, 1'000'000, 4), 1'000'000);
  scan.sine_percent = 1;
  EXPECT_NEAR(static_cast<double>(dwell_start_ps(scan, 0, 1'000'000, 1)), 250'000, 10);
  scan.sine_percent = 0;
  EXPECT_EQ(dwell_start_ps(scan, 0, 1'000'001, 1), 250'000) << "rounded down";
}

}  // namespace
}  // namespace splid
