#include "protocol/tags16.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>
#include <string>

#include "tests/support/tags16_block.hpp"

namespace splid {
namespace {

using test::append_block;
using test::block_bytes;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::int64_t max_ps = std::numeric_limits<std::int64_t>::max();
constexpr std::int64_t min_ps = std::numeric_limits<std::int64_t>::min();

Tag loss_begin(std::int64_t time_ps) { return {time_ps, 0, TagKind::loss_begin, {}}; }
Tag loss_end(std::int64_t time_ps, int count) { return {time_ps, count, TagKind::loss_end, {}}; }
Tag missed(std::int64_t time_ps, int count) { return {time_ps, count, TagKind::missed, {}}; }
Tag clock_break(std::int64_t time_ps) { return {time_ps, 0, TagKind::clock_break, {}}; }

// bytes_at_once, room: how the caller cuts both sides.
std::vector<Tag> decode(Tags16Decoder& decoder, std::span<const std::byte> bytes,
                        std::size_t bytes_at_once = 1 << 20, std::size_t room = 1 << 10) {
  std::vector<Tag> tags;
  std::vector<Tag> out(room);
  while (!bytes.empty()) {
    std::span<const std::byte> piece = bytes.first(std::min(bytes_at_once, bytes.size()));
    bytes = bytes.subspan(piece.size());
    Tags16Decoder::Progress progress;
    do {
      progress = decoder.decode(piece, out);
      piece = piece.subspan(progress.bytes);
      tags.insert(tags.end(), out.begin(),
                  out.begin() + static_cast<std::ptrdiff_t>(progress.tags));
    } while (progress.tags == out.size());
    EXPECT_THAT(piece, IsEmpty());
  }
  return tags;
}

std::vector<Tag> tags_in(std::span<const std::byte> bytes) {
  Tags16Decoder decoder;
  return decode(decoder, bytes);
}

std::vector<std::byte> bytes_of(const std::vector<test::Tags16Block>& blocks) {
  std::vector<std::byte> bytes;
  for (const test::Tags16Block& block : blocks) append_block(block, bytes);
  return bytes;
}

// The bytes in the manual.
std::vector<std::byte> documented_bytes() {
  std::ifstream page(SPLID_SOURCE_DIR "/docs/reference/tags16.md");
  std::vector<std::byte> bytes;
  bool inside = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("```")) inside = line == "```hex";
    if (!inside || line.starts_with("```")) continue;
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      bytes.push_back(static_cast<std::byte>(std::stoi(word, nullptr, 16)));
    }
  }
  return bytes;
}

