#include "protocol/photon_hdf5_decode.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "protocol/error.hpp"
#include "tests/support/error_text.hpp"

namespace splid {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// All tags, by blocks of at most `room`.
std::vector<Tag> decoded(PhotonHdf5Decoder& decoder, const std::vector<PhotonHdf5Record>& records,
                         std::size_t room = 100) {
  auto bytes = std::as_bytes(std::span(records));
  std::vector<Tag> all;
  std::vector<Tag> block(room);
  for (;;) {
    const auto progress = decoder.decode(bytes, block);
    bytes = bytes.subspan(progress.bytes);
    all.insert(all.end(), block.begin(),
               block.begin() + static_cast<std::ptrdiff_t>(progress.tags));
    if (progress.tags == 0 && bytes.size() < decoder.record_bytes()) return all;
  }
}

TEST(PhotonHdf5Decode, TimestampsAreTimesInT2) {
  PhotonHdf5Decoder decoder(1, std::nullopt);
  EXPECT_THAT(decoded(decoder, {{3, 0, 0}, {340'000'000'000'000'007, 0, 62}}),
              ElementsAre(photon_tag(3, 0), photon_tag(340'000'000'000'000'007, 62)));
  EXPECT_EQ(decoder.reached_ps(), 340'000'000'000'000'007);
  EXPECT_EQ(decoder.unknown_records(), 0U);
}

TEST(PhotonHdf5Decode, TimesAreRoundedOncePerTimestamp) {
  // 1e12 + 1 of 3.90625 ps are 3,906,250,000,003.90625 ps.
  PhotonHdf5Decoder decoder(3.90625, std::nullopt);
  EXPECT_THAT(decoded(decoder, {{1'000'000'000'001, 0, 0}, {-2, 0, 0}}),
              ElementsAre(photon_tag(3'906'250'000'004, 0), photon_tag(-8, 0)));
}

TEST(PhotonHdf5Decode, WithNanotimesEachPeriodBeginsWithItsSync) {
  const std::vector<PhotonHdf5Record> records = {
      {2, 5, 0}, {2, 100, 1}, {7, 0, 0}, {7, 65'535, 3}, {1'000'000, 1, -1}};
  const std::vector<Tag> expected = {sync_tag(10'000'000),      photon_tag(10'000'080, 0),
                                     photon_tag(10'001'600, 1), sync_tag(35'000'000),
                                     photon_tag(35'000'000, 0), photon_tag(36'048'560, 3)};
  for (const std::size_t room : {1U, 2U, 3U, 100U}) {
    PhotonHdf5Decoder decoder(5e6, 16e-12);
    EXPECT_EQ(decoded(decoder, records, room), expected) << room;
    EXPECT_EQ(decoder.unknown_records(), 1U);
  }
}

TEST(PhotonHdf5Decode, DetectorsThatNoRecordingHasAreCountedAndLeftOut) {
  PhotonHdf5Decoder decoder(1, std::nullopt);
  EXPECT_THAT(decoded(decoder, {{1, 0, 63}, {2, 0, -1}, {3, 0, 1'000'000}}), IsEmpty());
  EXPECT_EQ(decoder.unknown_records(), 3U);
}

// Times wrap rather than overflow, which the sanitizer would see.
TEST(PhotonHdf5Decode, TimestampsOfADamagedFileAreNoOverflow) {
  constexpr auto least = std::numeric_limits<std::int64_t>::min();
  constexpr auto most = std::numeric_limits<std::int64_t>::max();
  for (const double unit_ps : {1.0, 12'500.0, 1e12}) {
    PhotonHdf5Decoder t2(unit_ps, std::nullopt);
    EXPECT_EQ(decoded(t2, {{least, 0, 0}, {most, 0, 0}}).size(), 2U);
    PhotonHdf5Decoder t3(unit_ps, 1e-3);
    EXPECT_EQ(decoded(t3, {{least, 0xFFFF'FFFF, 0}, {most, 0xFFFF'FFFF, 0}}).size(), 4U);
  }
}

TEST(PhotonHdf5Decode, UnitsOutsideAreRefused) {
  for (const double unit_ps : {0.0, -1.0, 1e13, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(PhotonHdf5Decoder(unit_ps, std::nullopt), Error) << unit_ps;
  }
  for (const double step_s : {0.0, -1e-12, 1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(PhotonHdf5Decoder(5e6, step_s), Error) << step_s;
  }
}

}  // namespace
}  // namespace splid
