#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "daemon/cloud/encoding.hpp"
#include "tests/support/cloud_bytes.hpp"
#include "tests/support/some_points.hpp"

namespace splid {
namespace {

using test::number_at;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string elements_of_two =
    "\nelement vertex 2\n"
    "property float x\nproperty float y\nproperty float z\n"
    "property float scalar_radial_velocity\n"
    "property float scalar_std_radial_velocity\n"
    "property float scalar_std_distance\n"
    "property float scalar_signal_per_pulse\n"
    "property float scalar_background_per_s\n"
    "property float scalar_significance\n"
    "property double scalar_time\n"
    "property uint scalar_pixel\n"
    "end_header\n";

TEST(Ply, AsTextHasALineForEachPoint) {
  const std::string text = test::encoded(*cloud::ply_encoding(true), test::some_points());
  EXPECT_THAT(text, StartsWith("ply\nformat ascii 1.0\ncomment "));
  EXPECT_THAT(text, HasSubstr("comment scalar_radial_velocity: m/s, receding positive\n"));
  EXPECT_THAT(text, EndsWith(elements_of_two +
                             "284.5 -12.25 3.5 -1.5 0.0625 0.0005 0.0125 62500 800.5 "
                             "1767225600.125 0\n"
                             "-2.75 0.5 0.125 150 nan 0.25 2 0 12 1767225600.175 4000000000\n"));
}

TEST(Ply, AsBinaryHasTheSameNumbers) {
  const std::string bytes = test::encoded(*cloud::ply_encoding(false), test::some_points());
  EXPECT_THAT(bytes, StartsWith("ply\nformat binary_little_endian 1.0\n"));
  ASSERT_THAT(bytes, HasSubstr(elements_of_two));
  const std::size_t first = bytes.find(elements_of_two) + elements_of_two.size();
  ASSERT_EQ(bytes.size(), first + 2 * 48);
  EXPECT_EQ(number_at<float>(bytes, first + 4), -12.25F);
  EXPECT_EQ(number_at<double>(bytes, first + 36), 1767225600.125);
  EXPECT_EQ(number_at<std::uint32_t>(bytes, first + 48 + 44), 4'000'000'000U);
}

}  // namespace
}  // namespace splid
