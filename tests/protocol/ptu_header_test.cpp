#include "protocol/ptu_header.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <string>

#include "protocol/error.hpp"
#include "tests/support/ptu_bytes.hpp"
#include "tests/support/real_recording.hpp"

namespace splid {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr auto integer_type = static_cast<std::uint32_t>(PtuTagType::integer);

// A header made tag by tag, also wrong ones.
class HeaderBytes {
 public:
  HeaderBytes() { text("PQTTTR", 8).text("1.0.00", 8); }

  HeaderBytes& text(const std::string& chars, std::size_t room) {
    for (std::size_t i = 0; i < room; ++i) {
      bytes.push_back(i < chars.size() ? static_cast<std::byte>(chars[i]) : std::byte{0});
    }
    return *this;
  }
  HeaderBytes& number(std::uint64_t value, unsigned count) {
    for (unsigned i = 0; i < count; ++i) {
      bytes.push_back(static_cast<std::byte>((value >> (8 * i)) & 0xFFU));
    }
    return *this;
  }
  HeaderBytes& tag(const std::string& name, std::uint32_t type, std::uint64_t value,
                   std::uint32_t index = 0xFFFFFFFF) {
    return text(name, 32).number(index, 4).number(type, 4).number(value, 8);
  }
  HeaderBytes& integer(const std::string& name, std::uint64_t value) {
    return tag(name, integer_type, value);
  }
  HeaderBytes& real(const std::string& name, double value) {
    return tag(name, static_cast<std::uint32_t>(PtuTagType::real),
               std::bit_cast<std::uint64_t>(value));
  }
  HeaderBytes& end() { return tag("Header_End", static_cast<std::uint32_t>(PtuTagType::empty), 0); }

  std::vector<std::byte> bytes;
};

HeaderBytes usual(std::uint64_t record_type = 0x01010204, double resolution_s = 1e-12) {
  return HeaderBytes()
      .integer("TTResultFormat_TTTRRecType", record_type)
      .real("MeasDesc_GlobalResolution", resolution_s);
}

std::string error_of(const std::vector<std::byte>& bytes) {
  try {
    (void)parse_ptu_header(bytes, true);
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::data);
    return error.what();
  }
  return "no error";
}

TEST(PtuHeader, EveryShorterPrefixNeedsMoreOrIsCut) {
  PtuFacts small;
  small.losses_room_bytes = 128;
  const auto bytes = make_ptu_header(small);
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    const auto prefix = std::span(bytes).first(length);
    EXPECT_FALSE(parse_ptu_header(prefix, false)) << length;
    try {
      (void)parse_ptu_header(prefix, true);
      ADD_FAILURE() << "accepted a header cut at byte " << length;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr("byte " + std::to_string(length) + ":"));
    }
  }
}

TEST(PtuHeader, KeepsAllTagsAsTheyStand) {
  auto bytes = usual();
  bytes.tag("HWInpChan_CFDLevel", integer_type, static_cast<std::uint64_t>(-90), 3)
      .tag("HW_ExternalRefClock", static_cast<std::uint32_t>(PtuTagType::boolean), 1)
      .tag("SomeArray", static_cast<std::uint32_t>(PtuTagType::real_array), 8)
      .number(0x0102030405060708, 8)
      .tag("SomeBlob", static_cast<std::uint32_t>(PtuTagType::blob), 3)
      .text("a\0b", 1)
      .number(0x6200, 2)
      .end();
  const auto header = parse_ptu_header(bytes.bytes, true);
  ASSERT_EQ(header->tags.size(), 6U);
  EXPECT_EQ(header->find("HWInpChan_CFDLevel", 3)->value,
            (std::variant<std::int64_t, double, std::string>(std::int64_t{-90})));
  EXPECT_EQ(header->find("HWInpChan_CFDLevel"), nullptr);
  EXPECT_EQ(header->find("HWInpChan_CFDLevel", 3)->offset, 16U + 2 * 48U);
  EXPECT_EQ(header->integer("HW_ExternalRefClock"), 1);
  EXPECT_EQ(std::get<std::string>(header->find("SomeArray")->value),
            "\x08\x07\x06\x05\x04\x03\x02\x01");
  EXPECT_EQ(std::get<std::string>(header->find("SomeBlob")->value), std::string("a\0b", 3));
  EXPECT_EQ(header->header_bytes, bytes.bytes.size());
  EXPECT_EQ(header->record_count, 0U);
  EXPECT_FALSE(header->created_unix_s);
}

TEST(PtuHeader, KnowsAllT2RecordTypes) {
  for (const std::uint32_t type :
       {0x00010203U, 0x00010204U, 0x00010205U, 0x00010206U, 0x00010207U, 0x01010204U}) {
    const auto header = parse_ptu_header(usual(type).end().bytes, true);
    EXPECT_EQ(header->record_type, static_cast<RecordType>(type));
  }
}

TEST(PtuHeader, KnowsAllT3RecordTypes) {
  for (const std::uint32_t type :
       {0x00010303U, 0x00010304U, 0x00010305U, 0x00010306U, 0x00010307U, 0x01010304U}) {
    const auto header = parse_ptu_header(
        usual(type, 3.78e-6).real("MeasDesc_Resolution", 64e-12).end().bytes, true);
    EXPECT_EQ(header->record_type, static_cast<RecordType>(type));
    EXPECT_TRUE(header->is_t3);
    EXPECT_EQ(header->sync_period_s, 3.78e-6);
    EXPECT_EQ(header->resolution_s, 64e-12);
  }
  const auto t2 = parse_ptu_header(usual().end().bytes, true);
  EXPECT_FALSE(t2->is_t3);
  EXPECT_EQ(t2->sync_period_s, 0);
  EXPECT_THAT(error_of(usual(0x01010304, 3.78e-6).end().bytes),
              HasSubstr("MeasDesc_Resolution is missing"));
  EXPECT_THAT(error_of(usual(0x01010304, 2).real("MeasDesc_Resolution", 64e-12).end().bytes),
              HasSubstr("MeasDesc_GlobalResolution is 2 s; it must be from 1e-12 to 1 s"));
}

