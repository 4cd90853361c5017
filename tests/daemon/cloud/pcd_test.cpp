#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "daemon/cloud/encoding.hpp"
#include "tests/support/cloud_bytes.hpp"
#include "tests/support/some_points.hpp"

namespace splid {
namespace {

using test::number_at;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string head_of_two =
    "\nVERSION 0.7\n"
    "FIELDS x y z radial_velocity std_radial_velocity std_distance signal_per_pulse "
    "background_per_s significance time pixel\n"
    "SIZE 4 4 4 4 4 4 4 4 4 8 4\n"
    "TYPE F F F F F F F F F F U\n"
    "COUNT 1 1 1 1 1 1 1 1 1 1 1\n"
    "WIDTH 2\n"
    "HEIGHT 1\n"
    "VIEWPOINT 0 0 0 1 0 0 0\n"
    "POINTS 2\n";

TEST(Pcd, AsTextHasALineForEachPoint) {
  const std::string text = test::encoded(*cloud::pcd_encoding(true), test::some_points());
  EXPECT_THAT(text, StartsWith("# .PCD v0.7"));
  EXPECT_THAT(text, HasSubstr("# radial_velocity: m/s, receding positive\n"));
  EXPECT_THAT(text, HasSubstr(head_of_two +
                              "DATA ascii\n"
                              "284.5 -12.25 3.5 -1.5 0.0625 0.0005 0.0125 62500 800.5 "
                              "1767225600.125 0\n"
                              "-2.75 0.5 0.125 150 nan 0.25 2 0 12 1767225600.175 4000000000\n"));
}

TEST(Pcd, AsBinaryHasTheSameNumbers) {
  const std::string bytes = test::encoded(*cloud::pcd_encoding(false), test::some_points());
  const std::string data = "DATA binary\n";
  ASSERT_THAT(bytes, HasSubstr(head_of_two + data));
  const std::size_t second = bytes.find(data) + data.size() + 48;
  ASSERT_EQ(bytes.size(), second + 48);
  EXPECT_EQ(number_at<float>(bytes, second - 48), 284.5F);
  EXPECT_EQ(number_at<float>(bytes, second), -2.75F);
  EXPECT_EQ(number_at<float>(bytes, second + 12), 150.0F);
  EXPECT_TRUE(std::isnan(number_at<float>(bytes, second + 16)));
  EXPECT_EQ(number_at<double>(bytes, second + 36), 1767225600.175);
  EXPECT_EQ(number_at<std::uint32_t>(bytes, second + 44), 4'000'000'000U);
}

}  // namespace
}  // namespace splid
