#include "config/channel_name.hpp"

#include <gtest/gtest.h>

namespace splid {
namespace {

TEST(ChannelName, NamesSyncMarkersAndInputs) {
  ASSERT_TRUE(parse_channel("sync"));
  EXPECT_EQ(parse_channel("sync")->kind, TagKind::sync);
  ASSERT_TRUE(parse_channel("marker:15"));
  EXPECT_EQ(parse_channel("marker:15")->kind, TagKind::marker);
  EXPECT_EQ(parse_channel("marker:15")->value, 15);
  ASSERT_TRUE(parse_channel("0"));
  EXPECT_EQ(parse_channel("0")->kind, TagKind::photon);
  ASSERT_TRUE(parse_channel("-128"));
  EXPECT_EQ(parse_channel("-128")->value, -128);
  EXPECT_TRUE(parse_channel("126"));
}

TEST(ChannelName, RefusesAllElse) {
  for (const char* name : {"", "marker", "marker:", "marker:0", "marker:16", "marker:1x", "Sync",
                           " 1", "1 ", "+1", "1.0", "127", "-129", "99999999999"}) {
    EXPECT_FALSE(parse_channel(name)) << name;
  }
}

TEST(ChannelName, MarkerMatchesTagsWithAllItsBits) {
  const ChannelName marker = *parse_channel("marker:3");
  EXPECT_TRUE(marker.matches(marker_tag(0, 3)));
  EXPECT_TRUE(marker.matches(marker_tag(0, 7)));
  EXPECT_FALSE(marker.matches(marker_tag(0, 1)));
  EXPECT_FALSE(marker.matches(photon_tag(0, 3)));
}

TEST(ChannelName, InputAndSyncMatchTheirOwnTags) {
  EXPECT_TRUE(parse_channel("4")->matches(photon_tag(0, 4)));
  EXPECT_FALSE(parse_channel("4")->matches(photon_tag(0, 5)));
  EXPECT_FALSE(parse_channel("4")->matches(marker_tag(0, 4)));
  EXPECT_TRUE(parse_channel("sync")->matches(sync_tag(0)));
  EXPECT_FALSE(parse_channel("0")->matches(sync_tag(0)));
}

TEST(ChannelName, OverlapWhereATagCouldBelongToBoth) {
  const auto both = [](const char* a, const char* b) {
    return overlap(*parse_channel(a), *parse_channel(b));
  };
  EXPECT_TRUE(both("1", "1"));
  EXPECT_TRUE(both("sync", "sync"));
  EXPECT_TRUE(both("marker:1", "marker:3"));
  EXPECT_FALSE(both("marker:1", "marker:2"));
  EXPECT_FALSE(both("1", "2"));
  EXPECT_FALSE(both("1", "marker:1"));
  EXPECT_FALSE(both("0", "sync"));
}

}  // namespace
}  // namespace splid
