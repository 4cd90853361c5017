#include "drivers/encoder/failure_news.hpp"

#include <gtest/gtest.h>

namespace splid {
namespace {

using std::chrono::milliseconds;

struct News {
  std::string say(const std::string& sentence) { return news.say(sentence, now).value_or("-"); }
  FailureNews news;
  FailureNews::Time now = FailureNews::Time{} + std::chrono::hours{1};
};

TEST(FailureNews, TheSameFailureIsSaidOnceUpToItsEnd) {
  News news;
  EXPECT_EQ(news.say("refused"), "refused");
  EXPECT_EQ(news.say("refused"), "-");
  news.now += std::chrono::hours{1};
  EXPECT_EQ(news.say("refused"), "-");
  news.news.over();
  EXPECT_EQ(news.say("refused"), "refused");
}

TEST(FailureNews, FailuresThatDifferAreFiveAtOnceThenOneInTenSeconds) {
  News news;
  int said = 0;
  for (int i = 0; i < 1000; ++i) said += news.say("garbage " + std::to_string(i)) == "-" ? 0 : 1;
  EXPECT_EQ(said, 5);
  news.now += milliseconds{9'999};
  EXPECT_EQ(news.say("a"), "-");
  news.now += milliseconds{1};
  EXPECT_EQ(news.say("b"), "b; 996 more failures were not said");
  EXPECT_EQ(news.say("c"), "-");
  news.now += milliseconds{60'000};
  EXPECT_EQ(news.say("d"), "d; 1 more failures were not said");
  EXPECT_EQ(news.say("e"), "e");
}

}  // namespace
}  // namespace splid
