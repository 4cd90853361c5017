#include "protocol/status_json.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <string>

namespace splid {
namespace {

TEST(StatusMessage, Minimal) {
  EXPECT_EQ(
      to_json(StatusMessage{}),
      R"({"schema":"splid.status","v":[1,0],"timestamp":0,"sequence":0,"state":"starting",)"
      R"("measurement":"none","reason":"","source":"","device":"connected","tags":0,"lost_tags":0,"frames":0,)"
      R"("valid_frames":0,"ring_fill_ratio":0})");
}

TEST(StatusMessage, Typical) {
  EXPECT_EQ(
      to_json(StatusMessage{12.5, 3, DaemonState::degraded, "2 tags lost", "tdc2",
                            DeviceState::failing, 100, 2, 20, 19, 0.125}),
      R"({"schema":"splid.status","v":[1,0],"timestamp":12.5,"sequence":3,)"
      R"("state":"degraded","measurement":"none","reason":"2 tags lost","source":"tdc2","device":"failing",)"
      R"("tags":100,"lost_tags":2,"frames":20,"valid_frames":19,"ring_fill_ratio":0.125})");
}

TEST(StatusMessage, Maximal) {
  EXPECT_EQ(
      to_json(StatusMessage{1, UINT64_MAX, DaemonState::stopping, "\"", "\\",
                            DeviceState::no_device, UINT64_MAX, UINT64_MAX, UINT64_MAX, UINT64_MAX,
                            1, "3137:200a at 1-1"}),
      R"({"schema":"splid.status","v":[1,0],"timestamp":1,"sequence":18446744073709551615,)"
      R"("state":"stopping","measurement":"none","reason":"\"","source":"\\","device":"no_device",)"
      R"("device_name":"3137:200a at 1-1",)"
      R"("tags":18446744073709551615,"lost_tags":18446744073709551615,"frames":18446744073709551615,)"
      R"("valid_frames":18446744073709551615,"ring_fill_ratio":1})");
}

TEST(StatusMessage, RecordingBeforeItsFirstFileHasItsStateAlone) {
  StatusMessage message;
  message.recording = RecordingStatus{};
  const std::string before = R"("ring_fill_ratio":0,)";
  const auto recording_of = [&] {
    const std::string json = to_json(message);
    return json.substr(json.find(before) + before.size());
  };
  EXPECT_EQ(recording_of(), R"("recording":{"state":"waiting"}})");
  message.recording = RecordingStatus{RecordingState::writing, "r/\"a\".ptu", 1'234'567, 2.5};
  EXPECT_EQ(
      recording_of(),
      R"("recording":{"state":"writing","file":"r/\"a\".ptu","bytes":1234567,"seconds":2.5}})");
}

TEST(StatusMessage, SaysWhereTheEffortIsLowered) {
  StatusMessage message;
  EXPECT_THAT(to_json(message), testing::Not(testing::HasSubstr("effort")));
  message.effort_is_lowered = true;
  EXPECT_THAT(to_json(message), testing::HasSubstr(R"("effort_is_lowered":true)"));
}

TEST(StatusMessage, SaysWhatComesOfTheMeasurementAndWhatStandsOut) {
  StatusMessage message;
  EXPECT_THAT(to_json(message), testing::Not(testing::HasSubstr("findings")));
  message.measurement = "ambiguous";
  message.findings = {{"vibration", 0.5, 0.125, "mm", 20.5, "Shorten frame.length_ms."}};
  EXPECT_THAT(to_json(message),
              testing::AllOf(testing::HasSubstr(R"("measurement":"ambiguous")"),
                             testing::HasSubstr(R"("findings":[{"name":"vibration","value":0.5,)"
                                                R"("std":0.125,"unit":"mm","gain_nats":20.5,)"
                                                R"("advice":"Shorten frame.length_ms."}])")));
}

TEST(StatusMessage, RecordingStates) {
  const char* names[] = {"waiting", "writing", "failing"};
  for (int i = 0; i < 3; ++i) EXPECT_STREQ(to_string(static_cast<RecordingState>(i)), names[i]);
}

TEST(StatusMessage, States) {
  const char* names[] = {"starting", "waiting_for_device", "streaming", "degraded", "stopping"};
  for (int i = 0; i < 5; ++i) EXPECT_STREQ(to_string(static_cast<DaemonState>(i)), names[i]);
}

TEST(StatusMessage, HeadlinesAreTheMeasurementWhileFramesCome) {
  EXPECT_EQ(headline("streaming", "ok"), "ok");
  EXPECT_EQ(headline("degraded", "ok"), "ok, degraded");
  EXPECT_EQ(headline("degraded", "no_sync"), "no sync");
  EXPECT_EQ(headline("streaming", "no_target"), "no target");
  EXPECT_EQ(headline("waiting_for_device", "no_target"), "waiting for device");
}

TEST(StatusMessage, DeviceStates) {
  const char* names[] = {"connected", "no_device", "failing"};
  for (int i = 0; i < 3; ++i) EXPECT_STREQ(to_string(static_cast<DeviceState>(i)), names[i]);
}

TEST(StatusMessage, TextFromOutsideIsShown) {
  StatusMessage message;
  message.reason = "serial \x1b[2J" + std::string(10'000'000, 'x');
  message.source = "a\nb";
  message.device_name = "c\rd";
  const std::string json = to_json(message);
  EXPECT_NE(json.find(R"("reason":"serial ?[2Jxxx)"), std::string::npos);
  EXPECT_NE(json.find(R"("source":"a?b")"), std::string::npos);
  EXPECT_NE(json.find(R"("device_name":"c?d")"), std::string::npos);
  EXPECT_LT(json.size(), 3000U);
}

TEST(VersionMessage, MinimalAndTypical) {
  EXPECT_EQ(to_json(VersionMessage{}),
            R"({"schema":"splid.version","v":[1,0],"timestamp":0,"sequence":0,"release":"",)"
            R"("pattern":"","mode":"baseline"})");
  EXPECT_EQ(to_json(VersionMessage{2.5, 1, "1.2.3", "random-40", Mode::random}),
            R"({"schema":"splid.version","v":[1,0],"timestamp":2.5,"sequence":1,)"
            R"("release":"1.2.3","pattern":"random-40","mode":"random"})");
}

}  // namespace
}  // namespace splid
