#include "drivers/usb/ttm_decode.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <initializer_list>
#include <random>
#include <vector>

#include "tests/support/sanitized.hpp"
#include "tests/support/tags16_block.hpp"
#include "tests/support/ttm_encoder.hpp"

namespace splid::usb {
namespace {

using test::TtmEncoder;
using test::TtmEvent;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr Tag loss_begin(std::int64_t time_ps) { return {time_ps, 0, TagKind::loss_begin, {}}; }
constexpr Tag loss_end(std::int64_t time_ps) { return {time_ps, -1, TagKind::loss_end, {}}; }

class TtmDecode : public ::testing::Test {
 protected:
  std::vector<Tag> decode(const std::vector<std::byte>& bytes) {
    std::vector<Tag> tags(bytes.size() / 2 + TtmDecoder::most_tags_a_word);
    const auto done = decoder.decode(bytes, tags);
    EXPECT_EQ(done.bytes, bytes.size());
    tags.resize(done.tags);
    return tags;
  }
  std::vector<Tag> decode(std::initializer_list<std::uint16_t> words) {
    std::vector<std::byte> bytes;
    for (const std::uint16_t word : words) test::append_little_endian(word, bytes);
    return decode(bytes);
  }
  // A record of that count without an event: a heartbeat.
  static std::vector<std::byte> record(std::uint32_t count, bool drops = false) {
    std::vector<std::byte> bytes;
    for (const unsigned word :
         {0x184DU, 0xFB00U | (drops ? 0x80U : 0U) | count >> 21U, 0x7C00U, 0xFD00U | (count & 127U),
          0xFE00U | (count >> 7U & 127U), 0xFF00U | (count >> 14U & 127U)}) {
      test::append_little_endian(static_cast<std::uint16_t>(word), bytes);
    }
    return bytes;
  }
  std::vector<Tag> decode_record(std::uint32_t count, bool drops = false) {
    return decode(record(count, drops));
  }
  // What comes after a first record, at 0.
  void begin() {
    decode({0xFF00});
    EXPECT_THAT(decode_record(0), ElementsAre(heartbeat_tag(0)));
  }

