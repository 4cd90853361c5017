#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/ptu_header.hpp"

namespace splid {
namespace {

using testing::HasSubstr;

PtuFacts facts() {
  PtuFacts facts;
  facts.created_unix_s = 1'774'000'000.25;
  facts.origin_ps = -340'000'000'000'000'001;
  facts.record_count = 12'345;
  facts.acquisition_ms = 10'000;
  facts.sync_rate_hz = 264'550;
  facts.instrument = "quTAG";
  facts.release = "1.2.3";
  facts.comment = "moving target";
  facts.pattern_json = R"({"schema":"splid.pattern"})";
  facts.config_json = R"({"schema":"splid.config"})";
  facts.losses = {{1'000, 2'500, 3}, {9'000, 9'000, 1}, {12'000, 15'000, -1}};
  return facts;
}

TEST(PtuHeaderWrite, RoundTrip) {
  const auto bytes = make_ptu_header(facts());
  const auto header = parse_ptu_header(bytes, false);
  ASSERT_TRUE(header);
  EXPECT_EQ(header->record_type, RecordType::hydra_harp_v2);
  EXPECT_EQ(header->resolution_s, 1e-12);
  EXPECT_EQ(header->record_count, 12'345U);
  EXPECT_EQ(header->header_bytes, bytes.size());
  EXPECT_NEAR(header->created_unix_s.value(), 1'774'000'000.25, 1e-6);
  EXPECT_EQ(header->origin_ps, -340'000'000'000'000'001);
  EXPECT_EQ(header->pattern_json, R"({"schema":"splid.pattern"})");
  EXPECT_EQ(header->config_json, R"({"schema":"splid.config"})");
  EXPECT_EQ(header->losses, facts().losses);
  EXPECT_EQ(header->text("Splid_Encoder"), std::nullopt);
}

TEST(PtuHeaderWrite, TheRecordCountCanBeSetInPlace) {
  for (const std::uint64_t count : {0ULL, 1ULL, 0x0123456789ABCDEFULL}) {
    PtuFacts counted = facts();
    counted.record_count = count;
    std::vector<std::byte> bytes = make_ptu_header(facts());
    set_ptu_record_count(bytes, count);
    EXPECT_EQ(bytes, make_ptu_header(counted));
  }
  // On one page, so that the system writes it at once.
  EXPECT_EQ(ptu_record_count_at(make_ptu_header(facts()).size()) % 8, 0U);
}

TEST(PtuHeaderWrite, TheEncodersFileIsNamedWhereThereIsOne) {
  PtuFacts with_encoder = facts();
  with_encoder.encoder_file = "rail.ptu.encoder.csv";
  const auto header = parse_ptu_header(make_ptu_header(with_encoder), true);
  EXPECT_EQ(header->text("Splid_Encoder"), "rail.ptu.encoder.csv");
}

TEST(PtuHeaderWrite, HasTheTagsThatReadersNeed) {
  const auto header = parse_ptu_header(make_ptu_header(facts()), true);
  EXPECT_THAT(header->text("File_GUID").value(),
              testing::MatchesRegex("\\{[0-9A-F]{8}-[0-9A-F]{4}-8[0-9A-F]{3}-[89AB][0-9A-F]{3}-"
                                    "[0-9A-F]{12}\\}"));
  EXPECT_EQ(header->text("File_Comment"), "moving target");
  EXPECT_EQ(header->text("CreatorSW_Name"), "splid");
  EXPECT_EQ(header->text("CreatorSW_Version"), "1.2.3");
  EXPECT_EQ(header->text("HW_Type"), "quTAG");
  EXPECT_NEAR(header->real("File_CreatingTime").value(), 25'569 + 1'774'000'000.25 / 86'400, 1e-9);
  EXPECT_EQ(header->integer("Measurement_Mode"), 2);
  EXPECT_EQ(header->integer("Measurement_SubMode"), 0);
  EXPECT_EQ(header->integer("MeasDesc_AcquisitionTime"), 10'000);
  EXPECT_EQ(header->integer("MeasDesc_BinningFactor"), 1);
  EXPECT_EQ(header->real("MeasDesc_GlobalResolution"), 1e-12);
  EXPECT_EQ(header->real("MeasDesc_Resolution"), 1e-12);
  EXPECT_EQ(header->integer("TTResult_SyncRate"), 264'550);
  EXPECT_EQ(header->integer("TTResult_NumberOfRecords"), 12'345);
  EXPECT_EQ(header->integer("TTResultFormat_TTTRRecType"), 0x01010204);
  EXPECT_EQ(header->integer("TTResultFormat_BitsPerRecord"), 32);
}

TEST(PtuHeaderWrite, LayoutIsWhatReadersInWideUseTake) {
  const auto bytes = make_ptu_header(facts());
  const std::string chars(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  EXPECT_EQ(chars.substr(0, 16), std::string("PQTTTR\0\0"
                                             "1.0.00\0\0",
                                             16));
  EXPECT_EQ(chars.find("Header_End"), chars.size() - 48);
  EXPECT_EQ(chars.rfind("Header_End"), chars.size() - 48);
  EXPECT_EQ(chars.substr(chars.size() - 48),
            std::string("Header_End") + std::string(22, '\0') +
                std::string("\xFF\xFF\xFF\xFF\x08\x00\xFF\xFF\0\0\0\0\0\0\0\0", 16));
  EXPECT_EQ(bytes.size() % 8, 0U);
  const auto header = parse_ptu_header(bytes, true);
  for (const PtuTag& tag : header->tags) {
    EXPECT_EQ(tag.offset % 8, 0U) << tag.name;
    EXPECT_NE(tag.type, PtuTagType::wide_string) << tag.name;
    EXPECT_NE(tag.type, PtuTagType::real_array) << tag.name;
    EXPECT_NE(tag.type, PtuTagType::blob) << tag.name;
  }
}

TEST(PtuHeaderWrite, StringsEndInANulWhateverTheirLength) {
  PtuFacts some = facts();
  for (std::size_t length = 0; length <= 17; ++length) {
    some.comment = std::string(length, 'x');
    EXPECT_EQ(parse_ptu_header(make_ptu_header(some), true)->text("File_Comment"), some.comment);
  }
  some.comment = "exactly 8";
  some.comment.resize(8);
  const auto with_8 = make_ptu_header(some).size();
  some.comment.resize(7);
  EXPECT_EQ(with_8 - make_ptu_header(some).size(), 8U) << "8 letters need a NUL of their own";
  some.comment = std::string("cut\0here", 8);
  EXPECT_EQ(parse_ptu_header(make_ptu_header(some), true)->text("File_Comment"), "cut");
}

TEST(PtuHeaderWrite, RewritingWithLaterFactsKeepsTheSize) {
  PtuFacts at_start = facts();
  at_start.record_count = 0;
  at_start.acquisition_ms = 0;
  at_start.origin_ps = 0;
  at_start.losses.clear();
  PtuFacts at_end = facts();
  at_end.record_count = 1ULL << 60U;
  at_end.origin_ps = INT64_MIN;
  at_end.losses.clear();
  for (std::int64_t i = 0; i < 5'000; ++i) {
    at_end.losses.push_back({i * 1'000'000'007, i * 1'000'000'007 + 1'000, 2});
  }
  EXPECT_EQ(make_ptu_header(at_end).size(), make_ptu_header(at_start).size());
  const auto header = parse_ptu_header(make_ptu_header(at_end), true);
  EXPECT_EQ(header->origin_ps, INT64_MIN);
  std::int64_t count = 0;
  std::int64_t length_ps = 0;
  for (const Loss& loss : header->losses) {
    count += loss.count;
    length_ps += loss.end_ps - loss.begin_ps;
  }
  EXPECT_EQ(count, 10'000);
  EXPECT_EQ(length_ps, 5'000'000);
  EXPECT_THAT(header->losses, testing::SizeIs(testing::Gt(1'000)));
}

TEST(PtuHeaderWrite, TheSameFactsGiveTheSameBytes) {
  EXPECT_EQ(make_ptu_header(facts()), make_ptu_header(facts()));
  PtuFacts other = facts();
  other.created_unix_s += 1;
  EXPECT_NE(parse_ptu_header(make_ptu_header(other), true)->text("File_GUID"),
            parse_ptu_header(make_ptu_header(facts()), true)->text("File_GUID"));
  other.guid = "{00000000-0000-0000-0000-000000000001}";
  EXPECT_EQ(parse_ptu_header(make_ptu_header(other), true)->text("File_GUID"), other.guid);
}

TEST(PtuHeaderWrite, TheWordsHeaderEndAreRefusedInAString) {
  PtuFacts bad = facts();
  bad.config_json = "a Header_End b";
  try {
    (void)make_ptu_header(bad);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("Splid_Config"));
  }
}

}  // namespace
}  // namespace splid
