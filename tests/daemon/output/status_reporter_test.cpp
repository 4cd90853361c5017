#include "daemon/output/status_reporter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

#include "daemon/sockets/subscriber.hpp"
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
  FrameMessage blind = frame(FrameStatus::ok);
  blind.dead_time_misfit_ns = 50.04;
  StreamHealth health{1, clock.steady_ns(), 0, ""};
  health.notices = {"a notice"};
  int noticed = 0, said_blind = 0;
  for (int n = 0; n < 80; ++n) {
    reporter.frame_published(n % 4 == 0 ? frame(FrameStatus::incomplete) : blind);
    clock.advance_ms(50);
    health.last_arrival_ns = clock.steady_ns();
    reporter.tick(health);
    health.notices.clear();
    noticed += reporter.status().reason.find("a notice") != std::string::npos ? 1 : 0;
    said_blind += reporter.status().reason.find("for 50 ns") != std::string::npos ? 1 : 0;
  }
  EXPECT_GE(noticed, 20);
  EXPECT_LE(noticed, 22);
  // In each frame with a target from the second second on.
  EXPECT_GE(said_blind, 44);
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

TEST_F(StatusReports, SayWhenThePulsesAreNotThoseOfThePattern) {
  FrameMessage uneven = frame(FrameStatus::ok);
  uneven.amplitude_misfit = 0.35;
  for (int second = 0; second < 3; ++second) {
    for (int n = 0; n < 20; ++n) {
      // One frame by chance, then most of them, then none.
      const bool is_uneven = second == 0 ? n == 0 : second == 1 && n % 3 != 0;
      reporter.frame_published(is_uneven ? uneven : frame(FrameStatus::ok));
    }
    clock.advance_ms(1000);
    reporter.tick({1000, clock.steady_ns(), 0, ""});
  }
  EXPECT_THAT(published(),
              testing::ElementsAre(HasSubstr("\"starting\""), HasSubstr("\"reason\":\"\""),
                                   AllOf(HasSubstr("\"streaming\""), HasSubstr("35 % (rms)")),
                                   HasSubstr("\"reason\":\"\"")));
}

TEST_F(StatusReports, SayWhenThePulseIsNotTheConfiguredOne) {
  FrameMessage wide = frame(FrameStatus::ok);
  wide.pulse_misfit = 0.37;
  FrameMessage narrow = frame(FrameStatus::ok);
  narrow.pulse_misfit = -0.2;
  for (int second = 0; second < 4; ++second) {
    for (int n = 0; n < 20; ++n) {
      // One frame by chance, then most of them, then another misfit, then none.
      const bool is_off = second == 0 ? n == 0 : second < 3 && n % 3 != 0;
      reporter.frame_published(!is_off ? frame(FrameStatus::ok) : second == 2 ? narrow : wide);
    }
    clock.advance_ms(1000);
    reporter.tick({1000, clock.steady_ns(), 0, ""});
  }
  EXPECT_THAT(published(),
              testing::ElementsAre(HasSubstr("\"starting\""), HasSubstr("\"reason\":\"\""),
                                   AllOf(HasSubstr("\"streaming\""), HasSubstr("37 % wider"),
                                         HasSubstr("pulse.width fitted")),
                                   AllOf(HasSubstr("20 % narrower"), HasSubstr("pulse.sigma_ps")),
                                   HasSubstr("\"reason\":\"\"")));
}

// A dead time that is not known hides pulses and makes them narrower: nothing is to be calibrated,
// and no other pattern to be named.
TEST_F(StatusReports, SayThatTheDetectorIsBlindInPlaceOfWhatThatMakesOfThePulses) {
  FrameMessage blind = frame(FrameStatus::ok);
  blind.amplitude_misfit = 0.35;
  blind.pulse_misfit = -0.2;
  blind.dead_time_misfit_ns = 50.04;
  FrameMessage unlike = frame(FrameStatus::no_target);
  unlike.pattern_fault = PatternFault::dark_pulses;
  unlike.dead_time_misfit_ns = 50.04;
  for (int second = 0; second < 4; ++second) {
    for (int n = 0; n < 20; ++n) {
      // One frame by chance, then most of them, then frames that seem of another pattern, then
      // none.
      const bool is_blind = second == 0 ? n == 0 : second == 1 && n % 3 != 0;
      reporter.frame_published(is_blind ? blind : second == 2 ? unlike : frame(FrameStatus::ok));
    }
    clock.advance_ms(1000);
    reporter.tick({1000, clock.steady_ns(), 0, ""});
  }
  const auto says_blind =
      AllOf(HasSubstr("for 50 ns"), HasSubstr("set detector.dead_time_ns"),
            Not(HasSubstr("calibrate")), Not(HasSubstr("sigma_ps")), Not(HasSubstr("contradict")));
  EXPECT_THAT(published(),
              testing::ElementsAre(HasSubstr("\"starting\""), HasSubstr("\"reason\":\"\""),
                                   AllOf(HasSubstr("\"streaming\""), says_blind),
                                   AllOf(HasSubstr("\"degraded\""), says_blind),
                                   HasSubstr("\"reason\":\"\"")));
}

