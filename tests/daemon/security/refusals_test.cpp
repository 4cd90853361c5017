#include "daemon/security/refusals.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/held_clock.hpp"

namespace splid::security {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class RefusalsTest : public testing::Test {
 protected:
  void pass(std::int64_t ns) { clock.advance_ms(ns / 1'000'000); }

  HeldClock clock;
  std::vector<std::string> said;
  Refusals refusals{[this](const std::string& sentence) { said.push_back(sentence); }, clock};
};

TEST_F(RefusalsTest, SaysAPeerOnceAMinuteAndCountsTheRest) {
  for (int i = 0; i < 1000; ++i) refusals.add(Refusal::no_key, "a", std::to_string(i));
  EXPECT_THAT(said, ElementsAre("0"));
  EXPECT_EQ(refusals.count(Refusal::no_key), 1000U);
  said.clear();
  pass(Refusals::minute_ns - 1'000'000);
  refusals.tick();
  EXPECT_THAT(said, IsEmpty());
  pass(1'000'000);
  refusals.tick();
  EXPECT_THAT(said, ElementsAre("999 more within a minute, the last: 999"));
  said.clear();
  refusals.add(Refusal::no_key, "a", "next");
  EXPECT_THAT(said, ElementsAre("next"));
}

// One client without a key, or many, do not hide that a key is not on the list.
TEST_F(RefusalsTest, OneReasonDoesNotHideAnother) {
  for (int i = 0; i < 1000; ++i) refusals.add(Refusal::no_key, std::to_string(i), "no key");
  EXPECT_EQ(said.size(), Refusals::sentences_a_reason);
  said.clear();
  refusals.add(Refusal::not_listed, "a", "not on the list");
  refusals.add(Refusal::flood, "a", "a flood");
  EXPECT_THAT(said, ElementsAre("not on the list", "a flood"));
}

TEST_F(RefusalsTest, OnePeerDoesNotHideAnother) {
  for (int i = 0; i < 1000; ++i) refusals.add(Refusal::not_listed, "loud", "loud");
  refusals.add(Refusal::not_listed, "other", "other");
  EXPECT_THAT(said, ElementsAre("loud", "other"));
}

TEST_F(RefusalsTest, IsShortHoweverLongItGoesOn) {
  constexpr std::int64_t step_ns = 10'000'000;
  for (std::int64_t i = 0; i < 60 * Refusals::minute_ns / step_ns; ++i) {
    refusals.add(Refusal::crowd, std::to_string(i % 100), "x");
    pass(step_ns);
  }
  EXPECT_LE(said.size(), 61 * (Refusals::sentences_a_reason + 1));
  EXPECT_GE(said.size(), 60 * Refusals::sentences_a_reason);
}

TEST_F(RefusalsTest, TellsThoseKeptOutFromThoseLetGo) {
  refusals.add(Refusal::no_key);
  refusals.add(Refusal::other_protocol);
  refusals.add(Refusal::flood);
  EXPECT_EQ(refusals.kept_out(), 2U);
  EXPECT_EQ(refusals.let_go(), 1U);
}

}  // namespace
}  // namespace splid::security
