#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "daemon/cloud/encoding.hpp"
#include "tests/support/cloud_bytes.hpp"
#include "tests/support/some_points.hpp"

namespace splid {
namespace {

using ::testing::ElementsAre;
using ::testing::FloatNear;

std::vector<float> second_row(const std::string& layout, std::size_t values) {
  const std::string bytes = test::encoded(*cloud::rows_encoding(layout), test::some_points());
  EXPECT_EQ(bytes.size(), 2 * values * sizeof(float));
  std::vector<float> row;
  for (std::size_t i = 0; i < values; ++i) {
    row.push_back(test::number_at<float>(bytes, (values + i) * sizeof(float)));
  }
  return row;
}

// The time counts from the cloud's first point.
TEST(CloudRows, AreThoseThatTheDopplerOdometryReads) {
  EXPECT_THAT(second_row("dicp", 4), ElementsAre(-2.75F, 0.5F, 0.125F, 150));
  EXPECT_THAT(second_row("aeva", 5), ElementsAre(-2.75F, 0.5F, 0.125F, 150, FloatNear(5e7F, 1000)));
  EXPECT_THAT(second_row("boreas", 6),
              ElementsAre(-2.75F, 0.5F, 0.125F, 2, 150, FloatNear(0.05F, 1e-6F)));
}

// Open3D makes a point of each line, so there is no line besides.
TEST(Xyzd, IsALineOfFourNumbersForEachPoint) {
  EXPECT_EQ(test::encoded(*cloud::xyzd_encoding(), test::some_points()),
            "284.500000 -12.250000 3.500000 -1.500000\n"
            "-2.750000 0.500000 0.125000 150.000000\n");
}

}  // namespace
}  // namespace splid