// What one frame of twenty shows is chance, also where none of the others has a target.
TEST_F(StatusReports, SayNothingOfTheDetectorByAFrameOfMany) {
  FrameMessage unlike = frame(FrameStatus::no_target);
  unlike.dead_time_misfit_ns = 50.04;
  unlike.afterpulse_misfit = 0.05;
  for (int n = 0; n < 20; ++n) {
    reporter.frame_published(n == 0 ? unlike : frame(FrameStatus::no_target));
  }
  clock.advance_ms(1000);
  reporter.tick({1000, clock.steady_ns(), 0, ""});
  EXPECT_EQ(reporter.status().reason, "");
}

// Afterpulses are said from half of a second's frames on.
TEST_F(StatusReports, SayThatDetectionsHaveAfterpulses) {
  FrameMessage followed = frame(FrameStatus::ok);
  followed.afterpulse_misfit = 0.0512;
  for (int second = 0; second < 3; ++second) {
    for (int n = 0; n < 20; ++n) {
      const bool is_followed = second == 0 ? n == 0 : second == 1 && n % 3 != 0;
      reporter.frame_published(is_followed ? followed : frame(FrameStatus::ok));
    }
    clock.advance_ms(1000);
    reporter.tick({1000, clock.steady_ns(), 0, ""});
  }
  EXPECT_THAT(published(),
              testing::ElementsAre(HasSubstr("\"starting\""), HasSubstr("\"reason\":\"\""),
                                   AllOf(HasSubstr("\"streaming\""), HasSubstr("some 5.1 %"),
                                         HasSubstr("afterpulses"), HasSubstr("longer dead time")),
                                   HasSubstr("\"reason\":\"\"")));
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
  config.scene.targets = 3;
  reporter.configure(status_options(config));
  EXPECT_THAT(reason(), AllOf(HasSubstr("not modelled with scene.targets above 1: do without"),
                              Not(HasSubstr("detector.dead_time modelled"))));
  config.scene.targets = 1;
  reporter.configure(status_options(config));
  EXPECT_THAT(reason(), HasSubstr("contradict detector.dead_time_ns"));
  saturated.blind_fraction = 0.95;
  EXPECT_THAT(reason(),
              AllOf(HasSubstr("detector.dead_time modelled"), Not(HasSubstr("unevenly"))));
  saturated.blind_fraction = 0.1;
  EXPECT_THAT(reason(), HasSubstr("inputs share the light so unevenly"));
  saturated.flicker_misfit = 0.338;
  EXPECT_THAT(reason(), AllOf(HasSubstr("the light varies by 34 % (rms) within a frame"),
                              Not(HasSubstr("unevenly"))));
}

// A frame's excess of 5 +- 4 % says nothing, and the mean of 30 of them does. A mean of 2 % is too
// little to matter, however sure it is.
TEST_F(StatusReports, SayWhenThePulseIsAnotherOverManyFrames) {
  const auto publish_a_second = [&](double excess, double deviation, int frames) {
    FrameMessage message = frame(FrameStatus::ok);
    message.pulse_excess = excess;
    message.std_pulse_excess = deviation;
    for (int n = 0; n < frames; ++n) reporter.frame_published(message);
    clock.advance_ms(1000);
    reporter.tick({1000, clock.steady_ns(), 0, ""});
  };
  publish_a_second(0.05, 0.04, 10);
  publish_a_second(0.05, 0.04, 20);
  reporter.begin(SourceInfo{"scripted", true, {}});
  publish_a_second(0.02, 0.001, 20);
  publish_a_second(-0.08, 0.0005, 20);
  EXPECT_THAT(published(), testing::ElementsAre(
                               HasSubstr("\"starting\""), HasSubstr("\"reason\":\"\""),
                               AllOf(HasSubstr("\"streaming\""), HasSubstr("5.0 +- 0.7 % wider"),
                                     HasSubstr("off by up to 0.3 of a pulse width"),
                                     HasSubstr("pulse.width fitted")),
                               HasSubstr("\"starting\""), HasSubstr("\"reason\":\"\""),
                               AllOf(HasSubstr("% narrower"), HasSubstr("pulse.sigma_ps"))));
}

