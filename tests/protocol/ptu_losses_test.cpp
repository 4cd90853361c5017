#include "protocol/ptu_losses.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>

namespace splid {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::Optional;

TEST(PtuLosses, Text) {
  EXPECT_EQ(losses_to_text({}, 100), "");
  EXPECT_EQ(losses_to_text({{1'000, 2'500, 3}}, 100), "1000:2500:3");
  EXPECT_EQ(losses_to_text({{INT64_MIN, INT64_MAX, INT64_MAX}, {5, 5, -1}}, 100),
            "-9223372036854775808:9223372036854775807:9223372036854775807 5:5:-1");
}

TEST(PtuLosses, RoundTrip) {
  const std::vector<Loss> losses = {{INT64_MIN, -7, 0}, {1, 1, 5}, {INT64_MAX, INT64_MAX, -1}};
  EXPECT_THAT(losses_from_text(losses_to_text(losses, 1'000)), Optional(losses));
  EXPECT_THAT(losses_from_text(""), Optional(IsEmpty()));
}

TEST(PtuLosses, FitTheRoom) {
  std::vector<Loss> losses;
  for (std::int64_t i = 0; i < 300; ++i) losses.push_back({i * i * 1'000, i * i * 1'000 + 10, 1});
  for (const std::size_t room : {64U, 100U, 1'000U, 5'000U}) {
    const std::string text = losses_to_text(losses, room);
    EXPECT_LE(text.size(), room);
    EXPECT_GE(text.size(), room / 3) << "joined more than needed";
    const auto back = losses_from_text(text);
    ASSERT_TRUE(back);
    std::int64_t sum = 0;
    std::int64_t length_ps = 0;
    for (const Loss& loss : *back) {
      sum += loss.count;
      length_ps += loss.end_ps - loss.begin_ps;
    }
    EXPECT_EQ(sum, 300);
    EXPECT_EQ(length_ps, 3'000);
  }
}

TEST(PtuLosses, TwoThatDoNotFitAreJoinedAndOneStaysWhole) {
  const Loss first{1'000'000, 2'000'000, 3}, second{5'000'000, 9'000'000, 4};
  EXPECT_EQ(losses_to_text({first, second}, 35), "1000000:2000000:3 5000000:9000000:4");
  EXPECT_EQ(losses_to_text({first, second}, 34), "4000000:9000000:7");
  EXPECT_EQ(losses_to_text({first, second}, 1), "4000000:9000000:7");
  EXPECT_EQ(losses_to_text({first}, 16), "1000000:2000000:3");
  EXPECT_EQ(losses_to_text({first}, 0), "1000000:2000000:3");
}

TEST(PtuLosses, RefusesWhatIsNoList) {
  for (const char* text : {"x", "1:2", "1:2:3:4", "1:2:", "1:2:3  4:5:6", "2:1:3", "1:2:-2",
                           "1.5:2:3", "9223372036854775808:1:1", " 1:2:3", "[]"}) {
    EXPECT_FALSE(losses_from_text(text)) << text;
  }
}

}  // namespace
}  // namespace splid
