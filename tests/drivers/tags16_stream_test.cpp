#include "drivers/tags16_stream.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <string>
#include <vector>

#include "tests/support/tags16_block.hpp"
#include "tests/support/vector_sink.hpp"

namespace splid {
namespace {

std::map<std::string, std::uint64_t> values(const Tags16Counters& counters) {
  std::map<std::string, std::uint64_t> all;
  for (const SourceCounter& each : counters.list()) all[each.name] = each.value;
  return all;
}

TEST(Tags16Stream, TagsGoToTheSinkAndAreCounted) {
  Tags16Counters counters;
  Tags16Stream stream(counters);
  test::VectorSink sink;
  const std::vector<std::byte> bytes = test::block_bytes({0, 0, 100, {{10, 1}, {20, 2}}});
  EXPECT_TRUE(stream.feed(bytes, sink));
  EXPECT_EQ(sink.tags,
            (std::vector<Tag>{photon_tag(10, 1), photon_tag(20, 2), heartbeat_tag(100)}));
  EXPECT_EQ(stream.reached_ps(), 100);
  EXPECT_EQ(values(counters)["splid_tags16_bytes_total"], bytes.size());
  EXPECT_EQ(values(counters)["splid_tags16_blocks_total"], 1U);
}

// The last bytes are used before the last tags have room.
TEST(Tags16Stream, ASinkOfLittleRoomGetsAllTagsToo) {
  std::vector<std::byte> bytes = test::block_bytes({0, 0, 100, {{10, 1}}});
  test::append_block({3, 300, 400, {{310, 2}}}, bytes);
  for (const std::size_t room : {1, 2, 3, 7}) {
    Tags16Counters counters;
    Tags16Stream stream(counters);
    test::VectorSink sink(room);
    EXPECT_TRUE(stream.feed(bytes, sink));
    EXPECT_EQ(sink.tags, (std::vector<Tag>{photon_tag(10, 1),
                                           heartbeat_tag(100),
                                           {100, 0, TagKind::loss_begin, {}},
                                           {300, -1, TagKind::loss_end, {}},
                                           photon_tag(310, 2),
                                           heartbeat_tag(400)}))
        << room;
  }
}

// As when a device is opened again: its decoder is a new one, but counters never fall.
TEST(Tags16Stream, CountersGoOnFromStreamToStream) {
  Tags16Counters counters;
  const std::vector<std::byte> bytes = test::block_bytes({5, 0, 100, {}});
  const std::vector<std::byte> garbage(50);
  for (int i = 0; i < 3; ++i) {
    Tags16Stream stream(counters);
    test::VectorSink sink;
    stream.feed(bytes, sink);
    stream.feed(garbage, sink);
    stream.cut();
    EXPECT_EQ(stream.counts().blocks, 1U);
  }
  EXPECT_EQ(values(counters)["splid_tags16_blocks_total"], 3U);
  EXPECT_EQ(values(counters)["splid_tags16_bytes_total"], 3 * (bytes.size() + garbage.size()));
  EXPECT_EQ(values(counters)["splid_tags16_bytes_skipped_total"], 3 * garbage.size());
}

// The first look may come late, on a busy machine.
TEST(Tags16News, BlocksThatAreMissingBeforeTheFirstLookAreTold) {
  Tags16News news;
  Tags16Counts counts;
  counts.blocks = 3;
  counts.lost_blocks = 5;
  counts.skipped_bytes = 100;  // of the block in whose middle the stream began
  Tags16News::Time now{};
  now += std::chrono::hours(1);
  EXPECT_EQ(news.since_last(counts, now), "tags were lost: 5 blocks missing by their numbers");
  now += std::chrono::seconds(2);
  EXPECT_EQ(news.since_last(counts, now), "");
  counts.skipped_bytes = 107;
  now += std::chrono::seconds(2);
  EXPECT_EQ(news.since_last(counts, now), "tags were lost: 7 bytes that belong to no block");
}

// What comes within 40 ms is one sentence, and a sentence comes once a second at most.
TEST(Tags16News, DamageIsToldTogetherAndSeldom) {
  using std::chrono::milliseconds;
  Tags16News news;
  Tags16Counts counts;
  counts.blocks = 1;
  Tags16News::Time now{};
  now += std::chrono::hours(1);
  EXPECT_EQ(news.since_last(counts, now), "");
  counts.lost_blocks = 1;
  EXPECT_EQ(news.since_last(counts, now + milliseconds{39}), "");
  counts.skipped_bytes = 7;
  now += milliseconds{40};
  EXPECT_EQ(news.since_last(counts, now),
            "tags were lost: 1 blocks missing by their numbers, 7 bytes that belong to no block");
  counts.lost_blocks = 3;
  EXPECT_EQ(news.since_last(counts, now + milliseconds{999}), "");
  now += milliseconds{1000};
  EXPECT_EQ(news.since_last(counts, now), "tags were lost: 2 blocks missing by their numbers");
  now += milliseconds{1000};
  EXPECT_EQ(news.since_last(counts, now), "");
}

}  // namespace
}  // namespace splid
