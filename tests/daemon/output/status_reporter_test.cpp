#include "daemon/output/status_reporter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

#include "daemon/sockets/subscriber.hpp"
#include "daemon/stream/frame_message.hpp"
#include "tests/support/daemon_scene.hpp"
#include "tests/support/held_clock.hpp"
#include "tests/support/patience.hpp"

namespace splid {
namespace {

using std::chrono::milliseconds;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

FrameMessage frame(FrameStatus status) {
  FrameMessage message;
  message.status = status;
  message.timestamp_s = 77;
  message.lost_tags = 3;
  return message;
}

class StatusReports : public ::testing::Test {
 protected:
  explicit StatusReports(bool live = true) : reporter(status_options(config), publisher, clock) {
    EXPECT_TRUE(publisher.wait_for_subscriber(test::patience));
    reporter.begin(SourceInfo{"scripted", live, {}});
  }

  // What went out since the last call.
  std::vector<std::string> published() {
    std::vector<std::string> json;
    while (const auto message = subscriber.receive(milliseconds{100})) {
      if (message->topic == topic_status) json.push_back(message->json);
    }
    return json;
  }

  Config config = scene_config(0);
  HeldClock clock;
  Publisher publisher{config.publish.endpoint, 100};
  sockets::Subscriber subscriber{publisher.endpoint(), {""}};
  StatusReporter reporter;
};

TEST_F(StatusReports, ComeOnceASecondAndOnEveryChange) {
  EXPECT_THAT(published(), testing::ElementsAre(HasSubstr("\"starting\"")));
  const StreamHealth health{1000, clock.steady_ns(), 0.25, ""};
  reporter.tick(health);
  EXPECT_THAT(published(), IsEmpty());
  reporter.frame_published(frame(FrameStatus::ok));
  reporter.tick(health);
  EXPECT_THAT(published(), testing::ElementsAre(AllOf(HasSubstr("\"streaming\""), HasSubstr("0.25"),
                                                      HasSubstr("1000"))));
  clock.advance_ms(999);
  reporter.tick({1000, clock.steady_ns(), 0, ""});
  EXPECT_THAT(published(), IsEmpty());
  clock.advance_ms(1);
  reporter.tick({1000, clock.steady_ns(), 0, ""});
  EXPECT_EQ(published().size(), 1u);
}

TEST_F(StatusReports, SayWhatIsWrong) {
  const StreamHealth health{1, clock.steady_ns(), 0, "the syncs come at another period"};
  reporter.frame_published(frame(FrameStatus::no_sync));
  reporter.tick(health);
  reporter.frame_published(frame(FrameStatus::incomplete));
  reporter.tick(health);
  reporter.stop(health, "the cable came off");
  EXPECT_THAT(published(), testing::ElementsAre(
                               HasSubstr("\"starting\""),
                               AllOf(HasSubstr("\"degraded\""), HasSubstr("another period")),
                               AllOf(HasSubstr("\"degraded\""), HasSubstr("min_seen_fraction")),
                               AllOf(HasSubstr("\"stopping\""), HasSubstr("the cable came off"))));
}

TEST_F(StatusReports, NameTheKeyAndTheRoomThatAFrameNeeds) {
  FrameMessage full = frame(FrameStatus::incomplete);
  full.photons = 131'072;
  full.lost_tags = 200'000;
  reporter.frame_published(full);
  reporter.tick({1, clock.steady_ns(), 0, ""});
  EXPECT_THAT(reporter.status().reason, HasSubstr("pipeline.ring_capacity_tags to 524288 or more"));
  reporter.begin(SourceInfo{"a replay", false, {}});
  reporter.frame_published(full);
  EXPECT_EQ(reporter.ring_needed(), 0U);
}

TEST_F(StatusReports, NoticeASilentInstrumentAfterFourFrames) {
  const StreamHealth health{1, clock.steady_ns(), 0, ""};
  reporter.frame_published(frame(FrameStatus::ok));
  reporter.tick(health);
  clock.advance_ms(200);
  reporter.tick(health);
  (void)published();
  clock.advance_ms(1);
  reporter.tick(health);
  EXPECT_THAT(published(), testing::ElementsAre(AllOf(HasSubstr("\"waiting_for_device\""),
                                                      HasSubstr("scripted sends nothing"))));
}

// The framer waits for room in the lanes, and takes none of the tags that come meanwhile.
TEST_F(StatusReports, TakeTagsThatWaitInTheRingForNoSilence) {
  StreamHealth health{1, clock.steady_ns(), 0, ""};
  reporter.frame_published(frame(FrameStatus::ok));
  health.ring_is_empty = false;
  clock.advance_ms(5000);
  reporter.tick(health);
  EXPECT_EQ(reporter.status().state, DaemonState::streaming);
  reporter.frame_published(frame(FrameStatus::incomplete));
  reporter.tick(health);
  EXPECT_EQ(reporter.status().state, DaemonState::degraded);
  EXPECT_THAT(reporter.status().reason, HasSubstr("frame.min_seen_fraction"));
  health.ring_is_empty = true;
  reporter.tick(health);
  EXPECT_EQ(reporter.status().state, DaemonState::waiting_for_device);
}

TEST_F(StatusReports, SayThatTheClockIsAtItsEnd) {
  StreamHealth health{1, clock.steady_ns(), 0, ""};
  health.clock_is_at_its_end = true;
  reporter.frame_published(frame(FrameStatus::no_sync));
  reporter.tick(health);
  EXPECT_THAT(
      published(),
      testing::ElementsAre(HasSubstr("\"starting\""),
                           AllOf(HasSubstr("\"degraded\""),
                                 HasSubstr("\"reason\":\"the tagger's clock is within 5 h of"))));
}

TEST_F(StatusReports, SayThatNothingIsRecorded) {
  StreamHealth health{1, clock.steady_ns(), 0, ""};
  reporter.frame_published(frame(FrameStatus::ok));
  health.recording_fault = "nothing is recorded: the disk is full";
  health.notices = {"recording: " + health.recording_fault};
  reporter.tick(health);
  health.notices.clear();
  health.sync_fault = "the syncs come at another period";
  reporter.frame_published(frame(FrameStatus::no_sync));
  reporter.tick(health);
  health.recording_fault.clear();
  reporter.frame_published(frame(FrameStatus::ok));
  reporter.tick(health);
  EXPECT_THAT(
      published(),
      testing::ElementsAre(HasSubstr("\"starting\""),
                           AllOf(HasSubstr("\"degraded\""),
                                 HasSubstr(R"("reason":"nothing is recorded: the disk is full")")),
                           AllOf(HasSubstr("another period; "), HasSubstr("disk is full")),
                           HasSubstr("\"streaming\"")));
}

TEST_F(StatusReports, SayWhatIsWrongWithAScanOnceASecond) {
  StreamHealth health{1, clock.steady_ns(), 0, ""};
  reporter.frame_published(frame(FrameStatus::ok));
  health.scan_fault = "no line of the scan ends any more";
  for (int look = 0; look < 21; ++look) {
    reporter.tick(health);
    clock.advance_ms(50);
    health.last_arrival_ns = clock.steady_ns();
  }
  health.scan_fault.clear();
  reporter.tick(health);
  const auto faulty = AllOf(HasSubstr("\"degraded\""), HasSubstr("no line of the scan ends"));
  EXPECT_THAT(published(),
              testing::ElementsAre(HasSubstr("\"starting\""), faulty, faulty,
                                   AllOf(HasSubstr("\"streaming\""), Not(HasSubstr("scan")))));
}

// Bytes and seconds grow all the time and wait for the next second; what else changes does not.
TEST_F(StatusReports, SayWhatIsRecordedAndAtOnceWhereThatTurns) {
  StreamHealth health{1, clock.steady_ns(), 0, ""};
  health.recording = RecordingStatus{};
  reporter.tick(health);
  reporter.tick(health);
  health.recording = RecordingStatus{RecordingState::writing, "a.ptu", 10, 0.5};
  reporter.tick(health);
  health.recording->bytes = 20;
  reporter.tick(health);
  health.recording->file = "b.ptu";
  reporter.tick(health);
  clock.advance_ms(1000);
  health.recording->seconds = 1.5;
  health.last_arrival_ns = clock.steady_ns();
  reporter.tick(health);
  health.recording.reset();
  reporter.tick(health);
  health.recording = RecordingStatus{};
  reporter.stop(health, "");
  reporter.wait(StreamHealth{}, "stopped by control");
  EXPECT_THAT(
      published(),
      testing::ElementsAre(
          Not(HasSubstr("recording")), HasSubstr(R"("recording":{"state":"waiting"})"),
          HasSubstr(R"("recording":{"state":"writing","file":"a.ptu","bytes":10,"seconds":0.5})"),
          AllOf(HasSubstr(R"("file":"b.ptu")"), HasSubstr(R"("bytes":20)")),
          HasSubstr(R"("seconds":1.5)"), Not(HasSubstr("recording")), HasSubstr("waiting\"}"),
          AllOf(HasSubstr("stopped by control"), Not(HasSubstr("recording")))));
}

TEST_F(StatusReports, SayEachThingThatTheDriverReports) {
  StreamHealth health{1, clock.steady_ns(), 0, "", {}};
  reporter.frame_published(frame(FrameStatus::ok));
  reporter.tick(health);
  health.device_reports = {{DeviceState::no_device, "tagger 12 is gone"},
                           {DeviceState::failing, "it does not start"},
                           {DeviceState::connected, "tagger 12 is back"}};
  reporter.tick(health);
  EXPECT_THAT(published(), testing::ElementsAre(
                               HasSubstr("\"starting\""), HasSubstr("\"streaming\""),
                               AllOf(HasSubstr("\"waiting_for_device\""),
                                     HasSubstr("\"no_device\""), HasSubstr("tagger 12 is gone")),
                               AllOf(HasSubstr("\"degraded\""), HasSubstr("\"failing\""),
                                     HasSubstr("it does not start")),
                               AllOf(HasSubstr("\"streaming\""), HasSubstr("\"connected\""),
                                     HasSubstr("tagger 12 is back"))));
}

TEST_F(StatusReports, SayWhatTheDriverReportsBesideABadFrame) {
  StreamHealth health{1, clock.steady_ns(), 0, "", {{DeviceState::connected, "a block is lost"}}};
  reporter.frame_published(frame(FrameStatus::incomplete));
  reporter.tick(health);
  EXPECT_THAT(published().back(), AllOf(HasSubstr("\"degraded\""), HasSubstr("the last frame saw"),
                                        HasSubstr("a block is lost")));
}

TEST_F(StatusReports, DoNotTakeTheEndOfTheStreamForALoss) {
  const StreamHealth health{1, clock.steady_ns(), 0, ""};
  reporter.frame_published(frame(FrameStatus::ok));
  reporter.frame_published(frame(FrameStatus::incomplete), {}, true);
  reporter.tick(health);
  EXPECT_THAT(published().back(), AllOf(HasSubstr("\"streaming\""), Not(HasSubstr("lost: "))));
}

TEST_F(StatusReports, RepeatWhatIsOverForASecondAndWhatIsWrongAsLongAsItLasts) {
  StreamHealth health{1, clock.steady_ns(), 0, "", {{DeviceState::connected, "a stall, cleared"}}};
  reporter.frame_published(frame(FrameStatus::ok));
  reporter.tick(health);
  health.device_reports.clear();
  for (int second = 0; second < 2; ++second) {
    clock.advance_ms(1000);
    health.last_arrival_ns = clock.steady_ns();
    reporter.tick(health);
  }
  health.device_reports = {{DeviceState::no_device, "gone"}};
  reporter.tick(health);
  health.device_reports.clear();
  clock.advance_ms(5000);
  reporter.tick(health);
  const auto cleared = HasSubstr("a stall, cleared");
  EXPECT_THAT(published(), testing::ElementsAre(HasSubstr("\"starting\""), cleared, cleared,
                                                HasSubstr("\"reason\":\"\""), HasSubstr("gone"),
                                                HasSubstr("gone")));
}

// A state that turns all the time puts off neither the end of a notice nor that of a second.
TEST_F(StatusReports, JudgeASecondWhileTheStateTurns) {
  FrameMessage wide = frame(FrameStatus::ok);
  wide.findings = {{"pulse_width", 0.5, 0.01, "", 40, "Calibrate."}};
  StreamHealth health{1, clock.steady_ns(), 0, ""};
  health.notices = {"a notice"};
  int noticed = 0, said_wide = 0;
  for (int n = 0; n < 80; ++n) {
    reporter.frame_published(n % 4 == 0 ? frame(FrameStatus::incomplete) : wide);
    clock.advance_ms(50);
    health.last_arrival_ns = clock.steady_ns();
    reporter.tick(health);
    health.notices.clear();
    noticed += reporter.status().reason.find("a notice") != std::string::npos ? 1 : 0;
    said_wide += reporter.status().reason.find("Calibrate.") != std::string::npos ? 1 : 0;
  }
  EXPECT_GE(noticed, 20);
  EXPECT_LE(noticed, 22);
  // In each frame with a target from the second second on.
  EXPECT_GE(said_wide, 44);
}

// The frame that a silence was in has no syncs: not for its cable.
TEST_F(StatusReports, AdviseOnNoCableAfterASilence) {
  StreamHealth health{1, clock.steady_ns(), 0, "", {{DeviceState::failing, "it sends nothing"}}};
  reporter.frame_published(frame(FrameStatus::ok));
  reporter.tick(health);
  clock.advance_ms(300);
  health.last_arrival_ns = clock.steady_ns();
  health.device_reports = {{DeviceState::connected, "it sent nothing for 300 ms"}};
  reporter.frame_published(frame(FrameStatus::no_sync));
  reporter.tick(health);
  health.device_reports.clear();
  reporter.frame_published(frame(FrameStatus::no_sync));
  reporter.tick(health);
  std::vector<std::string> said = published();
  EXPECT_THAT(said, testing::Each(testing::Not(HasSubstr("channels.sync"))));
  EXPECT_THAT(said.back(), HasSubstr("it sent nothing for 300 ms"));
  // A second later it is the cable, or whatever else.
  clock.advance_ms(1001);
  health.last_arrival_ns = clock.steady_ns();
  reporter.tick(health);
  said = published();
  ASSERT_FALSE(said.empty());
  EXPECT_THAT(said.back(), HasSubstr("channels.sync"));
}

TEST_F(StatusReports, AdviseOnNoCableAfterASilenceThatOnlyTheyNoticed) {
  StreamHealth health{1, clock.steady_ns(), 0, ""};
  reporter.frame_published(frame(FrameStatus::ok));
  reporter.tick(health);
  clock.advance_ms(300);
  reporter.tick(health);
  health.last_arrival_ns = clock.steady_ns();
  reporter.frame_published(frame(FrameStatus::no_sync));
  reporter.tick(health);
  EXPECT_THAT(published().back(), HasSubstr("spans a time in which scripted sent nothing"));
  reporter.frame_published(frame(FrameStatus::ok));
  reporter.frame_published(frame(FrameStatus::no_sync));
  reporter.tick(health);
  EXPECT_THAT(published().back(), HasSubstr("channels.sync"));
}

TEST_F(StatusReports, NameTheInstrumentAndWhatLasts) {
  StreamHealth health{1, clock.steady_ns(), 0, ""};
  health.device_reports = {{DeviceState::connected, "", "12:34 serial A", "there are two"}};
  health.configuration_fault = "not reloaded";
  reporter.frame_published(frame(FrameStatus::ok));
  for (int second = 0; second < 3; ++second) {
    reporter.tick(health);
    health.device_reports.clear();
    clock.advance_ms(1000);
    health.last_arrival_ns = clock.steady_ns();
  }
  const std::vector<std::string> said = published();
  EXPECT_EQ(said.size(), 4U);
  EXPECT_THAT(said.back(), AllOf(HasSubstr(R"("device_name":"12:34 serial A")"),
                                 HasSubstr(R"("reason":"not reloaded; there are two")"),
                                 HasSubstr("\"streaming\"")));
}

// A finding stands from half of a second's frames on, with what to do about the surest as the
// reason, and it is no reason to be degraded.
TEST_F(StatusReports, HaveTheFindingsOfASecond) {
  FrameMessage wide = frame(FrameStatus::ok);
  wide.findings = {{"pulse_width", 0.37, 0.01, "", 40, "Calibrate."},
                   {"fading", 0.2, 0.05, "", 15, "Look."}};
  for (int second = 0; second < 3; ++second) {
    for (int n = 0; n < 20; ++n) {
      // One frame by chance, then most of them, then none.
      const bool is_wide = second == 0 ? n == 0 : second == 1 && n % 3 != 0;
      reporter.frame_published(is_wide ? wide : frame(FrameStatus::ok));
    }
    clock.advance_ms(1000);
    reporter.tick({1000, clock.steady_ns(), 0, ""});
  }
  EXPECT_THAT(
      published(),
      testing::ElementsAre(AllOf(HasSubstr("\"starting\""), HasSubstr(R"("measurement":"none")")),
                           AllOf(HasSubstr(R"("measurement":"ok")"), HasSubstr("\"reason\":\"\""),
                                 Not(HasSubstr("findings"))),
                           AllOf(HasSubstr("\"streaming\""), HasSubstr(R"("measurement":"ok")"),
                                 HasSubstr(R"("reason":"pulse width 0.37 +- 0.01: Calibrate.")"),
                                 HasSubstr(R"("findings":)" + to_json(wide.findings))),
                           AllOf(HasSubstr("\"reason\":\"\""), Not(HasSubstr("findings")))));
}

// A second that is not ok is never without a reason, whatever its last frame is.
TEST_F(StatusReports, SayWhyTheMeasurementIsNotOk) {
  EXPECT_EQ(reporter.status().measurement, "none");
  for (const FrameStatus status :
       {FrameStatus::no_target, FrameStatus::ambiguous, FrameStatus::incomplete,
        FrameStatus::no_sync, FrameStatus::saturated}) {
    for (int n = 0; n < 20; ++n) {
      reporter.frame_published(frame(n < 12 ? status : FrameStatus::ok));
    }
    clock.advance_ms(1000);
    reporter.tick({1000, clock.steady_ns(), 0, ""});
    const StatusMessage& said = reporter.status();
    EXPECT_EQ(said.state, DaemonState::streaming);
    EXPECT_EQ(said.measurement, to_string(status));
    EXPECT_THAT(said.reason, Not(IsEmpty())) << said.measurement;
  }
}

TEST_F(StatusReports, HaveAMeasurementFromTheFirstFrameOn) {
  EXPECT_THAT(published(), testing::ElementsAre(HasSubstr(R"("reason":"no frame has come")")));
  reporter.frame_published(frame(FrameStatus::ok));
  reporter.tick({1000, clock.steady_ns(), 0, ""});
  EXPECT_THAT(published(),
              testing::ElementsAre(AllOf(HasSubstr("streaming"), HasSubstr(R"("measurement":"ok")"),
                                         HasSubstr(R"("reason":"")"))));
}

// The last list of any frame counts, since each lane has frames of its own.
TEST_F(StatusReports, HaveWhatManyFramesShowTogether) {
  const std::vector<FrameMessage::Finding> recent = {{"jerk", 3, 0.5, "m/s3", 20, "Shorten."}};
  reporter.frame_published(frame(FrameStatus::ok), recent);
  reporter.frame_published(frame(FrameStatus::ok));
  clock.advance_ms(1000);
  reporter.tick({1000, clock.steady_ns(), 0, ""});
  EXPECT_EQ(reporter.status().findings, recent);
  EXPECT_EQ(reporter.status().reason, "jerk 3 +- 0.5 m/s3: Shorten.");
  reporter.begin(SourceInfo{"scripted", true, {}});
  EXPECT_TRUE(reporter.status().findings.empty());
}

// Frames that last longer than a second leave the last one's measurement as it is.
TEST_F(StatusReports, KeepTheMeasurementOfLongFrames) {
  config.frame.length_ms = 2000;
  StatusReporter slow(status_options(config), publisher, clock);
  slow.begin(SourceInfo{"scripted", false, {}});
  slow.frame_published(frame(FrameStatus::ok));
  for (int second = 0; second < 5; ++second) {
    clock.advance_ms(1000);
    slow.tick({1000, clock.steady_ns(), 0, ""});
    EXPECT_EQ(slow.status().measurement, "ok") << second;
  }
  clock.advance_ms(10'000);
  slow.tick({1000, clock.steady_ns(), 0, ""});
  EXPECT_EQ(slow.status().measurement, "none");
}

// A scan's frames come once a line, which may take seconds; a pause of the instrument is no line.
TEST_F(StatusReports, KeepTheMeasurementOfLongLines) {
  const auto pass = [&](int ms, bool is_silent) {
    for (int look = 0; look < ms / 50; ++look) {
      clock.advance_ms(50);
      StreamHealth health{1, clock.steady_ns(), 0, ""};
      if (is_silent) health.last_arrival_ns = 1;
      reporter.tick(health);
      if (!is_silent && reporter.status().frames > 0) {
        EXPECT_EQ(reporter.status().measurement, "ok") << look;
      }
    }
  };
  pass(4000, false);
  for (int line = 0; line < 4; ++line) {
    for (int n = 0; n < 88; ++n) reporter.frame_published(frame(FrameStatus::ok));
    if (line < 3) pass(4000, false);
  }
  pass(30'000, true);
  EXPECT_EQ(reporter.status().measurement, "none");
  reporter.frame_published(frame(FrameStatus::ok));
  pass(1000, false);
  pass(8000, true);
  EXPECT_EQ(reporter.status().measurement, "none");
}

// Who has asked for the model is not told to ask for it.
TEST_F(StatusReports, SayWhatLeavesTheDeadTimeOut) {
  FrameMessage saturated = frame(FrameStatus::saturated);
  const auto reason = [&] {
    reporter.frame_published(saturated);
    clock.advance_ms(1000);
    reporter.tick({1000, clock.steady_ns(), 0, ""});
    return reporter.status().reason;
  };
  EXPECT_THAT(reason(), HasSubstr("detector.dead_time modelled"));
  config.detector.dead_time_ns = 50;
  config.estimator.method = Method::paper;
  reporter.configure(status_options(config));
  EXPECT_THAT(reason(), AllOf(HasSubstr("not modelled with estimator.method paper: do without"),
                              Not(HasSubstr("detector.dead_time modelled"))));
  config.estimator.method = Method::search;
  reporter.configure(status_options(config));
  EXPECT_THAT(reason(), HasSubstr("contradict detector.dead_time_ns"));
  saturated.blind_fraction = 0.95;
  EXPECT_THAT(reason(),
              AllOf(HasSubstr("detector.dead_time modelled"), Not(HasSubstr("unevenly"))));
  saturated.blind_fraction = 0.1;
  EXPECT_THAT(reason(), HasSubstr("inputs share the light so unevenly"));
}

TEST_F(StatusReports, SayWhenThePhotonsCannotTellTheRange) {
  FrameMessage by_mode = frame(FrameStatus::ambiguous);
  by_mode.mode = Mode::ambiguous;
  for (int second = 0; second < 3; ++second) {
    for (int n = 0; n < 20; ++n) {
      // A few frames, then most of them, then all by the pattern's mode, which is meant so.
      const bool is_ambiguous = second == 0 ? n < 3 : n % 3 != 0;
      reporter.frame_published(second == 2    ? by_mode
                               : is_ambiguous ? frame(FrameStatus::ambiguous)
                                              : frame(FrameStatus::ok));
    }
    clock.advance_ms(1000);
    reporter.tick({1000, clock.steady_ns(), 0, ""});
  }
  EXPECT_THAT(published(),
              testing::ElementsAre(HasSubstr("\"starting\""), HasSubstr("\"reason\":\"\""),
                                   AllOf(HasSubstr("\"streaming\""), HasSubstr("13 of the last 20"),
                                         HasSubstr("more light")),
                                   HasSubstr("the pattern's mode is ambiguous")));
}

TEST_F(StatusReports, SayWhenThePhotonsContradictThePattern) {
  FrameMessage other = frame(FrameStatus::no_target);
  FoundList found;
  found.add({FindingName::wrong_pattern, 1, 0, 900});
  other.findings = to_message(found);
  const StreamHealth health{1000, clock.steady_ns(), 0, ""};
  for (int second = 0; second < 3; ++second) {
    // One by chance, then most, beside frames in which there is no target at all; then none.
    for (int n = 0; n < 20; ++n) {
      const bool contradicts = second == 0 ? n == 0 : second == 1 && n % 3 != 0;
      reporter.frame_published(
          contradicts ? other : frame(second == 1 ? FrameStatus::no_target : FrameStatus::ok));
    }
    clock.advance_ms(1000);
    reporter.tick({1000, clock.steady_ns(), 0, ""});
  }
  const auto said = AllOf(HasSubstr("the photons contradict the pattern: Set pattern.file"),
                          HasSubstr(R"("measurement":"wrong_pattern")"));
  EXPECT_THAT(
      published(),
      testing::ElementsAre(HasSubstr("\"starting\""), HasSubstr("\"reason\":\"\""),
                           AllOf(HasSubstr("\"degraded\""), said), HasSubstr("\"reason\":\"\"")));
  // A stream that is over before its first second is.
  reporter.frame_published(other);
  reporter.stop(health, "");
  EXPECT_THAT(published(), testing::ElementsAre(AllOf(HasSubstr("\"stopping\""), said)));
}

TEST_F(StatusReports, SayWhenTheEffortIsLowered) {
  FrameMessage lowered = frame(FrameStatus::ok);
  lowered.effort = "fast";
  const StreamHealth health{1000, clock.steady_ns(), 0, ""};
  reporter.frame_published(lowered);
  reporter.tick(health);
  lowered.effort = "balanced";
  reporter.frame_published(lowered);
  reporter.tick(health);
  EXPECT_THAT(published(),
              testing::ElementsAre(
                  HasSubstr("\"starting\""),
                  AllOf(HasSubstr("\"degraded\""), HasSubstr("to fast"),
                        HasSubstr("\"effort_is_lowered\":true")),
                  AllOf(HasSubstr("\"streaming\""), testing::Not(HasSubstr("effort_is_lowered")))));
}

TEST_F(StatusReports, SayWhenFramesCostMoreThanTheyLast) {
  FrameMessage slow = frame(FrameStatus::ok);
  slow.duration_ms = 50;
  for (const double compute_ms : {49.0, 150.0, 1.0}) {
    slow.compute_ms = compute_ms;
    for (int n = 0; n < 20; ++n) reporter.frame_published(slow);
    clock.advance_ms(1000);
    reporter.tick({1000, clock.steady_ns(), 0, ""});
  }
  EXPECT_THAT(published(), testing::ElementsAre(
                               HasSubstr("\"starting\""), HasSubstr("\"reason\":\"\""),
                               AllOf(HasSubstr("\"degraded\""), HasSubstr("take 3 times as long")),
                               HasSubstr("\"reason\":\"\"")));
}

class ReplayStatusReports : public StatusReports {
 protected:
  ReplayStatusReports() : StatusReports(false) {}
};

TEST_F(ReplayStatusReports, HaveTheRecordingsTimeAndAreNeverSilent) {
  reporter.frame_published(frame(FrameStatus::ok));
  clock.advance_ms(60'000);
  reporter.tick({1, 0, 0, ""});
  EXPECT_THAT(published(),
              testing::ElementsAre(HasSubstr("\"timestamp\":0"),
                                   AllOf(HasSubstr("\"timestamp\":77"), HasSubstr("streaming"))));
}

}  // namespace
}  // namespace splid
