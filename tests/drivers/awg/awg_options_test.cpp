#include "drivers/awg/awg_options.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace splid::awg {
namespace {

using ::testing::HasSubstr;

TEST(AwgOptions, ThePortIsThatOfScpi) {
  EXPECT_EQ(socket_address("10.0.0.5"), "tcp:10.0.0.5:5025");
  EXPECT_EQ(socket_address("awg.lab:1"), "tcp:awg.lab:1");
}

TEST(AwgOptions, TheDefaultsAreAllowed) { EXPECT_FALSE(Options{}.validate()); }

TEST(AwgOptions, LevelsAreThoseOfTheModel) {
  Options options;
  options.pulse_v = 1;  // the whole range
  EXPECT_FALSE(options.validate());
  options.pulse_v = 1.001;
  EXPECT_EQ(options.validate()->pointer, "/pulse_v");
  EXPECT_THAT(options.validate()->what, HasSubstr("1.001 V; it must be from 0.075 to 1"));
  options.pulse_v = -0.05;
  EXPECT_EQ(options.validate()->pointer, "/pulse_v");
  options.rest_v = 0.2;
  EXPECT_FALSE(options.validate());
  options.marker_v = 1.5;
  EXPECT_EQ(options.validate()->pointer, "/marker_v");
  options.model = 2;  // M8190A
  EXPECT_FALSE(options.validate());
}

TEST(AwgOptions, TheAddressHasAForm) {
  Options options;
  for (const char* address : {":5025", "a:", "a:0", "a:65536", "a:x"}) {
    options.address = address;
    ASSERT_TRUE(options.validate()) << address;
    EXPECT_EQ(options.validate()->pointer, "/address");
    EXPECT_THAT(options.validate()->what, HasSubstr("\" is not HOST or HOST:PORT"));
  }
  options.address = "awg.lab:65535";
  EXPECT_FALSE(options.validate());
}

}  // namespace
}  // namespace splid::awg
