#include "protocol/ptu_decode.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <map>
#include <random>
#include <string>

#include "protocol/error.hpp"
#include "protocol/ptu_header.hpp"
#include "tests/support/ptu_bytes.hpp"
#include "tests/support/real_recording.hpp"

namespace splid {
namespace {

using test::decode_all;
using test::record_bytes;
using testing::ElementsAre;

constexpr std::int64_t wrap = 33'554'432;

std::vector<Tag> decoded(RecordType type, std::initializer_list<std::uint32_t> records,
                         double resolution_s = 1e-12, std::int64_t origin_ps = 0) {
  PtuDecoder decoder(type, resolution_s, origin_ps);
  return decode_all(decoder, record_bytes(records));
}

class CountedWraps : public testing::TestWithParam<RecordType> {};

TEST_P(CountedWraps, AllKindsOfRecords) {
  EXPECT_THAT(decoded(GetParam(),
                      {0x00000005,    // photon, input 0
                       0x03FFFFFF,    // photon, input 1, last tick
                       0xFE000003,    // overflow, 3 wraps
                       0x80000007,    // sync
                       0xFE000000,    // overflow, count 0: 1 wrap
                       0x82000008,    // marker 1
                       0x9E000009,    // marker 15
                       0x7E00000A}),  // photon, input 63
              ElementsAre(photon_tag(5, 0), photon_tag(33'554'431, 1), sync_tag(3 * wrap + 7),
                          marker_tag(4 * wrap + 8, 1), marker_tag(4 * wrap + 9, 15),
                          photon_tag(4 * wrap + 10, 63)));
}

TEST_P(CountedWraps, LargestCount) {
  EXPECT_THAT(decoded(GetParam(), {0xFFFFFFFF, 0x00000001}),
              ElementsAre(photon_tag(33'554'431 * wrap + 1, 0)));
}

INSTANTIATE_TEST_SUITE_P(Types, CountedWraps,
                         testing::Values(RecordType::hydra_harp_v2, RecordType::time_harp_260_nano,
                                         RecordType::time_harp_260_pico, RecordType::generic));

TEST(PtuDecode, HydraHarpV1WrapsOnceWhateverTheCount) {
  EXPECT_THAT(
      decoded(RecordType::hydra_harp_v1,
              {0xFE000000, 0x02000001, 0xFE000005, 0x80000002, 0x84000003}),
      ElementsAre(photon_tag(33'552'001, 1), sync_tag(67'104'002), marker_tag(67'104'003, 2)));
}

TEST(PtuDecode, PicoHarp) {
  EXPECT_THAT(decoded(RecordType::pico_harp,
                      {0x0000000A,   // photon, channel 0
                       0xEFFFFFFF,   // photon, channel 14, last tick
                       0xF0000000,   // overflow
                       0xF0000231,   // marker 1: its bits are no time
                       0xF000045F,   // marker 15
                       0xF0000100,   // overflow, whatever the time above the marker bits
                       0x10000001},  // photon, channel 1
                      4e-12),
              ElementsAre(photon_tag(40, 0), photon_tag(4 * 268'435'455LL, 14),
                          marker_tag(4 * (210'698'240LL + 0x230), 1),
                          marker_tag(4 * (210'698'240LL + 0x450), 15),
                          photon_tag(4 * (2 * 210'698'240LL + 1), 1)));
}

TEST(PtuDecode, UnknownSpecialsAreCountedAndLeftOut) {
  PtuDecoder decoder(RecordType::hydra_harp_v2, 1e-12);
  // Channels 16 and 62 of the specials.
  const auto tags = decode_all(
      decoder, record_bytes({0xA0000001, 0x02000002, 0xFC000003, 0xFE000001, 0x02000004}));
  EXPECT_THAT(tags, ElementsAre(photon_tag(2, 1), photon_tag(wrap + 4, 1)));
  EXPECT_EQ(decoder.unknown_records(), 2U);
  EXPECT_EQ(decoder.overflow_records(), 1U);
  EXPECT_EQ(decoder.reached_ps(), wrap);
}

TEST(PtuDecode, TimesStartAtTheOrigin) {
  const std::int64_t origin_ps = 340'000'000'000'000'001;
  EXPECT_THAT(
      decoded(RecordType::hydra_harp_v2, {0x02000005, 0xFE000001, 0x02000006}, 1e-12, origin_ps),
      ElementsAre(photon_tag(origin_ps + 5, 1), photon_tag(origin_ps + wrap + 6, 1)));
  EXPECT_THAT(decoded(RecordType::hydra_harp_v2, {0x02000005, 0xFE000001, 0x02000006}, 1e-12, -7),
              ElementsAre(photon_tag(-2, 1), photon_tag(wrap - 1, 1)));
}

TEST(PtuDecode, WholePicosecondsAreExact) {
  for (const int resolution_ps : {1, 4, 5, 25, 80, 250, 8'000}) {
    EXPECT_THAT(decoded(RecordType::generic, {0xFFFFFFFF, 0x01000003}, resolution_ps * 1e-12),
                ElementsAre(photon_tag((33'554'431 * wrap + 0x1000003) * resolution_ps, 0)))
        << resolution_ps;
  }
}

TEST(PtuDecode, FractionsOfPicosecondsAddUpNoError) {
  // 1/256 ns is 125/32 ps; 0.0823 ns is 823/10 ps; 1/3 ps. Times to the nearest, halves up.
  const std::int64_t ticks = 33'554'431 * wrap + 16;
  EXPECT_THAT(decoded(RecordType::generic, {0xFFFFFFFF, 0x00000010}, 3.90625e-12),
              ElementsAre(photon_tag((ticks / 32) * 125 + 63, 0)));  // 16/32 of 125 is 62.5
  EXPECT_THAT(decoded(RecordType::generic, {0xFFFFFFFF, 0x00000010}, 82.3e-12),
              ElementsAre(photon_tag((ticks / 10) * 823 + ((ticks % 10) * 823 + 5) / 10, 0)));
  EXPECT_THAT(decoded(RecordType::generic, {0xFFFFFFFF, 0x00000010}, 1e-12 / 3),
              ElementsAre(photon_tag((ticks + 1) / 3, 0)));
}

TEST(PtuDecode, RefusesAbsurdResolutions) {
  for (const double resolution_s : {0.0, -1e-12, 1e-16, 1.0, std::nan("")}) {
    EXPECT_THROW(PtuDecoder(RecordType::generic, resolution_s), Error) << resolution_s;
  }
}

TEST(PtuDecode, ACutRecordIsLeftForTheCaller) {
  PtuDecoder decoder(RecordType::hydra_harp_v2, 1e-12);
  const auto bytes = record_bytes({0x02000005, 0x02000006});
  std::array<Tag, 8> out{};
  auto progress = decoder.decode(std::span(bytes).first(7), out);
  EXPECT_EQ(progress.bytes, 4U);
  EXPECT_EQ(progress.tags, 1U);
  progress = decoder.decode(std::span(bytes).subspan(4, 3), out);
  EXPECT_EQ(progress.bytes, 0U);
  EXPECT_EQ(progress.tags, 0U);
  progress = decoder.decode(std::span(bytes).subspan(4), out);
  EXPECT_EQ(progress.bytes, 4U);
  EXPECT_EQ(out[0], photon_tag(6, 1));
}

TEST(PtuDecode, StopsWhereTheRoomEnds) {
  PtuDecoder decoder(RecordType::hydra_harp_v2, 1e-12);
  const auto bytes = record_bytes({0xFE000001, 0x02000001, 0xFE000001, 0x02000002, 0x02000003});
  std::array<Tag, 3> out{};
  out[2] = photon_tag(-1, 77);
  const auto progress = decoder.decode(bytes, std::span(out).first(2));
  EXPECT_EQ(progress.bytes, 16U);
  EXPECT_EQ(progress.tags, 2U);
  EXPECT_EQ(out[0], photon_tag(wrap + 1, 1));
  EXPECT_EQ(out[1], photon_tag(2 * wrap + 2, 1));
  EXPECT_EQ(out[2], photon_tag(-1, 77)) << "written past the room given";
  EXPECT_EQ(decoder.decode(bytes, {}).bytes, 0U);
}

// The plainest reading of the format, to hold the decoder against.
std::vector<Tag> plainly_decoded(std::span<const std::uint32_t> records) {
  std::vector<Tag> tags;
  std::int64_t base = 0;
  for (const std::uint32_t record : records) {
    const bool special = (record & 0x80000000U) != 0;
    const int channel = static_cast<int>((record >> 25U) & 63U);
    const std::int64_t time = record & 0x1FFFFFFU;
    if (!special) {
      tags.push_back(photon_tag(base + time, channel));
    } else if (channel == 63) {
      base += wrap * (time == 0 ? 1 : time);
    } else if (channel == 0) {
      tags.push_back(sync_tag(base + time));
    } else if (channel < 16) {
      tags.push_back(marker_tag(base + time, channel));
    }
  }
  return tags;
}

TEST(PtuDecode, AnyBytesInAnyChunksAtAnyAlignmentDecodeAlike) {
  std::mt19937 random(7);
  std::vector<std::uint32_t> records(5'000);
  std::vector<std::byte> bytes(1);  // so that the records stand at odd addresses
  for (std::uint32_t& record : records) {
    record = static_cast<std::uint32_t>(random());
    if (random() % 8 == 0) record = 0xFE000000U | (record & 0xFFU);
    for (unsigned shift = 0; shift < 32; shift += 8) {
      bytes.push_back(static_cast<std::byte>((record >> shift) & 0xFFU));
    }
  }
  PtuDecoder decoder(RecordType::hydra_harp_v2, 1e-12);
  std::vector<Tag> tags;
  std::span<const std::byte> rest = std::span(bytes).subspan(1);
  std::array<Tag, 97> out{};
  while (rest.size() >= 4) {
    const std::size_t length = std::min<std::size_t>(rest.size(), 1 + random() % 700);
    const auto progress = decoder.decode(rest.first(length), std::span(out).first(random() % 98));
    tags.insert(tags.end(), out.begin(), out.begin() + static_cast<std::ptrdiff_t>(progress.tags));
    rest = rest.subspan(progress.bytes);
  }
  EXPECT_EQ(tags, plainly_decoded(records));
}

// Each time in ticks, at one go, by division in 128 bits; the counts of overflows go from 1 to so
// many that the next tag is years later.
TEST(PtuDecode, FractionsOfPicosecondsAreTheNearestAtAnyTime) {
  __extension__ using Wide = unsigned __int128;
  std::mt19937 random(8);
  std::vector<std::uint32_t> records(50'000);
  std::vector<std::byte> bytes;
  for (std::uint32_t& record : records) {
    record = static_cast<std::uint32_t>(random()) & 0x7FFFFFFFU;
    if (random() % 8 == 0) record = 0xFE000000U | ((record & 0x1FFFFFFU) >> random() % 26);
    for (const std::byte byte : record_bytes({record})) bytes.push_back(byte);
  }
  struct Fraction {
    std::int64_t numerator, denominator;
  };
  for (const auto [numerator, denominator] :
       {Fraction{125, 32}, {823, 10}, {1, 3}, {1'000'003, 7}, {1'048'609, 1'048'573}}) {
    std::vector<Tag> expected = plainly_decoded(records);
    for (Tag& tag : expected) {
      const auto twice = 2 * static_cast<Wide>(tag.time_ps) * numerator + denominator;
      tag.time_ps = static_cast<std::int64_t>(twice / (2 * denominator));
    }
    PtuDecoder decoder(RecordType::hydra_harp_v2,
                       1e-12 * static_cast<double>(numerator) / static_cast<double>(denominator));
    EXPECT_EQ(decode_all(decoder, bytes), expected) << numerator;
  }
}

TEST(PtuDecode, ADamagedFileWrapsAroundWithoutHarm) {
  PtuDecoder decoder(RecordType::hydra_harp_v2, 1e-3);
  std::vector<std::byte> bytes;
  for (int i = 0; i < 20'000; ++i) bytes.insert(bytes.end(), 4, std::byte{0xFF});
  EXPECT_THAT(decode_all(decoder, bytes), testing::IsEmpty());
  EXPECT_EQ(decoder.overflow_records(), 20'000U);
}

struct Streamed {
  std::map<std::string, std::size_t> counts;
  std::size_t total = 0;
  std::int64_t first_ps = 0;
  std::int64_t last_ps = 0;
  bool sorted = true;
  std::uint64_t overflow_records = 0;
  std::int64_t wraps = 0;
};

void count(const Tag& tag, Streamed& streamed) {
  if (streamed.total++ == 0) streamed.first_ps = streamed.last_ps = tag.time_ps;
  streamed.sorted = streamed.sorted && tag.time_ps >= streamed.last_ps;
  streamed.last_ps = tag.time_ps;
  const char* kinds[] = {"photon ", "sync ", "marker "};
  ++streamed.counts[kinds[static_cast<int>(tag.kind)] + std::to_string(tag.value)];
}

// As a file is read: chunks of an odd size, what is left over put before the next.
Streamed stream(const std::vector<std::byte>& file) {
  const auto header = parse_ptu_header(file, true);
  PtuDecoder decoder(header->record_type, header->resolution_s);
  Streamed streamed;
  std::vector<Tag> out(1'000);
  std::vector<std::byte> pending;
  for (std::size_t at = header->header_bytes; at < file.size(); at += 4'093) {
    const auto chunk = std::span(file).subspan(at, std::min<std::size_t>(4'093, file.size() - at));
    pending.insert(pending.end(), chunk.begin(), chunk.end());
    while (pending.size() >= 4) {
      const auto progress = decoder.decode(pending, out);
      pending.erase(pending.begin(), pending.begin() + static_cast<std::ptrdiff_t>(progress.bytes));
      for (std::size_t i = 0; i < progress.tags; ++i) count(out[i], streamed);
    }
  }
  EXPECT_EQ(decoder.unknown_records(), 0U);
  streamed.overflow_records = decoder.overflow_records();
  streamed.wraps = decoder.reached_ps() / wrap;
  return streamed;
}

TEST(PtuDecode, HydraHarpRecording) {
  const auto file = test::real_recording_path("hydraharp400_t2_hbt.ptu");
  if (!std::filesystem::exists(file))
    GTEST_SKIP() << "needs hydraharp400_t2_hbt.ptu in the folder SPLID_DATA";
  const Streamed streamed = stream(test::file_bytes(file));
  EXPECT_THAT(streamed.counts,
              ElementsAre(testing::Pair("photon 0", 159'298), testing::Pair("photon 1", 224'721)));
  EXPECT_EQ(streamed.overflow_records, 25'463U);
  EXPECT_EQ(streamed.wraps, 29'801);
  EXPECT_EQ(streamed.first_ps, 8'584'904);
  EXPECT_EQ(streamed.last_ps, 999'986'166'686);
  EXPECT_TRUE(streamed.sorted);
}

TEST(PtuDecode, QutagRecording) {
  const auto file = test::real_recording_path("qutag_sync_t2.ptu");
  if (!std::filesystem::exists(file))
    GTEST_SKIP() << "needs qutag_sync_t2.ptu in the folder SPLID_DATA";
  const Streamed streamed = stream(test::file_bytes(file));
  EXPECT_THAT(streamed.counts,
              ElementsAre(testing::Pair("photon 1", 43'736), testing::Pair("photon 2", 62'437),
                          testing::Pair("sync 0", 105'600)));
  EXPECT_NEAR(static_cast<double>(streamed.last_ps) * 1e-12, 0.2867, 1e-4);
  EXPECT_TRUE(streamed.sorted);
}

}  // namespace
}  // namespace splid