TEST(PtuHeader, RefusesAnotherModeThanTheRecords) {
  EXPECT_THAT(error_of(usual().integer("Measurement_Mode", 3).end().bytes),
              testing::AllOf(HasSubstr("byte 112"), HasSubstr("is 3 (T3), and the record type"),
                             HasSubstr("is of mode 2")));
  EXPECT_THAT(error_of(usual(0x00010307, 3.78e-6).integer("Measurement_Mode", 2).end().bytes),
              HasSubstr("is of mode 3"));
  EXPECT_THAT(error_of(usual().integer("Measurement_Mode", 0).end().bytes),
              HasSubstr("Measurement_Mode is 0"));
}

TEST(PtuHeader, RefusesWhatMakesNoSense) {
  EXPECT_THAT(error_of(usual(0x00010208).end().bytes),
              testing::AllOf(HasSubstr("byte 16"), HasSubstr("0x00010208")));
  EXPECT_THAT(error_of(usual(0x01010204, 0.0).end().bytes),
              testing::AllOf(HasSubstr("byte 64"), HasSubstr("is 0 s")));
  EXPECT_THAT(error_of(usual(0x01010204, 1e-20).end().bytes), HasSubstr("is 1e-20 s"));
  EXPECT_THAT(error_of(usual(0x01010204, std::nan("")).end().bytes), HasSubstr("Resolution"));
  EXPECT_THAT(error_of(usual().integer("TTResultFormat_BitsPerRecord", 64).end().bytes),
              HasSubstr("is 64"));
  EXPECT_THAT(error_of(HeaderBytes().end().bytes), HasSubstr("TTTRRecType is missing"));
  EXPECT_THAT(error_of(HeaderBytes().real("TTResultFormat_TTTRRecType", 1).end().bytes),
              HasSubstr("wrong type"));
}

// As a recorder writes it that counts in 32 bits; a stopped one leaves 0.
TEST(PtuHeader, ANegativeRecordCountIsNone) {
  const auto count = [](std::uint64_t told) {
    const auto bytes = usual().integer("TTResult_NumberOfRecords", told).end().bytes;
    return parse_ptu_header(bytes, true).value().record_count;
  };
  EXPECT_EQ(count(0xFFFF'FFFF'0000'268FU), 0U);
  EXPECT_EQ(count(~0ULL), 0U);
  EXPECT_EQ(count(0), 0U);
  EXPECT_EQ(count(1), 1U);
}

TEST(PtuHeader, RefusesDamagedEntries) {
  EXPECT_THAT(error_of(usual().tag("Odd", 0x12345678, 0).end().bytes),
              testing::AllOf(HasSubstr("byte 148"), HasSubstr("0x12345678")));
  EXPECT_THAT(error_of(usual().tag("", integer_type, 0).end().bytes),
              HasSubstr("byte 112: a tag without a name"));
  EXPECT_THAT(error_of(usual().tag("Long", 0x4001FFFF, ~0ULL).end().bytes),
              testing::AllOf(HasSubstr("byte 152"), HasSubstr("18446744073709551615")));
  EXPECT_THAT(error_of(usual().tag("Splid_Origin_ps", 0x4001FFFF, 8).text("12x", 8).end().bytes),
              HasSubstr("not a whole number: 12x"));
  EXPECT_THAT(error_of(usual().tag("Splid_Losses", 0x4001FFFF, 8).text("9:1:2", 8).end().bytes),
              HasSubstr("Splid_Losses is not a list"));
  EXPECT_THAT(error_of(usual().tag("Splid_Inputs", 0x4001FFFF, 8).text("64:1", 8).end().bytes),
              HasSubstr("Splid_Inputs is not a list of channel:input, each once: 64:1"));
}

TEST(PtuHeader, RefusesOtherFiles) {
  for (const std::string text : {"not a PTU file, but some text", "PQHISTO", "PQTTTX"}) {
    std::vector<std::byte> bytes;
    for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
    EXPECT_THAT(error_of(bytes), HasSubstr("not a PTU recording"));
  }
  EXPECT_THAT(error_of({}), HasSubstr("ends within its header"));
}

TEST(PtuHeader, HydraHarpRecording) {
  const auto file = test::real_recording_path("hydraharp400_t2_hbt.ptu");
  if (!std::filesystem::exists(file))
    GTEST_SKIP() << "needs hydraharp400_t2_hbt.ptu in the folder SPLID_DATA";
  const auto header = parse_ptu_header(test::file_bytes(file), true);
  EXPECT_EQ(header->header_bytes, 4'392U);
  EXPECT_EQ(header->tags.size(), 87U);
  EXPECT_EQ(header->record_type, RecordType::hydra_harp_v2);
  EXPECT_EQ(header->record_count, 409'482U);
  EXPECT_EQ(header->text("HW_Type"), "HydraHarp 400");
  EXPECT_NEAR(header->created_unix_s.value(), (43'865.52570115322 - 25'569) * 86'400, 1e-4);
  EXPECT_EQ(header->origin_ps, 0);
  EXPECT_THAT(header->losses, testing::IsEmpty());
}

}  // namespace
}  // namespace splid
