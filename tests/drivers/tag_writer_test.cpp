#include "drivers/tag_writer.hpp"

#include <gtest/gtest.h>

#include <stop_token>

#include "tests/support/vector_sink.hpp"

namespace splid {
namespace {

TEST(TagWriter, HandsOnFullRoomsAndTheRest) {
  test::VectorSink sink(2);
  TagWriter writer(sink);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(writer.put(sync_tag(i)));
  EXPECT_EQ(sink.tags.size(), 4U);
  writer.publish();
  writer.publish();
  ASSERT_EQ(sink.tags.size(), 5U);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(sink.tags[i], sync_tag(i));
}

TEST(TagWriter, WritesNothingAfterAStop) {
  std::stop_source stop;
  test::VectorSink sink(2, stop.get_token());
  TagWriter writer(sink);
  EXPECT_TRUE(writer.put(sync_tag(1)));
  EXPECT_TRUE(writer.put(sync_tag(2)));
  stop.request_stop();
  EXPECT_FALSE(writer.put(sync_tag(3)));
  writer.publish();
  EXPECT_EQ(sink.tags.size(), 2U);
}

}  // namespace
}  // namespace splid
