#include "daemon/stream/channel_map.hpp"

#include <gtest/gtest.h>

#include "protocol/error.hpp"

namespace splid {
namespace {

TEST(ChannelMap, DefaultsAreInputOneTheSyncAndMarkerOne) {
  const ChannelMap map{ChannelOptions{}};
  EXPECT_EQ(map.roles(photon_tag(0, 1)), role_photon);
  EXPECT_EQ(map.roles(photon_tag(0, 2)), 0);
  EXPECT_EQ(map.roles(sync_tag(0)), role_sync);
  EXPECT_EQ(map.roles(marker_tag(0, 1)), role_marker);
  EXPECT_EQ(map.roles(marker_tag(0, 3)), role_marker);
  EXPECT_EQ(map.roles(marker_tag(0, 2)), 0);
}

TEST(ChannelMap, ControlTagsWhateverTheirValue) {
  const ChannelMap map{ChannelOptions{}};
  for (const TagKind kind : {TagKind::heartbeat, TagKind::loss_begin, TagKind::loss_end,
                             TagKind::missed, TagKind::clock_break}) {
    for (const std::int32_t value : {-2'147'483'647 - 1, -1, 0, 1, 2'147'483'647}) {
      EXPECT_EQ(map.roles({0, value, kind, {}}), role_control);
    }
  }
}

TEST(ChannelMap, SeveralPhotonInputsAndTheSyncOnAnInput) {
  const ChannelMap map{ChannelOptions{{"-128", "0", "126"}, "5", ""}};
  for (int input = -300; input < 300; ++input) {
    const bool photon = input == -128 || input == 0 || input == 126;
    EXPECT_EQ(map.roles(photon_tag(0, input)), photon       ? role_photon
                                               : input == 5 ? role_sync
                                                            : 0)
        << input;
  }
  EXPECT_EQ(map.roles(sync_tag(0)), 0);
  EXPECT_EQ(map.roles(marker_tag(0, 1)), 0);
}

TEST(ChannelMap, MarkersThatComeTogetherHaveBothRoles) {
  const ChannelMap map{ChannelOptions{{"1"}, "marker:2", "marker:1"}};
  EXPECT_EQ(map.roles(marker_tag(0, 1)), role_marker);
  EXPECT_EQ(map.roles(marker_tag(0, 2)), role_sync);
  EXPECT_EQ(map.roles(marker_tag(0, 3)), role_sync | role_marker);
  EXPECT_EQ(map.roles(marker_tag(0, 12)), 0);
}

TEST(ChannelMap, RefusesWhatIsNoChannelNamingItsPlace) {
  try {
    ChannelMap map(ChannelOptions{{"1", "two"}, "sync", ""});
    FAIL() << "not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::usage);
    EXPECT_NE(std::string(error.what()).find("/channels/photon/1: \"two\""), std::string::npos)
        << error.what();
  }
  EXPECT_THROW(ChannelMap(ChannelOptions{{"1"}, "1", ""}), Error);
}

}  // namespace
}  // namespace splid
