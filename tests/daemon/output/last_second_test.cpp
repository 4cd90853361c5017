#include "daemon/output/last_second.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "daemon/stream/frame_message.hpp"

namespace splid {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

FrameMessage counted_frame(FrameStatus status, std::uint64_t photons = 100) {
  FrameMessage message;
  message.status = status;
  message.photons = photons;
  return message;
}

FrameMessage::Finding sure_finding(const std::string& name, double value, double gain_nats) {
  return {name, value, 0.5, "", gain_nats, "Do something."};
}

class LastSeconds : public testing::Test {
 protected:
  void add(const FrameMessage& message, int times = 1) {
    for (int n = 0; n < times; ++n) second.add(message, {});
  }
  std::string measurement() {
    second.end();
    return second.measurement();
  }

  LastSecond second{1};
};

TEST_F(LastSeconds, AreOkWhereMostFramesAre) {
  EXPECT_EQ(measurement(), "none");
  EXPECT_EQ(second.why(), "no frame has come");
  add(counted_frame(FrameStatus::ok), 11);
  add(counted_frame(FrameStatus::no_target), 9);
  EXPECT_EQ(measurement(), "ok");
  EXPECT_EQ(second.why(), "");
  add(counted_frame(FrameStatus::ok), 9);
  add(counted_frame(FrameStatus::no_target), 4);
  add(counted_frame(FrameStatus::saturated), 7);
  EXPECT_EQ(measurement(), "saturated");
  EXPECT_EQ(measurement(), "none");
}

TEST_F(LastSeconds, NameWhatKeepsMostFramesFromIt) {
  for (const FrameStatus status : {FrameStatus::no_target, FrameStatus::ambiguous,
                                   FrameStatus::incomplete, FrameStatus::no_sync}) {
    add(counted_frame(status), 3);
    add(counted_frame(FrameStatus::ok));
    EXPECT_EQ(measurement(), to_string(status));
  }
  add(counted_frame(FrameStatus::no_target, 0), 3);
  EXPECT_EQ(measurement(), "no_signal");
  EXPECT_THAT(second.why(), HasSubstr("channels.photon"));
  add(counted_frame(FrameStatus::no_target));
  EXPECT_EQ(measurement(), "no_target");
  EXPECT_THAT(second.why(), HasSubstr("scene.max_speed_mps"));
}

// Where most frames are neither ok nor ambiguous, the reason is not that of a few ambiguous ones.
TEST_F(LastSeconds, GiveTheReasonOfTheMeasurement) {
  add(counted_frame(FrameStatus::ok), 3);
  add(counted_frame(FrameStatus::ambiguous), 3);
  add(counted_frame(FrameStatus::no_target), 4);
  EXPECT_EQ(measurement(), "no_target");
  EXPECT_THAT(second.why(), HasSubstr("show no target"));
  add(counted_frame(FrameStatus::ambiguous), 3);
  EXPECT_EQ(measurement(), "ambiguous");
  EXPECT_THAT(second.why(), HasSubstr("3 of the last 3 frames are ambiguous"));
  FrameMessage by_mode = counted_frame(FrameStatus::ambiguous);
  by_mode.mode = Mode::ambiguous;
  add(by_mode, 3);
  EXPECT_EQ(measurement(), "ambiguous");
  EXPECT_THAT(second.why(), HasSubstr("the pattern's mode is ambiguous"));
}

TEST_F(LastSeconds, AreLookedAtBeforeTheyEndAfterOnesWithoutAFrame) {
  const auto looked_at = [this] {
    second.look();
    return second.measurement();
  };
  EXPECT_EQ(looked_at(), "none");
  add(counted_frame(FrameStatus::ok), 2);
  EXPECT_EQ(looked_at(), "ok");
  add(counted_frame(FrameStatus::no_target), 2);
  EXPECT_EQ(looked_at(), "no_target");
  add(counted_frame(FrameStatus::ok));
  EXPECT_EQ(measurement(), "ok");
  EXPECT_EQ(second.why(), "");
  add(counted_frame(FrameStatus::no_target));
  EXPECT_EQ(looked_at(), "ok");
}

TEST_F(LastSeconds, SayThatThePhotonsContradictThePattern) {
  FoundList found;
  found.add({FindingName::wrong_pattern, 1, 0, 900});
  FrameMessage other = counted_frame(FrameStatus::no_target);
  other.findings = to_message(found);
  add(other, 5);
  add(counted_frame(FrameStatus::no_target), 4);
  add(counted_frame(FrameStatus::ok), 4);
  EXPECT_EQ(measurement(), other.findings[0].name);
  EXPECT_TRUE(second.contradicts_pattern());
  EXPECT_THAT(second.why(), HasSubstr(other.findings[0].advice));
  EXPECT_THAT(second.findings(), ElementsAre(other.findings[0]));
  add(counted_frame(FrameStatus::ok));
  EXPECT_EQ(measurement(), "ok");
  EXPECT_FALSE(second.contradicts_pattern());
}

// Of frames with a target half are needed; of a finding that none with a target has, half of all.
TEST_F(LastSeconds, HaveFindingsOfHalfOfTheFramesTheSurestFirst) {
  FrameMessage weak = counted_frame(FrameStatus::ok);
  weak.findings = {sure_finding("fading", 1, 10)};
  FrameMessage both = counted_frame(FrameStatus::ok);
  both.findings = {sure_finding("fading", 2, 11), sure_finding("jerk", 3, 12)};
  add(weak);
  add(both);
  add(counted_frame(FrameStatus::no_target), 10);
  second.end();
  EXPECT_THAT(second.findings(),
              ElementsAre(sure_finding("jerk", 3, 12), sure_finding("fading", 2, 11)));
  FrameMessage rare = counted_frame(FrameStatus::no_target);
  rare.findings = {sure_finding("dead_time", 50, 30)};
  add(rare);
  add(counted_frame(FrameStatus::no_target), 2);
  second.end();
  EXPECT_THAT(second.findings(), ElementsAre());
  add(rare, 2);
  add(counted_frame(FrameStatus::no_target), 2);
  second.end();
  EXPECT_THAT(second.findings(), ElementsAre(sure_finding("dead_time", 50, 30)));
}

TEST_F(LastSeconds, AddWhatManyFramesShowTogether) {
  FrameMessage wide = counted_frame(FrameStatus::ok);
  wide.findings = {sure_finding("pulse_width", 1, 20)};
  second.add(wide, {sure_finding("pulse_width", 0.5, 40), sure_finding("jerk", 2, 30)});
  second.add(wide, {});
  second.end();
  EXPECT_THAT(second.findings(),
              ElementsAre(sure_finding("jerk", 2, 30), sure_finding("pulse_width", 1, 20)));
  second.begin();
  EXPECT_THAT(second.findings(), ElementsAre());
}

}  // namespace
}  // namespace splid
