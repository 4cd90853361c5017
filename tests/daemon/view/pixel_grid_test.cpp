#include "daemon/view/pixel_grid.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace splid::view {
namespace {

using ::testing::ElementsAre;
using Directions = std::vector<std::pair<double, double>>;

std::vector<SceneMessage::Pixel> pixels_at(const Directions& directions) {
  std::vector<SceneMessage::Pixel> pixels;
  for (const auto& [azimuth_deg, elevation_deg] : directions) {
    pixels.push_back({"", azimuth_deg, elevation_deg, {}});
  }
  return pixels;
}

TEST(PixelGrid, CountsCellsFromTheUpperLeftWhateverTheOrderOfThePixels) {
  // A cell is empty. What differs by less than a microdegree is the same row.
  const auto grid =
      pixel_grid(pixels_at({{0.1, -1}, {-0.1, 2}, {0, 2.0000001}, {0.1, 2}, {-0.1, -1}}));
  ASSERT_TRUE(grid);
  EXPECT_EQ(grid->columns, 3U);
  EXPECT_EQ(grid->rows, 2U);
  EXPECT_THAT(grid->cells, ElementsAre(5, 0, 1, 2, 3));
}

TEST(PixelGrid, IsNoneWithoutDirectionsTwiceTheSameOrMostlyEmpty) {
  auto pixels = pixels_at({{0, 0}, {1, 0}});
  EXPECT_TRUE(pixel_grid(pixels));
  pixels[1].elevation_deg.reset();
  EXPECT_FALSE(pixel_grid(pixels));
  EXPECT_FALSE(pixel_grid(pixels_at({{0, 0}, {0, 0}})));
  EXPECT_TRUE(pixel_grid(pixels_at({{0, 0}, {1, 1}})));
  EXPECT_FALSE(pixel_grid(pixels_at({{0, 0}, {1, 1}, {2, 2}})));
}

}  // namespace
}  // namespace splid::view
