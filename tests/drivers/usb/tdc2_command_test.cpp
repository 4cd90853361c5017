#include "drivers/usb/tdc2_command.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace splid::usb {
namespace {

using ::testing::ElementsAre;

std::vector<int> numbers(const std::vector<std::byte>& bytes) {
  std::vector<int> values;
  for (const std::byte byte : bytes) values.push_back(std::to_integer<int>(byte));
  return values;
}

TEST(Tdc2Command, IsLengthNumberArgumentsAndSum) {
  EXPECT_THAT(numbers(tdc2_command(Tdc2Command::reset_transfer)), ElementsAre(3, 61, 64));
  EXPECT_THAT(numbers(tdc2_command(Tdc2Command::configure, {2})), ElementsAre(4, 85, 2, 91));
  EXPECT_THAT(numbers(tdc2_command16(Tdc2Command::write_config, 0x80FF)),
              ElementsAre(5, 54, 0xFF, 0x80, (5 + 54 + 0xFF + 0x80) & 0xFF));
  EXPECT_THAT(numbers(tdc2_command32(Tdc2Command::write_parameters, 0xFFFFFFFF)),
              ElementsAre(7, 64, 0xFF, 0xFF, 0xFF, 0xFF, (7 + 64 + 4 * 0xFF) & 0xFF));
  EXPECT_THAT(numbers(tdc2_command32(Tdc2Command::read_ram, 0)),
              ElementsAre(7, 81, 0, 0, 0, 0, 88));
}

TEST(Tdc2Command, ThresholdsAreStepsOf750MicrovoltsOfTheOutputWiredInReverse) {
  EXPECT_EQ(tdc2_threshold(1, -1024), 0x3000);
  EXPECT_EQ(tdc2_threshold(1, -1023.25), 0x3001);
  EXPECT_EQ(tdc2_threshold(2, -448), 0x2000 | 768);
  EXPECT_EQ(tdc2_threshold(3, 0), 0x1000 | 1365);
  EXPECT_EQ(tdc2_threshold(4, 2047.25), 0x0FFF);
}

// The edge follows the threshold, and every second input's lines are swapped.
TEST(Tdc2Command, PolarityFollowsTheThreshold) {
  EXPECT_EQ(tdc2_polarity(1, -448), 0x472D);
  EXPECT_EQ(tdc2_polarity(2, -448), 0x5B0E);
  EXPECT_EQ(tdc2_polarity(1, -0.25), 0x472D);
  EXPECT_EQ(tdc2_polarity(1, 0.5), 0x4B0E);
  EXPECT_EQ(tdc2_polarity(3, 1000), 0x6B0E);
  EXPECT_EQ(tdc2_polarity(4, 1000), 0x772D);
}

}  // namespace
}  // namespace splid::usb