TEST_F(StatusReports, SayWhenThePathBendsAndWasTakenAsStraight) {
  FrameMessage bent = frame(FrameStatus::ok);
  bent.acceleration_misfit_mps2 = -25.3;
  bent.signal_gap = 0.375;
  for (int second = 0; second < 3; ++second) {
    for (int n = 0; n < 20; ++n) {
      const bool is_off = second == 0 ? n == 0 : second == 1 && n % 3 != 0;
      reporter.frame_published(is_off ? bent : frame(FrameStatus::ok));
    }
    clock.advance_ms(1000);
    reporter.tick({1000, clock.steady_ns(), 0, ""});
  }
  EXPECT_THAT(published(), testing::ElementsAre(
                               HasSubstr("\"starting\""), HasSubstr("\"reason\":\"\""),
                               AllOf(HasSubstr("\"streaming\""), HasSubstr("-25 m/s^2"),
                                     HasSubstr("scene.motion auto"), HasSubstr("missing in 38 %")),
                               HasSubstr("\"reason\":\"\"")));
}

// The shape of a pulse whose width is fitted: surely in each frame, and in many frames together.
TEST_F(StatusReports, SayWhenAFittedPulseIsNoGaussian) {
  FrameMessage fitted = frame(FrameStatus::ok);
  const auto reason_after = [&](const FrameMessage& message, int frames) {
    for (int n = 0; n < frames; ++n) reporter.frame_published(message);
    clock.advance_ms(1000);
    reporter.tick({1000, clock.steady_ns(), 0, ""});
    return reporter.status().reason;
  };
  fitted.std_pulse_skew = 0.09;
  fitted.pulse_skew = 0.01;
  EXPECT_EQ(reason_after(fitted, 100), "");
  fitted.pulse_skew = 0.2;
  EXPECT_THAT(reason_after(fitted, 40),
              AllOf(HasSubstr("skewness of +0."), HasSubstr("tabulated")));
  fitted.shape_misfit = 0.31;
  EXPECT_THAT(reason_after(fitted, 20),
              AllOf(HasSubstr("no gaussian, by 31 %"), Not(HasSubstr("skewness"))));
}

// An acceleration that changes: surely in each frame, and in many frames together.
TEST_F(StatusReports, SayWhenTheAccelerationChanges) {
  FrameMessage bent = frame(FrameStatus::ok);
  bent.acceleration_mps2 = 3;
  const auto reason_after = [&](const FrameMessage& message, int frames) {
    for (int n = 0; n < frames; ++n) reporter.frame_published(message);
    clock.advance_ms(1000);
    reporter.tick({1000, clock.steady_ns(), 0, ""});
    return reporter.status().reason;
  };
  bent.path_excess = 1;
  EXPECT_EQ(reason_after(bent, 400), "");
  reporter.begin(SourceInfo{"scripted", true, {}});
  bent.path_excess = 2;
  EXPECT_EQ(reason_after(bent, 5), "");
  EXPECT_THAT(reason_after(bent, 40),
              AllOf(HasSubstr("2 times what chance makes"), HasSubstr("4.0 of their deviations"),
                    HasSubstr("make frames shorter"), Not(HasSubstr("scene.motion"))));
  bent.jerk_misfit_mps3 = -120;
  bent.signal_gap = 0.25;
  EXPECT_THAT(reason_after(bent, 20),
              AllOf(HasSubstr("-1.2e+02 m/s^3"), HasSubstr("constant acceleration"),
                    Not(HasSubstr("what chance makes"))));
  reporter.begin(SourceInfo{"scripted", true, {}});
  FrameMessage straight = frame(FrameStatus::ok);
  straight.path_excess = 2;
  EXPECT_THAT(reason_after(straight, 40), HasSubstr("set scene.motion accelerating"));
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
                                   HasSubstr("\"reason\":\"\"")));
}

TEST_F(StatusReports, SayWhenThePhotonsContradictThePattern) {
  FrameMessage other = frame(FrameStatus::no_target);
  other.pattern_fault = PatternFault::dark_pulses;
  const StreamHealth health{1000, clock.steady_ns(), 0, ""};
  for (int second = 0; second < 3; ++second) {
    // One by chance, then most, beside frames in which there is no target at all; then none.
    for (int n = 0; n < 20; ++n) {
      const bool contradicts = second == 0 ? n == 0 : second == 1 && n % 2 == 0;
      reporter.frame_published(
          contradicts ? other : frame(second == 1 ? FrameStatus::no_target : FrameStatus::ok));
    }
    clock.advance_ms(1000);
    reporter.tick({1000, clock.steady_ns(), 0, ""});
  }
  const auto said = HasSubstr("contradict the pattern: most of its pulses get no light");
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
