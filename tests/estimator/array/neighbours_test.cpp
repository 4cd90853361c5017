#include "estimator/array/neighbours.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace splid::array {
namespace {

using ::testing::ElementsAre;
using ::testing::UnorderedElementsAre;

// 4 x 3 pixels, row by row.
std::vector<PixelDirection> grid() {
  std::vector<PixelDirection> directions;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) directions.push_back({0.2 * column, -0.2 * row});
  }
  return directions;
}

TEST(Neighbours, AreInRingsTheNearestFirst) {
  const Neighbours neighbours(grid(), 2);
  EXPECT_THAT(neighbours.around(0, 0), ElementsAre(0U));
  EXPECT_THAT(neighbours.around(0, 1), ElementsAre(0U, 1U, 4U, 5U));
  EXPECT_THAT(neighbours.around(5, 1), UnorderedElementsAre(5U, 1U, 4U, 6U, 9U, 0U, 2U, 8U, 10U));
  EXPECT_THAT(neighbours.around(5, 1).first(5), UnorderedElementsAre(5U, 1U, 4U, 6U, 9U));
  EXPECT_EQ(neighbours.around(5, 1).front(), 5U);
  EXPECT_EQ(neighbours.around(5, 2).size(), 12U);
  EXPECT_EQ(neighbours.around(0, 2).size(), 9U);
}

TEST(Neighbours, PixelsOfOneDirectionAreNeighbours) {
  const std::vector<PixelDirection> same(3);
  const Neighbours neighbours(same, 1);
  EXPECT_THAT(neighbours.around(1, 1), UnorderedElementsAre(0U, 1U, 2U));
  const std::vector<PixelDirection> one(1);
  EXPECT_THAT(Neighbours(one, 1).around(0, 1), ElementsAre(0U));
}

}  // namespace
}  // namespace splid::array
