#include "drivers/usb/tdc2_decode.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <random>
#include <vector>

#include "tests/support/real_recording.hpp"
#include "tests/support/tags16_block.hpp"

namespace splid::usb {
namespace {

using ::testing::ElementsAre;

constexpr std::uint64_t most_units = (std::uint64_t{1} << 54U) - 1;

std::uint64_t record(std::uint64_t units, unsigned inputs, unsigned internal = 0) {
  return units << 10U | internal << 5U | inputs;
}

std::vector<Tag> decode(Tdc2Decoder& decoder, const std::vector<std::uint64_t>& records) {
  std::vector<std::byte> bytes;
  for (const std::uint64_t each : records) test::append_little_endian(each, bytes);
  std::vector<Tag> tags(records.size() * Tdc2Decoder::most_tags_a_record);
  const auto done = decoder.decode(bytes, tags);
  EXPECT_EQ(done.bytes, bytes.size());
  tags.resize(done.tags);
  return tags;
}

std::vector<Tag> decode(const std::vector<std::uint64_t>& records) {
  Tdc2Decoder decoder;
  return decode(decoder, records);
}

constexpr Tag clock_break(std::int64_t time_ps) { return {time_ps, 0, TagKind::clock_break, {}}; }
constexpr Tag missed(std::int64_t time_ps) { return {time_ps, 1, TagKind::missed, {}}; }

std::size_t count(const std::vector<Tag>& tags, TagKind kind) {
  return static_cast<std::size_t>(
      std::count_if(tags.begin(), tags.end(), [&](const Tag& tag) { return tag.kind == kind; }));
}

TEST(Tdc2Decode, ARecordIsPinned) {
  // 0x0102030405060708: 54 bits of time, internal 24, inputs 4.
  const std::vector<std::byte> bytes = {std::byte{8}, std::byte{7}, std::byte{6}, std::byte{5},
                                        std::byte{4}, std::byte{3}, std::byte{2}, std::byte{1}};
  std::array<Tag, 6> tags;
  Tdc2Decoder decoder;
  EXPECT_EQ(decoder.decode(bytes, tags).tags, 1U);
  // 70921738076545 units of 125/32 ps.
  EXPECT_EQ(0x0102030405060708U >> 10U, 70'921'738'076'545U);
  EXPECT_EQ(tags[0], photon_tag(277'038'039'361'504, 4));
}

// 3.90625 ps a unit: rounded each for itself.
TEST(Tdc2Decode, TimesAreRoundedWithoutAddingUp) {
  EXPECT_THAT(
      decode({record(0, 1), record(1, 1), record(2, 1), record(3, 1), record(32, 1), record(33, 1),
              record(32'000'000'000'001, 1)}),
      ElementsAre(photon_tag(0, 1), photon_tag(4, 1), photon_tag(8, 1), photon_tag(12, 1),
                  photon_tag(125, 1), photon_tag(129, 1), photon_tag(125'000'000'000'004, 1)));
}

TEST(Tdc2Decode, EachInputsBitIsATag) {
  EXPECT_THAT(
      decode({record(32, 0b1111, 25)}),
      ElementsAre(photon_tag(125, 1), photon_tag(125, 2), photon_tag(125, 3), photon_tag(125, 4)));
}

TEST(Tdc2Decode, DummiesAreHeartbeatsAndPaddingIsNothing) {
  Tdc2Decoder decoder;
  EXPECT_THAT(decode(decoder, {0, record(64, 0b10001), 0, record(96, 0)}),
              ElementsAre(heartbeat_tag(250)));
  EXPECT_EQ(decoder.reached_ps(), 375);
}

// 2^54 units are 2^49 times 125 ps, 19.5 h.
TEST(Tdc2Decode, TheCounterWrapsAround) {
  constexpr std::int64_t wrap_ps = (std::int64_t{1} << 49U) * 125;
  Tdc2Decoder decoder;
  EXPECT_THAT(decode(decoder, {record(most_units, 1), record(31, 1), record(0, 2)}),
              ElementsAre(photon_tag(wrap_ps - 4, 1), photon_tag(wrap_ps + 121, 1),
                          photon_tag(wrap_ps, 2)));
}

// In steps of a quarter of the counter: 53 days are 262 of those and a little.
TEST(Tdc2Decode, AClockThatNoLongerFitsGoesOnFrom0) {
  constexpr std::uint64_t quarter = std::uint64_t{1} << 52U;
  constexpr std::int64_t quarter_ps = (std::int64_t{1} << 47U) * 125;
  std::vector<std::uint64_t> records;
  for (std::uint64_t i = 0; i < 265; ++i) records.push_back(record(i * quarter & most_units, 1));
  const std::vector<Tag> tags = decode(records);
  ASSERT_EQ(tags.size(), 266U);
  EXPECT_EQ(tags[262], photon_tag(262 * quarter_ps, 1));
  EXPECT_EQ(tags[263], clock_break(262 * quarter_ps));
  EXPECT_EQ(tags[264], photon_tag(0, 1));
  EXPECT_EQ(tags[265], photon_tag(quarter_ps, 1));
}

TEST(Tdc2Decode, StepsBackUpToAMillisecondAreDisorder) {
  constexpr std::uint64_t ms = 256'000'000;
  EXPECT_THAT(
      decode({record(5 * ms, 1), record(4 * ms, 2), record(5 * ms, 1), record(4 * ms - 1, 2)}),
      ElementsAre(photon_tag(5'000'000'000, 1), photon_tag(4'000'000'000, 2),
                  photon_tag(5'000'000'000, 1), missed(5'000'000'000)));
}

// A record of no input is no tag, but the latest record all the same.
TEST(Tdc2Decode, StepsBackAddUpToAMillisecondAtMost) {
  constexpr std::uint64_t ms = 256'000'000;
  EXPECT_THAT(decode({record(5 * ms, 1), record(4 * ms + ms / 2, 0), record(4 * ms - 1, 2)}),
              ElementsAre(photon_tag(5'000'000'000, 1), missed(5'000'000'000)));
}

// The first record is at 125 ps: what is earlier than 0 cannot be a time.
TEST(Tdc2Decode, ATimeBeforeZeroIsMissed) {
  Tdc2Decoder decoder;
  EXPECT_THAT(decode(decoder, {record(32, 1), record(0, 2), record(most_units, 3), record(33, 1)}),
              ElementsAre(photon_tag(125, 1), photon_tag(0, 2), missed(125), photon_tag(129, 1)));
  EXPECT_EQ(decoder.strays(), 1U);
}

TEST(Tdc2Decode, WhatLiesPastTheHorizonIsMissed) {
  Tdc2Decoder decoder;
  decode(decoder, {record(32, 1)});
  decoder.set_horizon(250);
  EXPECT_THAT(decode(decoder, {record(65, 1), record(64, 1)}),
              ElementsAre(missed(125), photon_tag(250, 1)));
  EXPECT_EQ(decoder.strays(), 1U);
}

TEST(Tdc2Decode, SixtyFourStraysInARowAreANewClock) {
  Tdc2Decoder decoder;
  decode(decoder, {record(32'000'000'000, 1)});
  const std::vector<Tag> tags = decode(decoder, std::vector<std::uint64_t>(65, record(64, 2)));
  ASSERT_EQ(tags.size(), 67U);
  EXPECT_EQ(tags[62], missed(125'000'000'000));
  EXPECT_EQ(tags[64], clock_break(125'000'000'000));
  EXPECT_EQ(tags[65], photon_tag(250, 2));
  EXPECT_EQ(tags[66], photon_tag(250, 2));
}

// They agree where each is up to a second after the one before, or a millisecond before it.
TEST(Tdc2Decode, StraysThatAreFartherApartAreNoNewClock) {
  constexpr std::int64_t ms = 256'000'000, s = 1000 * ms;
  const auto clock_breaks = [](std::int64_t step) {
    Tdc2Decoder decoder;
    decode(decoder, {record(32, 1)});
    decoder.set_horizon(250);
    std::vector<std::uint64_t> strays;
    for (std::int64_t k = 0; k < 64; ++k) {
      strays.push_back(record(static_cast<std::uint64_t>(40 * s + k * step), 1));
    }
    const std::vector<Tag> tags = decode(decoder, strays);
    EXPECT_EQ(count(tags, TagKind::missed), 64U);
    return count(tags, TagKind::clock_break);
  };
  EXPECT_EQ(clock_breaks(s), 1U);
  EXPECT_EQ(clock_breaks(s + 1), 0U);
  EXPECT_EQ(clock_breaks(-ms), 1U);
  EXPECT_EQ(clock_breaks(-ms - 1), 0U);
}

TEST(Tdc2Decode, ACutRecordAndALackOfRoomAreLeftToTheCaller) {
  std::vector<std::byte> bytes;
  for (std::uint64_t i = 1; i <= 3; ++i) test::append_little_endian(record(32 * i, 15), bytes);
  bytes.resize(23);
  Tdc2Decoder decoder;
  std::array<Tag, 9> room;
  const auto first = decoder.decode(bytes, room);
  EXPECT_EQ(first.bytes, 8U);
  EXPECT_EQ(first.tags, 4U);
  const auto second = decoder.decode(std::span(bytes).subspan(8), room);
  EXPECT_EQ(second.bytes, 8U);
  EXPECT_EQ(decoder.decode(std::span(bytes).subspan(16), room).bytes, 0U);
}

TEST(Tdc2Decode, AnyBytesAreDecodedToSomething) {
  std::mt19937_64 random(7);
  std::vector<std::uint64_t> records(100'000);
  for (std::uint64_t& each : records) each = random();
  Tdc2Decoder decoder;
  const std::vector<Tag> tags = decode(decoder, records);
  for (const Tag& tag : tags) ASSERT_GE(tag.time_ps, 0);
  // Two inputs a record, a half of which are dummies; and each record that is left out is told.
  EXPECT_GT(count(tags, TagKind::heartbeat), 1000U);
  EXPECT_GT(count(tags, TagKind::photon), 1000U);
  EXPECT_GT(decoder.strays(), 1000U);
  EXPECT_EQ(count(tags, TagKind::missed), decoder.strays());
  EXPECT_EQ(count(tags, TagKind::loss_begin),
            count(tags, TagKind::loss_end) + (decoder.is_adrift() ? 1 : 0));
}

std::vector<std::byte> steady_bytes(std::size_t records) {
  std::vector<std::byte> bytes;
  for (std::size_t i = 0; i < records; ++i) {
    test::append_little_endian(record(1'000'000'000 + i * 2'560'000, 1, 24), bytes);
  }
  return bytes;
}

// 80 kB at random between good records: no times, no clock of their own, and the time is a loss.
TEST(Tdc2Decode, GarbageIsALossAndTheClockGoesOn) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    std::vector<std::byte> bytes = steady_bytes(1000);
    std::vector<std::byte> garbage(80'000);
    for (std::byte& byte : garbage) byte = static_cast<std::byte>(random());
    bytes.insert(bytes.begin() + 4000, garbage.begin(), garbage.end());
    Tdc2Decoder decoder;
    decoder.set_horizon(1'000'000'000'000);
    std::vector<Tag> tags(bytes.size());
    tags.resize(decoder.decode(bytes, tags).tags);
    EXPECT_EQ(count(tags, TagKind::clock_break), 0U);
    EXPECT_EQ(count(tags, TagKind::loss_begin), 1U);
    EXPECT_EQ(count(tags, TagKind::loss_end), 1U);
    EXPECT_NEAR(double(count(tags, TagKind::photon)), 999, 1);
    EXPECT_FALSE(decoder.is_adrift());
    EXPECT_EQ(tags.back(), photon_tag(13'896'250'000, 1));
  }
}

// Records that are read from somewhere inside one another.
TEST(Tdc2Decode, RecordsThatAreMisalignedAreNoTimes) {
  for (std::size_t slip = 1; slip < Tdc2Decoder::record_bytes; ++slip) {
    SCOPED_TRACE(slip);
    std::vector<std::byte> bytes = steady_bytes(10'000);
    bytes.erase(bytes.begin() + 800, bytes.begin() + 800 + static_cast<std::ptrdiff_t>(slip));
    Tdc2Decoder decoder;
    decoder.set_horizon(1'000'000'000'000);
    std::vector<Tag> tags(bytes.size());
    tags.resize(decoder.decode(bytes, tags).tags);
    EXPECT_EQ(count(tags, TagKind::clock_break), 0U);
    EXPECT_TRUE(decoder.is_adrift());
  }
}

TEST(Tdc2Decode, ARealRecordingHasItsCounts) {
  const auto file = test::real_recording_path("tdc2_c1234.ts");
  if (!std::filesystem::exists(file)) {
    GTEST_SKIP() << file << " is not there; SPLID_DATA names the folder of the recordings";
  }
  const std::vector<std::byte> bytes = test::file_bytes(file);
  std::vector<Tag> tags(bytes.size());
  Tdc2Decoder decoder;
  const auto done = decoder.decode(bytes, tags);
  tags.resize(done.tags);
  EXPECT_EQ(done.bytes, bytes.size());
  EXPECT_EQ(decoder.strays(), 0U);
  std::map<int, int> counts;
  for (const Tag& tag : tags) ++counts[tag.value];
  // By pattern: 1: 614, 2: 481, 4: 476, 8: 417, 3: 2, 5: 2, 6: 3, 9: 3, 10: 2.
  EXPECT_THAT(counts, ElementsAre(std::pair(1, 614 + 2 + 2 + 3), std::pair(2, 481 + 2 + 3 + 2),
                                  std::pair(3, 476 + 2 + 3), std::pair(4, 417 + 3 + 2)));
  // 17821472680578496 and 17821472919941713 units, to the nearest ps.
  EXPECT_EQ(tags.front().time_ps, 69'615'127'658'509'750);
  EXPECT_EQ(tags.back().time_ps, 69'615'128'593'522'316);
}

}  // namespace
}  // namespace splid::usb
