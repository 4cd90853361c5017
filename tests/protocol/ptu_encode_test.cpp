#include "protocol/ptu_encode.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <span>
#include <vector>

#include "protocol/ptu_decode.hpp"
#include "tests/support/ptu_bytes.hpp"

namespace splid {
namespace {

using test::record_bytes;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::int64_t encoded_wrap = 33'554'432;
constexpr std::int64_t us = 1'000'000;
constexpr std::int64_t second = 1'000'000 * us;

std::vector<std::byte> encoded(PtuEncoder& encoder, const std::vector<Tag>& tags) {
  std::vector<std::byte> bytes;
  encoder.encode(tags, bytes);
  encoder.flush(bytes);
  return bytes;
}

std::vector<Tag> decoded(const std::vector<std::byte>& bytes, std::int64_t origin_ps = 0) {
  PtuDecoder decoder(RecordType::hydra_harp_v2, 1e-12, origin_ps);
  return test::decode_all(decoder, bytes);
}

TEST(PtuEncode, BytesOfEachKind) {
  PtuEncoder encoder(0);
  EXPECT_EQ(encoded(encoder, {photon_tag(5, 1), photon_tag(6, 62), sync_tag(7), marker_tag(8, 1),
                              marker_tag(33'554'431, 15), photon_tag(encoded_wrap, 2)}),
            record_bytes({0x02000005, 0x7C000006, 0x80000007, 0x82000008, 0x9FFFFFFF, 0xFE000001,
                          0x04000000}));
  EXPECT_EQ(encoder.records(), 7U);
  EXPECT_EQ(encoder.rejected(), 0U);
}

TEST(PtuEncode, NothingGivesNothing) {
  PtuEncoder encoder(0);
  EXPECT_THAT(encoded(encoder, {}), IsEmpty());
  EXPECT_THAT(encoded(encoder, {heartbeat_tag(5 * second)}), IsEmpty());
  EXPECT_EQ(encoder.now_ps(), 5 * second);
}

TEST(PtuEncode, OverflowsCountAtMost127ARecord) {
  PtuEncoder encoder(0);
  EXPECT_EQ(
      encoded(encoder, {photon_tag(127 * encoded_wrap, 1), photon_tag(255 * encoded_wrap + 3, 1)}),
      record_bytes({0xFE00007F, 0x02000000, 0xFE00007F, 0xFE000001, 0x02000003}));
}

TEST(PtuEncode, TagsAreToldFromOverflows) {
  EXPECT_EQ(ptu_tags({}), 0U);
  EXPECT_EQ(ptu_tags(record_bytes({0x02000005})), 1U);
  EXPECT_EQ(ptu_tags(record_bytes({0xFE00007F, 0x7DFFFFFF, 0xFE000001, 0x81FFFFFF, 0x9FFFFFFF})),
            3U);
  const auto cut = record_bytes({0x02000005, 0x02000006});
  EXPECT_EQ(ptu_tags(std::span(cut).first(7)), 1U);
}

TEST(PtuEncode, GapsOfMinutes) {
  PtuEncoder encoder(0);
  const std::vector<Tag> tags = {photon_tag(1, 1), photon_tag(180 * second + 17, 1),
                                 sync_tag(3'600 * second)};
  const auto bytes = encoded(encoder, tags);
  EXPECT_EQ(decoded(bytes), tags);
  // 3600 s are 107,288,360 wraps.
  EXPECT_THAT(bytes.size() / 4, testing::AllOf(testing::Ge(107'288'360 / 127 + 3),
                                               testing::Le(107'288'360 / 127 + 6)));
}

TEST(PtuEncode, CountsFromTheOrigin) {
  const std::int64_t origin_ps = 340'000'000'000'000'001;
  PtuEncoder encoder(origin_ps);
  const std::vector<Tag> tags = {photon_tag(origin_ps, 1),
                                 photon_tag(origin_ps + 9 * encoded_wrap, 1)};
  const auto bytes = encoded(encoder, tags);
  EXPECT_EQ(decoded(bytes, origin_ps), tags);
  EXPECT_EQ(decoded(bytes)[0].time_ps, 0);
}

TEST(PtuEncode, SlightDisorderIsSorted) {
  PtuEncoder encoder(0);
  const std::vector<Tag> tags = {photon_tag(2 * us, 1), sync_tag(us), photon_tag(us + 1, 2),
                                 photon_tag(2 * us, 3), photon_tag(us + 1, 4)};
  EXPECT_THAT(decoded(encoded(encoder, tags)),
              ElementsAre(sync_tag(us), photon_tag(us + 1, 2), photon_tag(us + 1, 4),
                          photon_tag(2 * us, 1), photon_tag(2 * us, 3)));
  EXPECT_EQ(encoder.rejected(), 0U);
}

TEST(PtuEncode, ATagOneMicrosecondBehindIsStillInTime) {
  PtuEncoder encoder(0);
  EXPECT_THAT(decoded(encoded(encoder, {photon_tag(us, 1), photon_tag(2 * us, 1), sync_tag(us)})),
              ElementsAre(photon_tag(us, 1), sync_tag(us), photon_tag(2 * us, 1)));
}

TEST(PtuEncode, WhatComesTooLateIsLostNotWrittenBackwards) {
  PtuEncoder encoder(0);
  const auto bytes = encoded(encoder, {photon_tag(10 * us, 1), photon_tag(20 * us, 1),
                                       photon_tag(9 * us, 1), photon_tag(30 * us, 1)});
  EXPECT_THAT(decoded(bytes),
              ElementsAre(photon_tag(10 * us, 1), photon_tag(20 * us, 1), photon_tag(30 * us, 1)));
  EXPECT_EQ(encoder.rejected(), 1U);
  EXPECT_THAT(encoder.losses().losses(0), ElementsAre(Loss{9 * us, 9 * us, 1}));
}

TEST(PtuEncode, WhatNoRecordHoldsIsLost) {
  PtuEncoder encoder(100);
  EXPECT_THAT(encoded(encoder, {photon_tag(99, 1), marker_tag(200, 0), marker_tag(200, 16)}),
              IsEmpty());
  EXPECT_EQ(encoder.rejected(), 3U);
  EXPECT_THAT(encoder.losses().losses(200), ElementsAre(Loss{99, 99, 3}));
}

TEST(PtuEncode, PhotonsOfAnySixtyFourInputsComeBack) {
  PtuEncoder encoder(0);
  std::vector<Tag> tags;
  for (const int input : {1, -1, 0, 62, 63, -128, 126, 30'000}) {
    tags.push_back(photon_tag(10 * static_cast<std::int64_t>(tags.size()), input));
  }
  for (int input = 2; input < 58; ++input) tags.push_back(photon_tag(1'000, input));
  const auto bytes = encoded(encoder, tags);
  PtuDecoder decoder(RecordType::hydra_harp_v2, 1e-12, 0, encoder.inputs());
  EXPECT_EQ(test::decode_all(decoder, bytes), tags);
  EXPECT_EQ(encoder.rejected(), 0U);
  EXPECT_THAT(encoded(encoder, {photon_tag(2'000, 58)}), IsEmpty());
  EXPECT_EQ(encoder.rejected(), 1U);
}

TEST(PtuEncode, LossesGoToTheHeaderNotTheRecords) {
  PtuEncoder encoder(0);
  const auto bytes = encoded(encoder, {photon_tag(5, 1),
                                       {1'000, 0, TagKind::loss_begin, {}},
                                       {3'000, 17, TagKind::loss_end, {}},
                                       photon_tag(4'000, 1),
                                       {5'000, 2, TagKind::missed, {}}});
  EXPECT_THAT(decoded(bytes), ElementsAre(photon_tag(5, 1), photon_tag(4'000, 1)));
  EXPECT_THAT(encoder.losses().losses(9'000),
              ElementsAre(Loss{1'000, 3'000, 17}, Loss{5'000, 5'000, 2}));
}

TEST(PtuEncode, HeartbeatsLetWaitingTagsOut) {
  PtuEncoder encoder(0);
  std::vector<std::byte> bytes;
  encoder.encode(std::vector<Tag>{photon_tag(5, 1)}, bytes);
  EXPECT_THAT(bytes, IsEmpty());
  encoder.encode(std::vector<Tag>{heartbeat_tag(us + 4)}, bytes);
  EXPECT_THAT(bytes, IsEmpty());
  encoder.encode(std::vector<Tag>{heartbeat_tag(us + 5)}, bytes);
  EXPECT_EQ(bytes.size(), 4U);
}

TEST(PtuEncode, AfterAClockBreakTimeGoesOn) {
  PtuEncoder encoder(0);
  const auto bytes = encoded(encoder, {photon_tag(50 * us, 1),
                                       {50 * us, 0, TagKind::clock_break, {}},
                                       photon_tag(7, 1),
                                       photon_tag(3, 2),
                                       photon_tag(us, 1)});
  EXPECT_THAT(
      decoded(bytes),
      ElementsAre(photon_tag(50 * us, 1), photon_tag(50 * us + second - 4, 2),
                  photon_tag(50 * us + second, 1), photon_tag(50 * us + second + us - 7, 1)));
  EXPECT_THAT(encoder.losses().losses(0), ElementsAre(Loss{50 * us, 50 * us + second, -1}));
}

// 8.7 GB of overflow records would say that 106 days have passed.
TEST(PtuEncode, ATagFarAheadIsAClockBreak) {
  constexpr std::int64_t last_ps = std::numeric_limits<std::int64_t>::max();
  PtuEncoder encoder(0);
  const auto bytes = encoded(encoder, {photon_tag(50 * us, 1), photon_tag(last_ps, 2)});
  EXPECT_THAT(decoded(bytes), ElementsAre(photon_tag(50 * us, 1), photon_tag(50 * us + second, 2)));
  EXPECT_THAT(encoder.losses().losses(0), ElementsAre(Loss{50 * us, 50 * us + second, -1}));
}

TEST(PtuEncode, AfterAClockBreakTimesMayBeAnywhereIn64Bits) {
  constexpr std::int64_t first_ps = std::numeric_limits<std::int64_t>::min();
  PtuEncoder encoder(0);
  const auto bytes = encoded(encoder, {photon_tag(50 * us, 1),
                                       {50 * us, 0, TagKind::clock_break, {}},
                                       photon_tag(first_ps, 1),
                                       photon_tag(first_ps + 9, 2)});
  EXPECT_THAT(decoded(bytes), ElementsAre(photon_tag(50 * us, 1), photon_tag(50 * us + second, 1),
                                          photon_tag(50 * us + second + 9, 2)));
}

TEST(PtuEncode, ABurstPastTheBufferIsWrittenEarlyAndWhole) {
  PtuEncoder encoder(0);
  std::vector<Tag> tags;
  for (int i = 0; i < 20'000; ++i) tags.push_back(photon_tag(i, 1));
  EXPECT_EQ(decoded(encoded(encoder, tags)), tags);
}

TEST(PtuEncode, RandomStreamsComeBackSorted) {
  std::mt19937 random(3);
  for (int round = 0; round < 20; ++round) {
    PtuEncoder encoder(0);
    std::vector<Tag> tags;
    std::int64_t now_ps = us;
    for (int i = 0; i < 3'000; ++i) {
      now_ps += static_cast<std::int64_t>(random() % (random() % 50 == 0 ? 2'000'000'000 : 80'000));
      const auto behind_ps = static_cast<std::int64_t>(random() % 400'000);
      const std::int64_t time_ps = now_ps - behind_ps;
      tags.push_back(random() % 4 == 0 ? sync_tag(time_ps) : photon_tag(time_ps, 1 + i % 62));
    }
    std::vector<std::byte> bytes;
    for (std::size_t at = 0; at < tags.size();) {
      const std::size_t count = std::min<std::size_t>(random() % 100, tags.size() - at);
      encoder.encode(std::span(tags).subspan(at, count), bytes);
      at += count;
    }
    encoder.flush(bytes);
    std::stable_sort(tags.begin(), tags.end(),
                     [](const Tag& a, const Tag& b) { return a.time_ps < b.time_ps; });
    EXPECT_EQ(decoded(bytes), tags) << "round " << round;
    EXPECT_EQ(encoder.rejected(), 0U);
    EXPECT_EQ(encoder.records(), bytes.size() / 4);
  }
}

}  // namespace
}  // namespace splid
