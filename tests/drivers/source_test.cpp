#include "drivers/source.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace splid {
namespace {

TEST(Source, DriversAreFoundByName) {
  EXPECT_THAT(source_names(), testing::IsSupersetOf({"replay", "simulator"}));
  EXPECT_NE(make_source_options("replay"), nullptr);
  EXPECT_EQ(make_source_options("no such driver"), nullptr);
}

}  // namespace
}  // namespace splid