  TtmDecoder decoder;
};

// 0x1234567 periods of 12500/3 ps are 79,536,429,167 ps; a tap counts as 48 ps.
TEST_F(TtmDecode, ARecordIsPinned) {
  EXPECT_THAT(decode({0x80FF, 0xFF00}), IsEmpty());  // the end of a record
  EXPECT_THAT(
      decode({0x8402, 0x0511, 0x7FFF, 0x98FF, 0xFB09, 0xFC00, 0xFDE7, 0xFE8A, 0xFF8D}),
      ElementsAre(photon_tag(79'536'429'167 - 120, 4), photon_tag(79'536'429'167 - 4166, 24),
                  sync_tag(79'536'429'167 - 24), marker_tag(79'536'429'167, 1)));
  EXPECT_EQ(decoder.records(), 1U);
  EXPECT_EQ(decoder.faults(), TtmFaults{});
}

TEST_F(TtmDecode, TheCountWrapsAndTimesDoNot) {
  begin();
  std::uint32_t count = 0;
  for (std::int64_t period = 4000; period < std::int64_t{3} << 27U; period += 4000) {
    count = static_cast<std::uint32_t>(period) & TtmEncoder::count_mask;
    ASSERT_THAT(decode_record(count), ElementsAre(heartbeat_tag((period * 12'500 + 1) / 3)));
  }
}

// Bits are told where the levels rise, of pixels at each record that has the bit.
TEST_F(TtmDecode, MarkersRise) {
  begin();
  const auto record_of = [&](unsigned count, unsigned pixel, unsigned frame, unsigned line) {
    return decode({0x184D, 0xFB00, 0x7C00, static_cast<std::uint16_t>(0xFD00U | pixel | count),
                   static_cast<std::uint16_t>(0xFE00U | frame),
                   static_cast<std::uint16_t>(0xFF00U | line)});
  };
  EXPECT_THAT(record_of(3, 0x80, 0, 0), ElementsAre(marker_tag(12'500, 1)));
  EXPECT_THAT(record_of(6, 0x80, 0x80, 0x80), ElementsAre(marker_tag(25'000, 7)));
  EXPECT_THAT(record_of(9, 0, 0x80, 0x80), ElementsAre(heartbeat_tag(37'500)));
  EXPECT_THAT(record_of(12, 0, 0x80, 0), ElementsAre(heartbeat_tag(50'000)));
  EXPECT_THAT(record_of(15, 0, 0, 0x80), ElementsAre(marker_tag(62'500, 2)));
  EXPECT_THAT(record_of(18, 0, 0x80, 0x80), ElementsAre(marker_tag(75'000, 4)));
}

TEST_F(TtmDecode, DroppedPhotonsAreALossUntilNoneAre) {
  begin();
  EXPECT_THAT(decode_record(3, true), ElementsAre(loss_begin(0), heartbeat_tag(12'500)));
  EXPECT_THAT(decode_record(6, true), ElementsAre(heartbeat_tag(25'000)));
  EXPECT_THAT(decode_record(10), ElementsAre(loss_end(37'500), heartbeat_tag(41'667)));
  EXPECT_EQ(decoder.faults(), (TtmFaults{.full = 1}));
}

TEST_F(TtmDecode, MissingRecordsAreALoss) {
  begin();
  EXPECT_THAT(decode_record(4'353),
              ElementsAre(loss_begin(0), loss_end(18'133'333), heartbeat_tag(18'137'500)));
  EXPECT_THAT(decode_record(2 * 4'353 - 1), ElementsAre(heartbeat_tag(36'270'833)));
  EXPECT_EQ(decoder.faults(), (TtmFaults{.gaps = 1}));
}

TEST_F(TtmDecode, ACountThatStepsBackIsAClockBreak) {
  decode({0xFF00});
  decode_record(3000);
  EXPECT_THAT(decode_record(3),
              ElementsAre(loss_begin(12'500'000), loss_end(12'500'000),
                          Tag{12'500'000, 0, TagKind::clock_break, {}}, heartbeat_tag(12'500)));
  EXPECT_THAT(decode_record(3),
              ElementsAre(loss_begin(12'500), loss_end(12'500),
                          Tag{12'500, 0, TagKind::clock_break, {}}, heartbeat_tag(12'500)));
}

// Where the count may have wrapped unseen, a step is believed only where no record is missing.
TEST_F(TtmDecode, AGapWhereTheCountMayHaveWrappedIsAClockBreak) {
  begin();
  decoder.doubt_count();
  EXPECT_THAT(decode_record(4'350), ElementsAre(heartbeat_tag(18'125'000)));
  EXPECT_THAT(decode_record(9'000),
              ElementsAre(loss_begin(18'125'000), loss_end(37'495'833), heartbeat_tag(37'500'000)));
  decoder.doubt_count();
  EXPECT_THAT(decode_record(18'000),
              ElementsAre(loss_begin(37'500'000), loss_end(37'500'000),
                          Tag{37'500'000, 0, TagKind::clock_break, {}}, heartbeat_tag(75'000'000)));
  EXPECT_EQ(decoder.faults(), (TtmFaults{.gaps = 2}));
}

// Words in a wrong order, invalid ones that must be valid, and such as do not exist.
TEST_F(TtmDecode, ABrokenRecordIsALossUntilTheNext) {
  std::uint32_t count = 3;
  for (const std::initializer_list<std::uint16_t> broken :
       {std::initializer_list<std::uint16_t>{0x8501, 0x8401},
        {0x8501, 0x8501},
        {0xFC00},
        {0xB100},
        {0xFA00, 0xFB00, 0xFB00},
        {0x7B00},
        {0xFB00, 0xFC00, 0x7D00},
        {0xFF00}}) {
    decoder = {};
    decode({0xFF00});
    decode_record(0);
    EXPECT_THAT(decode(broken), ElementsAre(loss_begin(0)));
    EXPECT_THAT(decode({0x8501}), IsEmpty());
    EXPECT_THAT(decode({0xFF00}), IsEmpty());
    EXPECT_THAT(decode_record(count), ElementsAre(loss_end(8333), heartbeat_tag(12'500)));
    EXPECT_EQ(decoder.faults(), (TtmFaults{.broken = 1}));
  }
}

TEST_F(TtmDecode, WhatIsCutOutIsALoss) {
  begin();
  EXPECT_THAT(decode({0x8501}), IsEmpty());
  EXPECT_EQ(decoder.cut(), loss_begin(0));
  EXPECT_EQ(decoder.cut(), std::nullopt);
  EXPECT_THAT(decode({0xFB00, 0xFF00}), IsEmpty());
  EXPECT_THAT(decode_record(3), ElementsAre(loss_end(8333), heartbeat_tag(12'500)));
  EXPECT_EQ(decoder.faults(), TtmFaults{});
}

#ifndef SPLID_SANITIZED  // a time beyond the end would be a negative one in any build

// The largest step that is no step back, again and again, for 54 days.
TEST_F(TtmDecode, TheOriginMovesBeforeTimesEnd) {
  begin();
  constexpr std::uint32_t step = TtmEncoder::count_mask / 2;
  constexpr std::int64_t step_ps = std::int64_t{step} * 12'500 / 3;
  std::vector<Tag> tags(TtmDecoder::most_tags_a_word);
  std::vector<std::byte> bytes = record(0);
  std::int64_t latest_ps = 0;
  int breaks = 0;
  for (std::uint32_t i = 1; i <= 16'700'000; ++i) {
    const std::uint32_t count = i * step & TtmEncoder::count_mask;
    for (const unsigned part : {0U, 1U, 2U}) {
      bytes[6 + 2 * part] = static_cast<std::byte>(count >> 7 * part & 127U);
    }
    bytes[2] = static_cast<std::byte>(count >> 21U);
    const std::size_t written = decoder.decode(bytes, tags).tags;
    ASSERT_EQ(tags[0].kind, TagKind::loss_begin);
    if (written == 4) ++breaks;
    const std::int64_t now_ps = tags[written - 1].time_ps;
    ASSERT_TRUE(written == 4 ? now_ps < step_ps * 3 : std::abs(now_ps - latest_ps - step_ps) < 2);
    latest_ps = now_ps;
  }
  EXPECT_EQ(breaks, 1);
}

#endif

// Photons at random on two inputs, with taps of 32 and 64 ps. As long as a tap counts as 48 ps,
// times are wrong by up to 1 ns; then by half a tap, and by what 16,384 hits leave: 16 ps.
TEST_F(TtmDecode, TheTapsAreCalibratedByTheirDensity) {
  std::mt19937_64 random(7);
  std::exponential_distribution<double> gap(1 / 60'000.0);
  std::vector<TtmEvent> events;
  double at_ps = 1e9;
  for (int i = 0; i < 60'000; ++i) {
    events.push_back({static_cast<std::int64_t>(at_ps += 4200 + gap(random)), i % 2 == 0 ? 3 : 17});
  }
  TtmEncoder encoder;
  encoder.is_bent = true;
  std::vector<std::byte> bytes;
  encoder.append(events, events.back().time_ps + 5'000, bytes);
  std::vector<Tag> photons = decode(bytes);
  std::erase_if(photons, [](const Tag& tag) { return tag.kind != TagKind::photon; });
  ASSERT_EQ(photons.size(), events.size());
  double first_ps = 0, last_ps = 0;
  for (std::size_t i = 0; i < events.size(); ++i) {
    ASSERT_EQ(photons[i].value, events[i].what);
    const auto error_ps = static_cast<double>(std::abs(photons[i].time_ps - events[i].time_ps));
    if (i < 2 * TtmFine::first_hits) first_ps = std::max(first_ps, error_ps);
    if (i > 40'000) last_ps = std::max(last_ps, error_ps);
  }
  EXPECT_NEAR(first_ps, 1040 + 32, 40);
  EXPECT_LT(last_ps, 32 + 3 * 16);
}

}  // namespace
}  // namespace splid::usb
