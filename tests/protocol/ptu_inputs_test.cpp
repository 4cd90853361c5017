#include "protocol/ptu_inputs.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace splid {
namespace {

std::vector<std::optional<std::uint32_t>> given(PtuInputs& inputs,
                                                const std::vector<std::int32_t>& asked) {
  std::vector<std::optional<std::uint32_t>> channels;
  for (const std::int32_t input : asked) channels.push_back(inputs.channel_of(input));
  return channels;
}

TEST(PtuInputs, AnInputHasTheChannelOfItsNumberAndAnyOtherAFreeOne) {
  PtuInputs own;
  EXPECT_THAT(given(own, {1, 62, 63, -1, 0, 126, -1, 1, 61, 60}),
              testing::ElementsAre(1, 62, 63, 61, 60, 59, 61, 1, 58, 57));
  EXPECT_EQ(own.text(), "57:60 58:61 59:126 60:0 61:-1");
  PtuInputs of_others(0);
  EXPECT_THAT(given(of_others, {0, 63, 1}), testing::ElementsAre(0, 63, 1));
  EXPECT_EQ(of_others.text(), "");
  for (int channel = 0; channel < 64; ++channel) EXPECT_EQ(of_others.input_of(channel), channel);
}

TEST(PtuInputs, HoldsSixtyFourInputsOfWhateverNumbers) {
  for (const std::int32_t first : {-128, 0, 1, 63, std::numeric_limits<std::int32_t>::min()}) {
    PtuInputs inputs;
    for (std::int32_t i = 0; i < 64; ++i) {
      const auto channel = inputs.channel_of(first + i);
      ASSERT_TRUE(channel) << first << " " << i;
      EXPECT_EQ(inputs.input_of(*channel), first + i);
    }
    EXPECT_FALSE(inputs.channel_of(first + 64));
    EXPECT_LE(inputs.text().size(), PtuInputs::most_chars);
    const auto read = PtuInputs::from_text(inputs.text(), 1);
    ASSERT_TRUE(read) << inputs.text();
    EXPECT_EQ(read->text(), inputs.text());
  }
}

TEST(PtuInputs, ReadsNoListThatIsNone) {
  EXPECT_TRUE(PtuInputs::from_text("", 0));
  EXPECT_TRUE(PtuInputs::from_text("0:2147483647 63:-2147483648", 0));
  for (const char* text : {"62", "62:", ":1", "64:1", "-1:1", "62:1 62:2", "62:1 61:1", "62:1x",
                           "62:2147483648", "1:2:3", " 62:1"}) {
    EXPECT_FALSE(PtuInputs::from_text(text, 0)) << text;
  }
}

}  // namespace
}  // namespace splid