std::vector<Tag> documented_tags() {
  constexpr std::int64_t start_ps = 340'000'000'000'000'000;
  return {photon_tag(start_ps + 1'855, 1),      photon_tag(start_ps + 2'355, -1),
          photon_tag(start_ps + 3'780'000, 8),  loss_begin(start_ps + 4'000'000),
          missed(start_ps + 4'500'000, 513),    loss_end(start_ps + 5'000'000, 0),
          heartbeat_tag(start_ps + 10'000'000), heartbeat_tag(start_ps + 10'010'000'000)};
}

TEST(Tags16, TheManualsTestVector) {
  Tags16Decoder decoder;
  EXPECT_EQ(decode(decoder, documented_bytes()), documented_tags());
  EXPECT_EQ(decoder.counts().blocks, 2U);
  EXPECT_EQ(decoder.counts().skipped_bytes, 0U);
}

TEST(Tags16, TheBytesMayBeCutAnywhereAndTheRoomBeSmall) {
  for (std::size_t bytes_at_once = 1; bytes_at_once < 50; ++bytes_at_once) {
    for (const std::size_t room : {1, 2, 3, 7}) {
      Tags16Decoder decoder;
      EXPECT_EQ(decode(decoder, documented_bytes(), bytes_at_once, room), documented_tags())
          << bytes_at_once << " bytes, room for " << room;
    }
  }
}

TEST(Tags16, SmallestAndLargestNumbers) {
  EXPECT_THAT(tags_in(block_bytes({0, 0, 0, {{0, 0}}})),
              ElementsAre(photon_tag(0, 0), heartbeat_tag(0)));
  constexpr std::int32_t max_channel = std::numeric_limits<std::int32_t>::max();
  EXPECT_THAT(tags_in(block_bytes(
                  {~0U, min_ps, max_ps, {{min_ps, -max_channel - 1}, {max_ps, max_channel}}})),
              ElementsAre(photon_tag(min_ps, -max_channel - 1), photon_tag(max_ps, max_channel),
                          heartbeat_tag(max_ps)));
}

TEST(Tags16, SequenceGoesOnAfterItsLargest) {
  Tags16Decoder decoder;
  EXPECT_THAT(decode(decoder, bytes_of({{~0U, 0, 10, {}}, {0, 10, 20, {}}})),
              ElementsAre(heartbeat_tag(10), heartbeat_tag(20)));
  EXPECT_EQ(decoder.counts().lost_blocks, 0U);
}

TEST(Tags16, LostBlocksAreALossBetweenTheirNeighbours) {
  Tags16Decoder decoder;
  EXPECT_THAT(decode(decoder, bytes_of({{4, 0, 10, {}}, {7, 40, 50, {{45, 1}}}})),
              ElementsAre(heartbeat_tag(10), loss_begin(10), loss_end(40, -1), photon_tag(45, 1),
                          heartbeat_tag(50)));
  EXPECT_EQ(decoder.counts().lost_blocks, 2U);
}

TEST(Tags16, TimeThatNoBlockCoversIsALoss) {
  EXPECT_THAT(tags_in(bytes_of({{4, 0, 10, {}}, {5, 11, 20, {}}})),
              ElementsAre(heartbeat_tag(10), loss_begin(10), loss_end(11, -1), heartbeat_tag(20)));
}

TEST(Tags16, ABlockMayBeginAMicrosecondEarlyAndNotMore) {
  EXPECT_THAT(tags_in(bytes_of({{0, 0, 5'000'000, {}}, {1, 4'000'000, 6'000'000, {}}})),
              ElementsAre(heartbeat_tag(5'000'000), heartbeat_tag(6'000'000)));
  EXPECT_THAT(
      tags_in(bytes_of({{0, 0, 5'000'000, {}}, {1, 3'999'999, 6'000'000, {}}})),
      ElementsAre(heartbeat_tag(5'000'000), clock_break(3'999'999), heartbeat_tag(6'000'000)));
}

// After a gap in the numbers a header that begins too early is believed only with what follows it.
TEST(Tags16, AfterLostBlocksABlockMayBeginAMicrosecondEarlyAndNotMore) {
  const test::Tags16Block first{0, 0, 5'000'000, {}};
  EXPECT_THAT(tags_in(bytes_of({first, {2, 4'000'000, 6'000'000, {}}})),
              ElementsAre(heartbeat_tag(5'000'000), loss_begin(5'000'000), loss_end(5'000'000, -1),
                          heartbeat_tag(6'000'000)));
  const test::Tags16Block early{2, 3'999'999, 6'000'000, {}};
  EXPECT_THAT(tags_in(bytes_of({first, early})), ElementsAre(heartbeat_tag(5'000'000)));
  EXPECT_THAT(tags_in(bytes_of({first, early, {3, 6'000'000, 7'000'000, {}}})),
              ElementsAre(heartbeat_tag(5'000'000), clock_break(3'999'999),
                          heartbeat_tag(6'000'000), heartbeat_tag(7'000'000)));
}

TEST(Tags16, WhatFollowsADoubtfulHeaderMayBeginAMicrosecondEarlyAndNotMore) {
  constexpr std::int64_t day_ps = 86'400'000'000'000'000;
  const test::Tags16Block first{0, 0, 10, {}}, jump{1, day_ps, day_ps + 5'000'000, {}};
  EXPECT_THAT(tags_in(bytes_of({first, jump, {2, day_ps + 4'000'000, day_ps + 6'000'000, {}}})),
              ElementsAre(heartbeat_tag(10), loss_begin(10), loss_end(day_ps, -1),
                          heartbeat_tag(day_ps + 5'000'000), heartbeat_tag(day_ps + 6'000'000)));
  EXPECT_THAT(tags_in(bytes_of({first, jump, {2, day_ps + 3'999'999, day_ps + 6'000'000, {}}})),
              ElementsAre(heartbeat_tag(10)));
}

TEST(Tags16, ABrokenTimeBaseIsAClockBreak) {
  EXPECT_THAT(tags_in(block_bytes({0, 0, 10, {{4, 0, 1}, {5, 2}}})),
              ElementsAre(clock_break(4), photon_tag(5, 2), heartbeat_tag(10)));
}

TEST(Tags16, AnOverflowWithoutCountLostNobodyKnowsHowMany) {
  EXPECT_THAT(tags_in(block_bytes(
                  {0, 0, 10, {{4, 0, 2}, {5, 0, 4, 0xFFFF}, {6, 0, 3}, {7, 0, 2}, {8, 0, 3}}})),
              ElementsAre(loss_begin(4), missed(5, 65'535), loss_end(6, 0), loss_begin(7),
                          loss_end(8, -1), heartbeat_tag(10)));
}

TEST(Tags16, ATagOutsideItsBlockIsOneMissed) {
  Tags16Decoder decoder;
  EXPECT_THAT(
      decode(decoder, block_bytes({0, 100, 200, {{99, 1}, {150, 1}, {201, 1}, {min_ps, 1}}})),
      ElementsAre(missed(100, 1), photon_tag(150, 1), missed(150, 1), missed(150, 1),
                  heartbeat_tag(200)));
  EXPECT_EQ(decoder.counts().outside_tags, 3U);
}

TEST(Tags16, BytesBeforeTheFirstBlockAreSkippedWithoutALoss) {
  std::vector<std::byte> bytes(13, std::byte{'S'});
  append_block({5, 0, 10, {{3, 1}}}, bytes);
  Tags16Decoder decoder;
  EXPECT_THAT(decode(decoder, bytes), ElementsAre(photon_tag(3, 1), heartbeat_tag(10)));
  EXPECT_EQ(decoder.counts().skipped_bytes, 13U);
}

TEST(Tags16, ABlockCutOffEndsWhereTheNextBegins) {
  std::vector<std::byte> bytes = block_bytes({0, 0, 10, {{3, 1}, {4, 1}, {5, 1}}});
  bytes.resize(bytes.size() - 2 * Tags16Decoder::tag_bytes);
  append_block({1, 10, 20, {{15, 2}}}, bytes);
  for (std::size_t bytes_at_once = 1; bytes_at_once < 50; ++bytes_at_once) {
    Tags16Decoder decoder;
    EXPECT_THAT(decode(decoder, bytes, bytes_at_once),
                ElementsAre(photon_tag(3, 1), loss_begin(3), loss_end(10, -1), photon_tag(15, 2),
                            heartbeat_tag(20)));
    EXPECT_EQ(decoder.counts().damaged_blocks, 1U);
    EXPECT_EQ(decoder.counts().skipped_bytes, 0U);
  }
}

TEST(Tags16, BytesThatAreNoBlockAreALoss) {
  std::vector<std::byte> bytes = block_bytes({0, 0, 10, {}});
  bytes.insert(bytes.end(), 100, std::byte{0xEE});
  append_block({1, 10, 20, {}}, bytes);
  Tags16Decoder decoder;
  EXPECT_THAT(decode(decoder, bytes),
              ElementsAre(heartbeat_tag(10), loss_begin(10), loss_end(10, -1), heartbeat_tag(20)));
  EXPECT_EQ(decoder.counts().skipped_bytes, 100U);
}

TEST(Tags16, HeadersThatLieAreNotBelieved) {
  test::Tags16Block too_many{0, 0, 10, {}};
  too_many.more_count = Tags16Decoder::max_block_tags + 1;
  test::Tags16Block other_version{0, 0, 10, {}};
  other_version.version = 2;
  test::Tags16Block flagged{0, 0, 10, {}};
  flagged.flags = 1;
  const test::Tags16Block backwards{0, 11, 10, {}};
  for (const auto& block : {too_many, other_version, flagged, backwards}) {
    Tags16Decoder decoder;
    EXPECT_THAT(decode(decoder, bytes_of({block, {1, 10, 20, {}}})),
                ElementsAre(heartbeat_tag(20)));
    EXPECT_EQ(decoder.counts().bad_headers, 1U);
    EXPECT_EQ(decoder.counts().skipped_bytes, Tags16Decoder::header_bytes);
  }
}

// 10 ms from `index` times 10 ms on, at an instrument's epoch, with a record each millisecond or
// none.
test::Tags16Block block_of_10_ms(std::uint32_t index, bool is_empty = false) {
  constexpr std::int64_t ms_ps = 1'000'000'000;
  const std::int64_t begin_ps = 340'000'000'000'000'000 + index * 10 * ms_ps;
  test::Tags16Block block{index, begin_ps, begin_ps + 10 * ms_ps, {}};
  for (int i = 0; i < 10 && !is_empty; ++i) block.records.push_back({begin_ps + i * ms_ps, 1});
  return block;
}

// Between two good blocks a part of one comes, and of another nothing.
std::vector<Tag> tags_with_a_gap(std::span<const std::byte> part, std::size_t bytes_at_once) {
  std::vector<std::byte> bytes = block_bytes(block_of_10_ms(4));
  bytes.insert(bytes.end(), part.begin(), part.end());
  append_block(block_of_10_ms(6), bytes);
  append_block(block_of_10_ms(7), bytes);
  Tags16Decoder decoder;
  std::vector<Tag> tags = decode(decoder, bytes, bytes_at_once);
  EXPECT_EQ(decoder.counts().blocks, 3U);
  EXPECT_EQ(decoder.counts().skipped_bytes, part.size());
  return tags;
}

std::vector<Tag> expected_with_a_gap() {
  std::vector<Tag> tags = tags_in(block_bytes(block_of_10_ms(4)));
  tags.push_back(loss_begin(block_of_10_ms(4).end_ps));
  tags.push_back(loss_end(block_of_10_ms(6).begin_ps, -1));
  for (const std::uint32_t index : {6, 7}) {
    for (const Tag& tag : tags_in(block_bytes(block_of_10_ms(index)))) tags.push_back(tag);
  }
  return tags;
}

// Thirteen bytes of a header and the block after it make a header with times of its own.
TEST(Tags16, APartOfAHeaderIsNotBelieved) {
  for (const bool is_empty : {true, false}) {
    const std::vector<std::byte> whole = block_bytes(block_of_10_ms(5, is_empty));
    for (std::size_t part = 1; part < Tags16Decoder::header_bytes; ++part) {
      for (const std::size_t bytes_at_once : {1, 29, 100'000}) {
        SCOPED_TRACE(std::to_string(part) + " bytes, read by " + std::to_string(bytes_at_once));
        EXPECT_EQ(tags_with_a_gap(std::span(whole).first(part), bytes_at_once),
                  expected_with_a_gap());
      }
    }
  }
}

TEST(Tags16, APartOfAHeaderAndGarbageAreNotBelieved) {
  std::mt19937 random(7);
  for (int run = 0; run < 2000; ++run) {
    SCOPED_TRACE(run);
    std::vector<std::byte> part = block_bytes(block_of_10_ms(5, run % 2 == 0));
    part.resize(1 + random() % (Tags16Decoder::header_bytes - 1));
    for (std::size_t garbage = random() % 100; garbage > 0; --garbage) {
      part.push_back(static_cast<std::byte>(random()));
    }
    ASSERT_EQ(tags_with_a_gap(part, 100'000), expected_with_a_gap());
  }
}

// Records that are read from somewhere inside one another.
TEST(Tags16, ABlockThatLacksSomeBytesBreaksNoClock) {
  for (std::size_t lacking = 1; lacking < 3 * Tags16Decoder::tag_bytes; ++lacking) {
    std::vector<std::byte> bytes = block_bytes(block_of_10_ms(4));
    test::Tags16Block long_one = block_of_10_ms(5);
    for (int i = 0; i < 1000; ++i) long_one.records.push_back({long_one.end_ps - 1000 + i, 1});
    std::vector<std::byte> damaged = block_bytes(long_one);
    damaged.erase(damaged.begin() + 100, damaged.begin() + 100 + std::ptrdiff_t(lacking));
    bytes.insert(bytes.end(), damaged.begin(), damaged.end());
    append_block(block_of_10_ms(6), bytes);
    append_block(block_of_10_ms(7), bytes);
    Tags16Decoder decoder;
    const std::vector<Tag> tags = decode(decoder, bytes);
    for (const Tag& tag : tags) {
      ASSERT_NE(tag.kind, TagKind::clock_break) << lacking;
      ASSERT_GE(tag.time_ps, block_of_10_ms(4).begin_ps) << lacking;
      ASSERT_LE(tag.time_ps, block_of_10_ms(7).end_ps) << lacking;
    }
    EXPECT_EQ(decoder.counts().blocks, 3U) << lacking;
    EXPECT_EQ(decoder.counts().damaged_blocks, 1U) << lacking;
    EXPECT_LE(decoder.counts().outside_tags, 16U) << lacking;
  }
}

// A clock that jumps ahead shows it in more than one header.
TEST(Tags16, AJumpFarAheadIsConfirmedByWhatFollows) {
  constexpr std::int64_t day_ps = 86'400'000'000'000'000;
  EXPECT_THAT(tags_in(bytes_of({{0, 0, 10, {}}, {1, day_ps, day_ps + 10, {{day_ps + 3, 1}}}})),
              ElementsAre(heartbeat_tag(10), loss_begin(10), loss_end(day_ps, -1),
                          photon_tag(day_ps + 3, 1), heartbeat_tag(day_ps + 10)));
  EXPECT_THAT(
      tags_in(bytes_of(
          {{0, 0, 10, {}}, {1, day_ps, day_ps + 10, {}}, {2, day_ps + 10, day_ps + 20, {}}})),
      ElementsAre(heartbeat_tag(10), loss_begin(10), loss_end(day_ps, -1),
                  heartbeat_tag(day_ps + 10), heartbeat_tag(day_ps + 20)));
  Tags16Decoder decoder;
  EXPECT_THAT(
      decode(decoder, bytes_of({{0, 0, 10, {}}, {1, max_ps - 9, max_ps, {}}, {2, 20, 30, {}}})),
      ElementsAre(heartbeat_tag(10), loss_begin(10), loss_end(20, -1), heartbeat_tag(30)));
  EXPECT_EQ(decoder.counts().bad_headers, 1U);
}

TEST(Tags16, AfterANewConnectionTheStreamGoesOnWithALoss) {
  Tags16Decoder decoder;
  std::vector<std::byte> bytes = block_bytes({0, 0, 10, {{3, 1}, {4, 1}}});
  bytes.resize(bytes.size() - 3);
  EXPECT_THAT(decode(decoder, bytes), ElementsAre(photon_tag(3, 1)));
  decoder.cut();
  EXPECT_THAT(decode(decoder, block_bytes({0, 500, 600, {}})),
              ElementsAre(loss_begin(3), loss_end(500, -1), heartbeat_tag(600)));
  EXPECT_EQ(decoder.counts().damaged_blocks, 1U);
  EXPECT_EQ(decoder.counts().skipped_bytes, 13U);
  EXPECT_EQ(decoder.reached_ps(), 600);
  decoder.cut();
  EXPECT_THAT(decode(decoder, block_bytes({0, -2'000'000, 0, {}})),
              ElementsAre(clock_break(-2'000'000), heartbeat_tag(0)));
}

// Whatever the bytes, all are used, and each whole block's end and tags come out.
// A sender that began anew knows no time yet.
TEST(Tags16, BlocksWithoutATimeAfterANewConnectionAreNoDamage) {
  const test::Tags16Block no_time{0, tags16::no_time_ps, tags16::no_time_ps, {}};
  Tags16Decoder decoder;
  decode(decoder, block_bytes({0, 0, 5'000'000'000, {}}));
  decoder.cut();
  std::vector<test::Tags16Block> blocks(4, no_time);
  for (std::uint32_t i = 0; i < 4; ++i) blocks[i].sequence = i;
  for (const test::Tags16Block& block : blocks) {
    EXPECT_THAT(decode(decoder, block_bytes(block)), IsEmpty());
  }
  EXPECT_EQ(decoder.counts().blocks, 5U);
  EXPECT_THAT(decode(decoder, block_bytes({4, 0, 10, {{3, 1}}})),
              ElementsAre(clock_break(0), photon_tag(3, 1), heartbeat_tag(10)));
  EXPECT_THAT(decode(decoder, block_bytes({5, 10, 20, {}})), ElementsAre(heartbeat_tag(20)));
  EXPECT_EQ(decoder.counts().blocks, 7U);
  EXPECT_EQ(decoder.counts().bad_headers, 0U);
  EXPECT_EQ(decoder.counts().skipped_bytes, 0U);
}

TEST(Tags16, DamagedStreamsAreReadToTheirEnd) {
  std::mt19937 random(1);
  for (int run = 0; run < 200; ++run) {
    std::vector<std::byte> bytes;
    for (std::uint32_t block = 0; block < 20; ++block) {
      append_block({block, block * 10, block * 10 + 10, {{block * 10, 1}, {block * 10 + 5, 2}}},
                   bytes);
    }
    for (int i = 0; i < 10; ++i) {
      bytes[random() % bytes.size()] = static_cast<std::byte>(random() % 256);
    }
    Tags16Decoder decoder;
    const std::vector<Tag> tags = decode(decoder, bytes, 1 + random() % 100, 1 + random() % 5);
    std::uint64_t heartbeats = 0;
    for (const Tag& tag : tags) heartbeats += tag.kind == TagKind::heartbeat ? 1 : 0;
    EXPECT_EQ(heartbeats, decoder.counts().blocks);
    EXPECT_GE(decoder.counts().blocks, 10U);
  }
}

TEST(Tags16, SyncsAndMarkersHaveRecordsOfTheirOwn) {
  EXPECT_THAT(tags_in(block_bytes({0, 0, 10, {{3, 77, 5}, {4, 1, 6}, {5, 15, 6}, {6, 2}}})),
              ElementsAre(sync_tag(3), marker_tag(4, 1), marker_tag(5, 15), photon_tag(6, 2),
                          heartbeat_tag(10)));
}

TEST(Tags16, MarkersWithoutBitsOfTheirOwnAreMissed) {
  Tags16Decoder decoder;
  EXPECT_THAT(decode(decoder, block_bytes({0, 0, 10, {{3, 0, 6}, {4, 16, 6}, {5, -1, 6}}})),
              ElementsAre(missed(3, 1), missed(4, 1), missed(5, 1), heartbeat_tag(10)));
  EXPECT_EQ(decoder.counts().outside_tags, 3U);
}

TEST(Tags16, SyncsAndMarkersOutsideTheirBlockAreMissed) {
  EXPECT_THAT(tags_in(block_bytes({0, 100, 200, {{99, 0, 5}, {201, 1, 6}}})),
              ElementsAre(missed(100, 1), missed(100, 1), heartbeat_tag(200)));
}

// A record of text: how it is meant, and six bytes.
test::Tags16Record text_record(NoticeKind kind, std::string text) {
  text.resize(6, '\0');
  std::uint16_t first = 0;
  std::int32_t rest = 0;
  std::memcpy(&first, text.data(), sizeof first);
  std::memcpy(&rest, &text[2], sizeof rest);
  test::Tags16Record record{5, rest, 7, first};
  record.reserved = static_cast<std::uint8_t>(kind);
  return record;
}

TEST(Tags16, RecordsOfTextAreASentenceAndNoTags) {
  const auto bytes = block_bytes({0,
                                  0,
                                  10,
                                  {{4, 1},
                                   text_record(NoticeKind::failing, "its FI"),
                                   text_record(NoticeKind::failing, "FO was"),
                                   {5, 2},
                                   text_record(NoticeKind::failing, "")}});
  for (std::size_t bytes_at_once = 1; bytes_at_once < 50; ++bytes_at_once) {
    Tags16Decoder decoder;
    EXPECT_EQ(decoder.notice().number, 0U);
    EXPECT_THAT(decode(decoder, bytes, bytes_at_once),
                ElementsAre(photon_tag(4, 1), photon_tag(5, 2), heartbeat_tag(10)));
    EXPECT_EQ(decoder.notice().number, 1U);
    EXPECT_EQ(decoder.notice().kind, NoticeKind::failing);
    EXPECT_EQ(decoder.notice().text, "its FIFO was");
  }
}

TEST(Tags16, ASentenceThatIsTooLongIsCutAndOneThatIsCutOffIsNone) {
  test::Tags16Block block{0, 0, 10, {}};
  for (int i = 0; i < 50; ++i) block.records.push_back(text_record(NoticeKind::event, "abcdef"));
  block.records.push_back(text_record(NoticeKind::event, "end"));
  block.records.push_back(text_record(NoticeKind::absent, "lost.."));
  Tags16Decoder decoder;
  decode(decoder, block_bytes(block));
  EXPECT_EQ(decoder.event().text.size(), tags16::max_text_bytes);
  decoder.cut();
  decode(decoder, block_bytes({0, 10, 20, {text_record(static_cast<NoticeKind>(9), "new")}}));
  EXPECT_EQ(decoder.event().number, 2U);
  EXPECT_EQ(decoder.event().text, "new");
  EXPECT_EQ(decoder.event().kind, NoticeKind::event);
  EXPECT_EQ(decoder.notice().number, 0U);
}

TEST(Tags16, AnEventLeavesTheStateBeforeIt) {
  Tags16Decoder decoder;
  decode(decoder, block_bytes({0,
                               0,
                               10,
                               {text_record(NoticeKind::caution, ""),
                                text_record(NoticeKind::event, "over")}}));
  EXPECT_EQ(decoder.notice().number, 1U);
  EXPECT_EQ(decoder.notice().kind, NoticeKind::caution);
  EXPECT_EQ(decoder.notice().text, "");
  EXPECT_EQ(decoder.event().number, 1U);
  EXPECT_EQ(decoder.event().text, "over");
}

}  // namespace
}  // namespace splid
