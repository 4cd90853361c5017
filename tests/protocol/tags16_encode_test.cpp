#include "protocol/tags16_encode.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "tests/support/tags16_block.hpp"

namespace splid {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

Tag control_tag(TagKind kind, std::int64_t time_ps, int value = 0) {
  return {time_ps, value, kind, {}};
}

// As a server sends them and a client reads them; a span becomes as many blocks as it takes.
class Wire {
 public:
  explicit Wire(std::size_t room = std::size_t{1} << 15U) : room_(room) {}

  std::vector<Tag> pass(const std::vector<Tag>& tags) {
    std::span<const Tag> left = tags;
    std::vector<Tag> got;
    do {
      const auto done = encoder.encode(left, room_);
      left = left.subspan(done.tags);
      const auto bytes = std::span(room_).first(done.bytes);
      last_block.assign(bytes.begin(), bytes.end());
      std::vector<Tag> out(room_.size() / Tags16Decoder::tag_bytes);
      const auto decoded = decoder.decode(bytes, out);
      EXPECT_EQ(decoded.bytes, bytes.size());
      got.insert(got.end(), out.begin(), out.begin() + static_cast<std::ptrdiff_t>(decoded.tags));
    } while (!left.empty());
    return got;
  }

  Tags16Encoder encoder;
  Tags16Decoder decoder;
  std::vector<std::byte> last_block;

