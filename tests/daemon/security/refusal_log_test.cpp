#include "daemon/security/refusal_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace splid {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(RefusalLog, SaysTheFirstOfAMinuteAndCountsTheOthers) {
  std::vector<std::string> said;
  RefusalLog log([&](const std::string& sentence) { said.push_back(sentence); });
  constexpr std::int64_t start_ns = 1'000;
  for (int i = 0; i < 1000; ++i) log.refused(std::to_string(i), start_ns + i);
  EXPECT_THAT(said, ElementsAre("0", "1", "2", "3", "4"));
  said.clear();
  log.tick(start_ns + RefusalLog::minute_ns - 1);
  EXPECT_THAT(said, IsEmpty());
  log.tick(start_ns + RefusalLog::minute_ns);
  EXPECT_THAT(said, ElementsAre("995 more refusals within a minute, the last: 999"));
  said.clear();
  log.tick(start_ns + 2 * RefusalLog::minute_ns);
  EXPECT_THAT(said, IsEmpty());
  log.refused("next", start_ns + 2 * RefusalLog::minute_ns);
  EXPECT_THAT(said, ElementsAre("next"));
}

TEST(RefusalLog, IsShortHoweverLongItGoesOn) {
  int lines = 0;
  RefusalLog log([&](const std::string&) { ++lines; });
  constexpr std::int64_t hour_ns = 60 * RefusalLog::minute_ns;
  for (std::int64_t now_ns = 0; now_ns < hour_ns; now_ns += 10'000'000) log.refused("x", now_ns);
  EXPECT_LE(lines, 60 * (RefusalLog::sentences_a_minute + 1));
  EXPECT_GE(lines, 60 * RefusalLog::sentences_a_minute);
}

}  // namespace
}  // namespace splid
