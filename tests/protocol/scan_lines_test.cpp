#include "protocol/scan_lines.hpp"

#include <gtest/gtest.h>

#include "protocol/ptu_header.hpp"

namespace splid {
namespace {

std::optional<RecordingHeader> header_with(const ScanLines& scan) {
  PtuFacts facts;
  facts.scan = scan;
  return parse_ptu_header(make_ptu_header(facts), true);
}

TEST(ScanLines, AHeaderTellsTheScanThatWasWritten) {
  const ScanLines scan{1, 2, 256, 4, 0, true, 80};
  const auto header = header_with(scan);
  EXPECT_EQ(scan_of(*header), scan);
  EXPECT_EQ(header->integer("Measurement_SubMode"), 3);
  EXPECT_EQ(header->integer("ImgHdr_LineStart"), 1);
  EXPECT_EQ(header->integer("ImgHdr_LineStop"), 2);
  EXPECT_EQ(header->integer("ImgHdr_Frame"), 3) << "the marker's number";
}

TEST(ScanLines, LinesOfAPictureAreWrittenAndNotBelieved) {
  const auto header = header_with({1, 2, 256, 0, 100, false, 0});
  EXPECT_EQ(header->integer("ImgHdr_PixY"), 100);
  EXPECT_EQ(header->integer("ImgHdr_Frame"), std::nullopt);
  EXPECT_EQ(scan_of(*header), (ScanLines{1, 2, 256, 0, 0, false, 0}));
}

TEST(ScanLines, LinesWithoutStopsEndAtTheNextStart) {
  const ScanLines scan{8, 8, 32, 0, 0, false, 0};
  EXPECT_EQ(scan_of(*header_with(scan)), scan);
}

TEST(ScanLines, AHeaderWithoutAScanTellsOfNone) {
  EXPECT_EQ(scan_of(*parse_ptu_header(make_ptu_header({}), true)), std::nullopt);
  for (const ScanLines& scan : {ScanLines{4, 4}, ScanLines{3, 2, 16}}) {
    const auto header = header_with(scan);
    EXPECT_EQ(scan_of(*header), std::nullopt) << "no reader knows frames of markers";
    EXPECT_EQ(header->integer("Measurement_SubMode"), 0);
  }
}

}  // namespace
}  // namespace splid
