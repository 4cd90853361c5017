#include "protocol/ptu_t3_encode.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "protocol/ptu_t3_decode.hpp"

namespace splid {
namespace {

using ::testing::ElementsAre;

constexpr std::int64_t encoded_period_ps = 3'780'000;
constexpr double encoded_step_ps = 128;

std::vector<Tag> decoded_t3(std::span<const std::byte> records) {
  PtuT3Decoder decoder(RecordType::hydra_harp_v2_t3, static_cast<double>(encoded_period_ps),
                       encoded_step_ps * 1e-12);
  std::vector<Tag> tags(records.size() / 2 + 1);
  const auto done = decoder.decode(records, tags);
  EXPECT_EQ(done.bytes, records.size());
  tags.resize(done.tags);
  return tags;
}

TEST(PtuT3Encoder, TheDecoderGivesTheSameTags) {
  std::mt19937_64 random(3);
  std::vector<Tag> tags;
  std::int64_t number = 0;
  for (int i = 0; i < 3000; ++i) {
    // Now and then more syncs than one overflow record counts.
    number += i % 500 == 7 ? 3'000'000 : static_cast<std::int64_t>(1 + random() % 900);
    tags.push_back(sync_tag(number * encoded_period_ps));
    const auto since_ps = static_cast<std::int64_t>(random() % 32'767) * 128;
    if (i % 10 == 3) {
      tags.push_back(marker_tag(number * encoded_period_ps, 1 + i % 15));
    } else if (i % 10 == 4) {
      tags.push_back({number * encoded_period_ps + 32'767 * 128,
                      1,
                      TagKind::missed,
                      {static_cast<std::uint8_t>(random() % 63), 0, 0}});
    } else {
      tags.push_back(
          photon_tag(number * encoded_period_ps + since_ps, static_cast<int>(random() % 63)));
    }
  }
  PtuT3Encoder encoder(encoded_period_ps, encoded_step_ps);
  std::vector<std::byte> records;
  for (std::size_t at = 0; at < tags.size(); at += 7) {
    encoder.encode(std::span(tags).subspan(at, std::min<std::size_t>(7, tags.size() - at)),
                   records);
  }
  EXPECT_EQ(decoded_t3(records), tags);
  EXPECT_EQ(encoder.records(), records.size() / 4);
  EXPECT_EQ(encoder.rejected(), 0U);
  EXPECT_EQ(encoder.losses().lost_tags(), 0U);
}

TEST(PtuT3Encoder, WhatNoRecordHoldsIsALoss) {
  PtuT3Encoder encoder(encoded_period_ps, encoded_step_ps);
  std::vector<std::byte> records;
  encoder.encode(
      std::vector<Tag>{
          sync_tag(2000 * encoded_period_ps), photon_tag(2000 * encoded_period_ps, 64),
          photon_tag(2000 * encoded_period_ps, -1), marker_tag(2000 * encoded_period_ps, 16),
          marker_tag(2000 * encoded_period_ps, 0), photon_tag(2000 * encoded_period_ps - 1, 1)},
      records);
  EXPECT_TRUE(records.empty());
  EXPECT_EQ(encoder.rejected(), 5U);
  EXPECT_EQ(encoder.losses().lost_tags(), 5U);
}

// Syncs may step back where no overflow record stands between them.
TEST(PtuT3Encoder, SyncsThatStepBackAreKeptUpToAnOverflow) {
  const std::vector<Tag> tags = {
      sync_tag(1030 * encoded_period_ps), photon_tag(1030 * encoded_period_ps, 1),
      sync_tag(1027 * encoded_period_ps), photon_tag(1027 * encoded_period_ps + 128, 1)};
  PtuT3Encoder encoder(encoded_period_ps, encoded_step_ps);
  std::vector<std::byte> records;
  encoder.encode(tags, records);
  EXPECT_EQ(decoded_t3(records), tags);
  encoder.encode(
      std::vector<Tag>{sync_tag(1023 * encoded_period_ps), photon_tag(1023 * encoded_period_ps, 1)},
      records);
  EXPECT_EQ(decoded_t3(records), tags);
  EXPECT_EQ(encoder.losses().lost_tags(), 1U);
}

TEST(PtuT3Encoder, LossesOfTheStreamAreKept) {
  PtuT3Encoder encoder(encoded_period_ps, encoded_step_ps);
  std::vector<std::byte> records;
  encoder.encode(std::vector<Tag>{{5, 0, TagKind::loss_begin, {}}, {9, -1, TagKind::loss_end, {}}},
                 records);
  EXPECT_THAT(encoder.losses().losses(10), ElementsAre(Loss{5, 9, -1}));
}

}  // namespace
}  // namespace splid
