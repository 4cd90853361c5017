#include "drivers/usb/usb_id.hpp"

#include <gtest/gtest.h>

namespace splid::usb {
namespace {

TEST(UsbId, IsWrittenAsLsusbDoes) {
  EXPECT_EQ(to_string(Id{0x04b4, 0x123a}), "04b4:123a");
  EXPECT_EQ(parse_id("04B4:123a"), (Id{0x04b4, 0x123a}));
  EXPECT_EQ(parse_id("ffff:0000"), (Id{0xFFFF, 0}));
}

TEST(UsbId, AnythingElseIsNone) {
  for (const char* text : {"", "04b4", "04b4:123", "04b4:123g", "04b4-123a", "04b4:123a ",
                           "-4b4:123a", "0x4b:123a", "04b4:12 a"}) {
    EXPECT_FALSE(parse_id(text)) << text;
  }
}

}  // namespace
}  // namespace splid::usb
