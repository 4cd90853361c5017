#include "drivers/replay/recording_reader.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/made_recording.hpp"
#include "tests/support/other_recordings.hpp"
#include "tests/support/t3_recording.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid {
namespace {

using test::counted;
using test::overflow_record;
using test::photon_record;
using test::recording;
using test::sync_record;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class RecordingReaderTest : public ::testing::Test {
 protected:
  // All tags of a file with this content, blocks of at most `room`.
  std::vector<Tag> read(const std::string& content, std::size_t room = 1000) {
    const std::string file = folder_.write("made.ptu", content);
    RecordingReader reader(file, [this](const std::string& text) { warnings_.push_back(text); });
    std::vector<Tag> all;
    std::vector<Tag> block(room);
    while (const std::size_t tags = reader.read(block)) {
      all.insert(all.end(), block.begin(), block.begin() + static_cast<std::ptrdiff_t>(tags));
    }
    EXPECT_EQ(reader.read(block), 0U);
    records_ = reader.records();
    header_bytes_ = reader.header().header_bytes;
    return all;
  }

  test::TempFolder folder_;
  std::vector<std::string> warnings_;
  std::uint64_t records_ = 0;
  std::size_t header_bytes_ = 0;
};

TEST_F(RecordingReaderTest, ReadsWhatTheHeaderCounts) {
  const auto tags =
      read(recording(counted(3), {photon_record(1, 5), overflow_record(2), sync_record(7)}), 1);
  EXPECT_THAT(tags, ElementsAre(photon_tag(5, 1), sync_tag(2 * 33'554'432 + 7)));
  EXPECT_EQ(records_, 3U);
  EXPECT_THAT(warnings_, IsEmpty());
}

TEST_F(RecordingReaderTest, NoRecordsAreNoTags) {
  PtuFacts facts = counted(0);
  EXPECT_THAT(read(recording(facts, {})), IsEmpty());
}

TEST_F(RecordingReaderTest, ACountOfZeroReadsToTheEnd) {
  EXPECT_THAT(read(recording(counted(0), {photon_record(1, 5), sync_record(7)})), SizeIs(2));
  EXPECT_THAT(warnings_, ElementsAre(HasSubstr("record count is 0")));
}

TEST_F(RecordingReaderTest, ANegativeCountReadsToTheEndToo) {
  std::string content = recording(counted(1), {photon_record(1, 5), sync_record(7)});
  test::set_ptu_tag(content, "TTResult_NumberOfRecords", std::int64_t{-4'294'957'425});
  EXPECT_THAT(read(content), ElementsAre(photon_tag(5, 1), sync_tag(7)));
  EXPECT_EQ(records_, 2U);
  EXPECT_THAT(warnings_, ElementsAre(HasSubstr("record count is 0")));
}

TEST_F(RecordingReaderTest, WhatTheHeaderSaysAndIsNotTakenIsAWarning) {
  EXPECT_THAT(read(test::pico_harp_recording(2, {1U << 28U | 6U}, 0, 8)),
              ElementsAre(photon_tag(24, 1)));
  EXPECT_THAT(warnings_,
              ElementsAre(AllOf(HasSubstr("made.ptu: the header has a resolution of 0.008 ns"),
                                HasSubstr("steps of 0.004 ns"))));
}

TEST_F(RecordingReaderTest, ACountTooLargeReadsToTheEnd) {
  EXPECT_THAT(read(recording(counted(9), {photon_record(1, 5), sync_record(7)})), SizeIs(2));
  EXPECT_THAT(warnings_, ElementsAre(AllOf(HasSubstr("counts 9"), HasSubstr("holds 2"))));
}

TEST_F(RecordingReaderTest, WhatFollowsTheLastCountedRecordIsLeftOut) {
  EXPECT_THAT(read(recording(counted(1), {photon_record(1, 5), sync_record(7)})), SizeIs(1));
  EXPECT_THAT(warnings_, ElementsAre(AllOf(HasSubstr("byte " + std::to_string(header_bytes_ + 4)),
                                           HasSubstr("left out"))));
}

TEST_F(RecordingReaderTest, ACutRecordIsAWarningWithItsPlace) {
  std::string content = recording(counted(2), {photon_record(1, 5), sync_record(7)});
  content.resize(content.size() - 1);
  EXPECT_THAT(read(content), SizeIs(1));
  EXPECT_THAT(warnings_, ElementsAre(AllOf(HasSubstr("byte " + std::to_string(header_bytes_ + 4)),
                                           HasSubstr("3 of 4 bytes")),
                                     HasSubstr("holds 1")));
}

// Two and a half buffers of 1 MiB, with the records' bytes across their edges.
TEST_F(RecordingReaderTest, ReadsFilesLargerThanItsMemory) {
  constexpr std::uint32_t records = 650'000;
  std::string content = recording(counted(records), {});
  for (std::uint32_t i = 0; i < records; ++i) {
    for (unsigned shift = 0; shift < 32; shift += 8) {
      content.push_back(static_cast<char>((photon_record(1, i) >> shift) & 0xFFU));
    }
  }
  const auto tags = read(content, 777);
  ASSERT_EQ(tags.size(), records);
  for (std::uint32_t i = 0; i < records; ++i) ASSERT_EQ(tags[i], photon_tag(i, 1));
  EXPECT_THAT(warnings_, IsEmpty());
}

// After ten minutes 20 ppm are 12 ms.
TEST_F(RecordingReaderTest, LossesOfT3FollowThePatternsPeriod) {
  PtuFacts facts = counted(0);
  facts.t3 = PtuT3Facts{3.7800003e-6, 128e-12};
  facts.losses = {{600'000'000'000'000, 600'000'000'003'780, 1}};
  const std::string file = folder_.write("made.ptu", recording(facts, {}));
  const auto losses = [&](double period_ps) {
    return RecordingReader(
               file, [](auto&) {}, period_ps)
        .header()
        .losses;
  };
  EXPECT_THAT(losses(3'780'000), ElementsAre(Loss{600'000'000'000'000, 600'000'000'003'780, 1}));
  EXPECT_THAT(losses(3'780'075.6), ElementsAre(Loss{600'012'000'000'000, 600'012'000'003'780, 1}));
  EXPECT_THAT(losses(0), ElementsAre(Loss{600'000'047'619'048, 600'000'047'622'828, 1}));
}

TEST_F(RecordingReaderTest, HeadersLargerThanItsMemoryAreRead) {
  PtuFacts facts = counted(1);
  facts.pattern_json = std::string(3'000'000, 'x');
  EXPECT_THAT(read(recording(facts, {photon_record(2, 9)})), ElementsAre(photon_tag(9, 2)));
}

TEST_F(RecordingReaderTest, ErrorsNameTheFileAndThePlace) {
  const auto error = [this](const std::string& content) {
    return test::error_text([&] { read(content); });
  };
  const std::string whole = recording(counted(1), {photon_record(1, 5)});
  EXPECT_THAT(error("no recording"), AllOf(HasSubstr("made.ptu"), HasSubstr("known format")));
  EXPECT_THAT(error(""), AllOf(HasSubstr("made.ptu"), HasSubstr("known format")));
  EXPECT_THAT(error(whole.substr(0, 300)), AllOf(HasSubstr("made.ptu"), HasSubstr("byte")));
  EXPECT_THAT(test::error_text([] { RecordingReader("/nonexistent.ptu", [](auto&) {}); }),
              AllOf(HasSubstr("/nonexistent.ptu"), HasSubstr("No such file")));
  EXPECT_THAT(test::error_text([this] { RecordingReader(folder_.path(""), [](auto&) {}); }),
              AllOf(HasSubstr("byte 0"), HasSubstr("directory")));
}

}  // namespace
}  // namespace splid