 private:
  std::vector<std::byte> room_;
};

TEST(Tags16Encode, ABlockHasTheBytesOfTheManual) {
  Wire wire;
  wire.pass({photon_tag(1000, 1), sync_tag(2000), marker_tag(3000, 5), photon_tag(3500, -1),
             control_tag(TagKind::loss_begin, 4000), control_tag(TagKind::missed, 4500, 513),
             control_tag(TagKind::loss_end, 5000), heartbeat_tag(6000)});
  EXPECT_EQ(wire.last_block, test::block_bytes({0,
                                                1000,
                                                6000,
                                                {{1000, 1, 0},
                                                 {2000, 0, 5},
                                                 {3000, 5, 6},
                                                 {3500, -1, 0},
                                                 {4000, 0, 2},
                                                 {4500, 0, 4, 513},
                                                 {5000, 0, 3}}}));
  wire.pass({});
  EXPECT_EQ(wire.last_block, test::block_bytes({1, 6000, 6000, {}}));
}

TEST(Tags16Encode, SmallestAndLargestNumbers) {
  constexpr auto max_ps = std::numeric_limits<std::int64_t>::max();
  constexpr auto max_input = std::numeric_limits<std::int32_t>::max();
  Wire wire;
  EXPECT_THAT(wire.pass({photon_tag(0, 0)}), ElementsAre(photon_tag(0, 0), heartbeat_tag(0)));
  Wire last;
  EXPECT_THAT(last.pass({photon_tag(max_ps, max_input), photon_tag(max_ps, -max_input - 1)}),
              ElementsAre(photon_tag(max_ps, max_input), photon_tag(max_ps, -max_input - 1),
                          heartbeat_tag(max_ps)));
}

// Whatever time its clock then has, nothing is missing before it.
TEST(Tags16Encode, BeforeAnyTagBlocksTellNoTime) {
  constexpr std::int64_t first_ps = 340'000'000'000'000'000;
  Wire wire;
  EXPECT_THAT(wire.pass({}), IsEmpty());
  EXPECT_EQ(wire.last_block, test::block_bytes({0, tags16::no_time_ps, tags16::no_time_ps, {}}));
  wire.encoder.tell(NoticeKind::absent, "no MultiHarp is plugged in");
  EXPECT_THAT(wire.pass({}), IsEmpty());
  EXPECT_EQ(wire.decoder.notice().kind, NoticeKind::absent);
  EXPECT_EQ(wire.decoder.notice().text, "no MultiHarp is plugged in");
  EXPECT_THAT(wire.pass({photon_tag(first_ps, 1)}),
              ElementsAre(photon_tag(first_ps, 1), heartbeat_tag(first_ps)));
  EXPECT_EQ(wire.decoder.counts().blocks, 3U);
}

// Whatever the events and the room, and out of order by less than 1 us.
TEST(Tags16Encode, EventsComeOutAsTheyWentIn) {
  std::mt19937 random(3);
  for (const std::size_t room : {Tags16Encoder::least_room, std::size_t{1} << 15U}) {
    Wire wire(room);
    std::int64_t time_ps = 340'000'000'000'000'000;
    for (int span = 0; span < 50; ++span) {
      std::vector<Tag> tags;
      for (std::size_t i = random() % 1000; i > 0; --i) {
        time_ps += random() % 1000;
        const std::int64_t at_ps = time_ps - static_cast<std::int64_t>(random() % 1000) * 400;
        const auto kind = random() % 3;
        tags.push_back(kind == 0   ? sync_tag(at_ps)
                       : kind == 1 ? marker_tag(at_ps, 1 + static_cast<int>(random() % 15))
                                   : photon_tag(at_ps, static_cast<int>(random() % 64)));
      }
      std::vector<Tag> got = wire.pass(tags);
      std::erase_if(got, [](const Tag& tag) { return tag.kind == TagKind::heartbeat; });
      ASSERT_EQ(got, tags);
    }
  }
}

TEST(Tags16Encode, LargeCountsOfLossesAddUp) {
  constexpr int count = 50'000'000;
  Wire wire(Tags16Encoder::least_room);
  std::int64_t missed = 0;
  for (const Tag& tag :
       wire.pass({photon_tag(5, 1), control_tag(TagKind::missed, 6, count),
                  control_tag(TagKind::loss_begin, 7), control_tag(TagKind::loss_end, 8, count)})) {
    if (tag.kind == TagKind::missed) missed += tag.value;
    if (tag.kind == TagKind::loss_end) {
      EXPECT_EQ(tag, control_tag(TagKind::loss_end, 8, 0));
    }
  }
  EXPECT_EQ(missed, 2 * std::int64_t{count});
}

TEST(Tags16Encode, ALossOfUnknownCountIsOne) {
  Wire wire;
  EXPECT_THAT(
      wire.pass({control_tag(TagKind::loss_begin, 7), control_tag(TagKind::loss_end, 9, -1)}),
      ElementsAre(control_tag(TagKind::loss_begin, 7), control_tag(TagKind::loss_end, 9, -1),
                  heartbeat_tag(9)));
}

// A step back is a new clock to whoever reads it; a step ahead has to be told.
TEST(Tags16Encode, AClockThatBreaksIsToldOnce) {
  constexpr std::int64_t second_ps = 1'000'000'000'000;
  const Tag clock_break = control_tag(TagKind::clock_break, second_ps);
  Wire back;
  back.pass({photon_tag(second_ps, 1)});
  EXPECT_THAT(
      back.pass({clock_break, photon_tag(5, 1), heartbeat_tag(10)}),
      ElementsAre(control_tag(TagKind::clock_break, 5), photon_tag(5, 1), heartbeat_tag(10)));
  Wire ahead;
  ahead.pass({photon_tag(second_ps, 1)});
  EXPECT_THAT(ahead.pass({clock_break}), ElementsAre(heartbeat_tag(second_ps)));
  EXPECT_THAT(
      ahead.pass({heartbeat_tag(2 * second_ps)}),
      ElementsAre(control_tag(TagKind::loss_begin, second_ps),
                  control_tag(TagKind::loss_end, 2 * second_ps, -1),
                  control_tag(TagKind::clock_break, 2 * second_ps), heartbeat_tag(2 * second_ps)));
}

TEST(Tags16Encode, ATagFarOutOfOrderIsOneMissed) {
  Wire wire;
  wire.pass({photon_tag(10'000'000, 1)});
  EXPECT_THAT(wire.pass({photon_tag(8'999'999, 1), photon_tag(9'000'000, 2)}),
              ElementsAre(control_tag(TagKind::missed, 9'000'000, 1), photon_tag(9'000'000, 2),
                          heartbeat_tag(10'000'000)));
}

TEST(Tags16Encode, SentencesOfAnyLengthArrive) {
  Wire wire;
  for (std::size_t length = 0; length < 300; ++length) {
    const std::string text(length, 'x');
    wire.encoder.tell(NoticeKind::caution, text);
    wire.pass({photon_tag(1000, 1)});
    ASSERT_EQ(wire.decoder.notice().number, length + 1);
    ASSERT_EQ(wire.decoder.notice().text,
              text.substr(0, std::min(length, tags16::max_text_bytes - 1)));
  }
  wire.encoder.tell(NoticeKind::event, std::string("a\0b", 3));
  wire.pass({});
  EXPECT_EQ(wire.decoder.event().text, "a");
}

TEST(Tags16Encode, MoreSentencesThanABlockHasRoomForGoIntoTheNext) {
  Wire wire(Tags16Encoder::least_room);
  for (int i = 0; i < 20; ++i) wire.encoder.tell(NoticeKind::event, std::string(250, 'y'));
  for (int i = 0; i < 10; ++i) {
    const auto tags = wire.pass({photon_tag(i, 1)});
    EXPECT_EQ(tags.front(), photon_tag(i, 1));
  }
  EXPECT_EQ(wire.decoder.event().number, 20U);
}

}  // namespace
}  // namespace splid
