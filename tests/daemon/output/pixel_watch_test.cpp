#include "daemon/output/pixel_watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace splid {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;

// A frame of 250 ms whose pixels have so many photons.
SceneMessage scene_of(const std::vector<std::uint64_t>& photons) {
  SceneMessage scene;
  scene.whole.duration_ms = 250;
  scene.whole.lost_tags = 7;
  for (std::size_t i = 0; i < photons.size(); ++i) {
    FrameMessage frame;
    frame.status = photons[i] > 0 ? FrameStatus::ok : FrameStatus::no_target;
    frame.photons = photons[i];
    frame.lost_tags = 7;
    scene.pixels.push_back({"p" + std::to_string(i), {}, {}, frame});
  }
  return scene;
}

TEST(PixelWatch, NamesThePixelsThatCountNothingForASecond) {
  PixelWatch watch;
  SceneMessage scene = scene_of({100, 0, 120, 0});
  for (int i = 0; i < 3; ++i) watch.add(scene);
  EXPECT_EQ(watch.seen().dark, 0U);
  scene.pixels[3].frame.photons = 1;
  watch.add(scene);
  EXPECT_EQ(watch.seen().count, 4U);
  EXPECT_THAT(watch.seen().by_status, ElementsAre(Pair("no_target", 2), Pair("ok", 2)));
  EXPECT_EQ(watch.seen().dark, 1U);
  EXPECT_THAT(watch.seen().dark_names, ElementsAre("p1"));
  EXPECT_EQ(watch.seen().hot, 0U);
  EXPECT_THAT(in_words(watch.seen()), HasSubstr("pixel p1 counts nothing"));
  for (int i = 0; i < 4; ++i) watch.add(scene_of({1, 1, 1, 1}));
  EXPECT_EQ(watch.seen().dark, 0U);
  EXPECT_EQ(in_words(watch.seen()), "");
}

TEST(PixelWatch, NamesThePixelsThatNeverStop) {
  PixelWatch watch;
  SceneMessage scene = scene_of({100, 2001, 100, 100, 100});
  scene.pixels[3].frame.lost_tags = 8;
  for (int i = 0; i < 4; ++i) watch.add(scene);
  EXPECT_THAT(watch.seen().hot_names, ElementsAre("p1", "p3"));
  EXPECT_THAT(watch.seen().dark_names, IsEmpty());
  EXPECT_THAT(in_words(watch.seen()), HasSubstr("pixels p1, p3 count far more than the others"));
}

TEST(PixelWatch, NamesSixteenAtMost) {
  PixelWatch watch;
  for (int i = 0; i < 4; ++i) watch.add(scene_of(std::vector<std::uint64_t>(20, 0)));
  EXPECT_EQ(watch.seen().dark, 20U);
  EXPECT_EQ(watch.seen().dark_names.size(), 16U);
  EXPECT_THAT(in_words(watch.seen()), HasSubstr("p15 and 4 more count nothing"));
}

}  // namespace
}  // namespace splid
