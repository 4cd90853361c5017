#include "protocol/ptu_t3_decode.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <vector>

#include "protocol/error.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/ptu_bytes.hpp"
#include "tests/support/t3_recording.hpp"

namespace splid {
namespace {

using test::record_bytes;
using test::t3_marker;
using test::t3_overflow;
using test::t3_photon;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double period_ps = 3'780'000;

std::vector<Tag> decode_all(PtuT3Decoder& decoder, std::span<const std::byte> records) {
  std::vector<Tag> tags(records.size() / 2 + 1);
  const auto done = decoder.decode(records, tags);
  EXPECT_EQ(done.bytes, records.size());
  tags.resize(done.tags);
  return tags;
}

Tag missed(std::int64_t time_ps, std::uint8_t input) {
  return {time_ps, 1, TagKind::missed, {input, 0, 0}};
}

TEST(PtuT3Decoder, APhotonIsAfterItsSyncByItsTime) {
  PtuT3Decoder decoder(RecordType::hydra_harp_v2_t3, period_ps, 64e-12);
  const auto records = record_bytes({t3_photon(0, 0, 0), t3_photon(1, 10, 0), t3_photon(5, 2, 3),
                                     t3_marker(1, 3), t3_marker(15, 4)});
  EXPECT_THAT(
      decode_all(decoder, records),
      ElementsAre(sync_tag(0), photon_tag(0, 0), photon_tag(640, 1), sync_tag(3 * 3'780'000),
                  photon_tag(3 * 3'780'000 + 128, 5), marker_tag(3 * 3'780'000, 1),
                  sync_tag(4 * 3'780'000), marker_tag(4 * 3'780'000, 15)));
  EXPECT_EQ(decoder.reached_ps(), 4 * 3'780'000);
}

TEST(PtuT3Decoder, OverflowsMoveTheNumberOn) {
  const auto at = [](RecordType type, std::initializer_list<std::uint32_t> records) {
    PtuT3Decoder decoder(type, 1000, 1e-12);
    const auto tags = decode_all(decoder, record_bytes(records));
    return tags.empty() ? decoder.reached_ps() : tags.back().time_ps;
  };
  using Type = RecordType;
  for (const Type type : {Type::hydra_harp_v2_t3, Type::generic_t3, Type::time_harp_260_nano_t3,
                          Type::time_harp_260_pico_t3}) {
    EXPECT_EQ(at(type, {t3_overflow(0), t3_photon(0, 7, 1)}), 1025 * 1000 + 7);
    EXPECT_EQ(at(type, {t3_overflow(1)}), 1024 * 1000);
    EXPECT_EQ(at(type, {t3_overflow(1023), t3_overflow(2), t3_photon(0, 0, 1023)}),
              (1025 * 1024 + 1023) * 1000);
  }
  EXPECT_EQ(at(Type::hydra_harp_v1_t3, {t3_overflow(9), t3_photon(0, 7, 1)}), 1025 * 1000 + 7);
  // PicoHarp: 16 bits of sync, 12 bits of time, 4 of channel.
  EXPECT_EQ(at(Type::pico_harp_t3, {0xF0000000U, 0x10070001U}), 65'537 * 1000 + 7);
}

TEST(PtuT3Decoder, PicoHarpsRecords) {
  PtuT3Decoder decoder(RecordType::pico_harp_t3, 1000, 1e-12);
  EXPECT_THAT(decode_all(decoder, record_bytes({0x10050002U, 0xE0FE0002U, 0xF0030002U, 0xF0000000U,
                                                0x2FFF0000U})),
              ElementsAre(sync_tag(2000), photon_tag(2005, 1), photon_tag(2254, 14),
                          marker_tag(2000, 3), sync_tag(65'536'000), missed(65'536'000 + 4095, 2)));
  EXPECT_EQ(decoder.overflow_records(), 1U);
  EXPECT_EQ(decoder.saturated_photons(), 1U);
}

TEST(PtuT3Decoder, WhatIsTooLateForARecordIsLost) {
  PtuT3Decoder decoder(RecordType::generic_t3, 1e6, 4e-12);
  EXPECT_THAT(decode_all(decoder, record_bytes({t3_photon(2, 32'766, 0), t3_photon(2, 32'767, 0)})),
              ElementsAre(sync_tag(0), photon_tag(4 * 32'766, 2), missed(4 * 32'767, 2)));
  EXPECT_EQ(decoder.saturated_photons(), 1U);
}

TEST(PtuT3Decoder, UnknownSpecialRecordsAreCounted) {
  PtuT3Decoder decoder(RecordType::generic_t3, 1e6, 4e-12);
  EXPECT_TRUE(decode_all(decoder, record_bytes({t3_marker(0, 1), t3_marker(16, 2)})).empty());
  EXPECT_EQ(decoder.unknown_records(), 2U);
}

TEST(PtuT3Decoder, PeriodsThatAreNotWholeDoNotAddUp) {
  PtuT3Decoder decoder(RecordType::hydra_harp_v2_t3, 3'780'007.5625, 1e-12);
  std::vector<std::byte> records;
  for (int i = 0; i < 1000; ++i) {
    const auto some = record_bytes({t3_overflow(1000)});
    records.insert(records.end(), some.begin(), some.end());
  }
  EXPECT_TRUE(decode_all(decoder, records).empty());
  constexpr std::int64_t syncs = 1024 * 1'000'000;
  EXPECT_EQ(decoder.reached_ps(), syncs * 3'780'007 + syncs * 9 / 16);
}

TEST(PtuT3Decoder, PiecesAndRoomMakeNoDifference) {
  std::mt19937 random(5);
  std::vector<std::byte> records;
  for (int i = 0; i < 5'000; ++i) {
    const auto record = record_bytes({static_cast<std::uint32_t>(random())});
    records.insert(records.end(), record.begin(), record.end());
  }
  for (const auto type : {RecordType::pico_harp_t3, RecordType::generic_t3}) {
    PtuT3Decoder whole(type, period_ps, 64e-12);
    const std::vector<Tag> expected = decode_all(whole, records);
    PtuT3Decoder decoder(type, period_ps, 64e-12);
    std::vector<Tag> tags;
    std::span<const std::byte> rest = records;
    for (std::size_t i = 0;; ++i) {
      std::vector<Tag> room(1 + i % 3);
      const auto done =
          decoder.decode(rest.first(std::min<std::size_t>(rest.size(), i % 31)), room);
      rest = rest.subspan(done.bytes);
      tags.insert(tags.end(), room.begin(), room.begin() + static_cast<std::ptrdiff_t>(done.tags));
      if (rest.empty() && done.tags == 0) break;
    }
    EXPECT_EQ(tags, expected);
  }
}

// Photons in a row are decoded together: as many as there are, with an overflow anywhere, they have
// the times of photons alone.
TEST(PtuT3Decoder, RunsOfPhotonsAreLikeOthers) {
  for (std::size_t overflow_at = 0; overflow_at <= 40; ++overflow_at) {
    std::vector<std::byte> records;
    std::vector<Tag> expected;
    for (std::uint32_t i = 0; i < 40; ++i) {
      const bool is_before = i < overflow_at;
      if (i == overflow_at) {
        for (const std::byte byte : record_bytes({t3_overflow(1)})) records.push_back(byte);
      }
      const std::uint32_t ticks = i == 21 ? 32'767 : 100 * i;
      for (const std::byte byte : record_bytes({t3_photon(i, ticks, 5 + i / 2)})) {
        records.push_back(byte);
      }
      const std::int64_t sync_ps = 3'780'000LL * ((is_before ? 0 : 1024) + 5 + i / 2);
      const bool is_new = i % 2 == 0 || i == overflow_at;
      if (is_new) expected.push_back(sync_tag(sync_ps));
      expected.push_back(i == 21 ? missed(sync_ps + 64 * ticks, 21)
                                 : photon_tag(sync_ps + 64 * ticks, static_cast<int>(i)));
    }
    PtuT3Decoder decoder(RecordType::hydra_harp_v2_t3, period_ps, 64e-12);
    EXPECT_EQ(decode_all(decoder, records), expected) << overflow_at;
    EXPECT_EQ(decoder.saturated_photons(), 1U);
    EXPECT_EQ(decoder.reached_ps(), 3'780'000LL * ((overflow_at == 40 ? 0 : 1024) + 5 + 19));
  }
}

TEST(PtuT3Decoder, RefusesTimesThatMakeNoSense) {
  const auto refusal = [](double period, double resolution_s) {
    return test::error_text([&] { PtuT3Decoder(RecordType::generic_t3, period, resolution_s); });
  };
  EXPECT_THAT(refusal(0.5, 1e-12), HasSubstr("a time between syncs of 0.5 ps"));
  EXPECT_THAT(refusal(1e13, 1e-12), HasSubstr("must be from 1 to 1e12 ps"));
  EXPECT_THAT(refusal(1000, 0), HasSubstr("a resolution of 0 ps"));
}

}  // namespace
}  // namespace splid
