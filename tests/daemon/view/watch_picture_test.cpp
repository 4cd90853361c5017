#include "daemon/view/watch_picture.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "protocol/status_json.hpp"

namespace splid::view {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

FrameMessage frame_at(double timestamp_s, FrameStatus status) {
  FrameMessage frame;
  frame.timestamp_s = timestamp_s;
  frame.status = status;
  frame.duration_ms = 50;
  frame.distance_m = 284.5;
  frame.std_distance_m = 0.00055;
  frame.velocity_mps = -1.25;
  frame.signal_per_pulse = 1.35e-3;
  frame.photons = 12'345;
  return frame;
}

std::string all_of(const WatchPicture& picture, WatchPicture::Size size = {}) {
  std::string text;
  for (const std::string& line : picture.lines(size, false)) text += line + "\n";
  return text;
}

TEST(WatchPicture, ShowsValuesStateAndLosses) {
  WatchPicture picture("tcp://127.0.0.1:9872", Characters::utf8);
  EXPECT_THAT(all_of(picture), HasSubstr("no frame yet"));
  StatusMessage status;
  status.state = DaemonState::degraded;
  status.measurement = "no_target";
  status.reason = "the ring is full";
  status.lost_tags = 1'234'567;
  status.uncounted_losses = 2;
  status.ring_fill_ratio = 0.5;
  picture.take("status", to_json(status));
  picture.take("frame", to_json(frame_at(100, FrameStatus::ok)));
  EXPECT_THAT(all_of(picture),
              AllOf(StartsWith("no target  "), HasSubstr("the ring is full"),
                    HasSubstr("lost tags 1,234,567 and 2 losses"), HasSubstr("284.50000 m"),
                    HasSubstr("+- 0.55 mm"), HasSubstr("-1.2500 m/s"), HasSubstr("12,345 photons"),
                    HasSubstr(" 50 % full")));
  picture.set_connection("nobody answers");
  EXPECT_THAT(all_of(picture), AllOf(StartsWith("no connection"), HasSubstr("nobody answers"),
                                     HasSubstr("last heard: degraded   device connected\n")));
}

// Green is for a measurement that is ok alone.
TEST(WatchPicture, PaintsWhatComesOfTheMeasurement) {
  WatchPicture picture("tcp://127.0.0.1:9872", Characters::utf8);
  const auto head = [&](DaemonState state, const std::string& measurement) {
    StatusMessage status;
    status.state = state;
    status.measurement = measurement;
    picture.take("status", to_json(status));
    const std::string line = picture.lines({}, true).front();
    return line.substr(0, line.find("  "));
  };
  EXPECT_EQ(head(DaemonState::streaming, "ok"), "\033[1;32mok\033[0m");
  EXPECT_EQ(head(DaemonState::degraded, "ok"), "\033[1;33mok, degraded\033[0m");
  EXPECT_EQ(head(DaemonState::streaming, "ambiguous"), "\033[1;33mambiguous\033[0m");
  EXPECT_EQ(head(DaemonState::streaming, "no_target"), "\033[1;31mno target\033[0m");
  EXPECT_EQ(head(DaemonState::degraded, "wrong_pattern"), "\033[1;31mwrong pattern\033[0m");
  EXPECT_EQ(head(DaemonState::starting, "none"), "\033[1;33mstarting\033[0m");
  EXPECT_EQ(head(DaemonState::waiting_for_device, "none"), "\033[1;33mwaiting for device\033[0m");
}

// The reason says what to do, which stands at its end.
TEST(WatchPicture, ALongReasonHasSeveralLines) {
  WatchPicture picture("tcp://127.0.0.1:9872", Characters::utf8);
  StatusMessage status;
  status.state = DaemonState::degraded;
  status.reason =
      "frames take 1.4 times as long to compute as they last: lower estimator.effort or "
      "scene.max_speed_mps, or raise pipeline.estimation_threads";
  picture.take("status", to_json(status));
  const std::vector<std::string> lines = picture.lines({80, 24}, false);
  EXPECT_EQ(lines.at(1),
            "frames take 1.4 times as long to compute as they last: lower estimator.effort or");
  EXPECT_EQ(lines.at(2), "scene.max_speed_mps, or raise pipeline.estimation_threads");
  EXPECT_THAT(lines, Each(testing::SizeIs(testing::Le(80U))));
}

TEST(WatchPicture, CountsFramesThatCannotBeRead) {
  WatchPicture picture("tcp://127.0.0.1:9872", Characters::utf8);
  picture.take("status", to_json(StatusMessage{}));
  picture.take("frame", to_json(frame_at(100, FrameStatus::ok)));
  for (const char* bad : {"", "{", "[]", R"({"schema":"splid.frame"})"}) picture.take("frame", bad);
  EXPECT_THAT(all_of(picture),
              AllOf(HasSubstr("messages that cannot be read 4"), HasSubstr("284.50000 m")));
}

TEST(WatchPicture, ShowsWhatIsRecorded) {
  WatchPicture picture("tcp://127.0.0.1:9872", Characters::utf8);
  StatusMessage status;
  picture.take("status", to_json(status));
  EXPECT_THAT(all_of(picture), HasSubstr("recording off\n"));
  status.recording = RecordingStatus{};
  picture.take("status", to_json(status));
  EXPECT_THAT(all_of(picture), HasSubstr("recording waiting\n"));
  status.recording = RecordingStatus{RecordingState::writing, "r/a.ptu", 12'345'678, 61.7};
  picture.take("status", to_json(status));
  EXPECT_THAT(all_of(picture), HasSubstr("recording writing   12.3 MB   62 s   r/a.ptu\n"));
}

// As many as there may be still fit a terminal of 80 x 24.
TEST(WatchPicture, ListsFurtherTargetsWithTheirDeviations) {
  WatchPicture picture("tcp://127.0.0.1:9872", Characters::utf8);
  picture.take("status", to_json(StatusMessage{}));
  FrameMessage frame = frame_at(100, FrameStatus::ok);
  frame.targets.emplace(4);
  for (FrameMessage::Target& target : *frame.targets) {
    target.status = FrameStatus::ok;
    target.distance_m = 1234.56789;
    target.std_distance_m = 0.00012;
    target.velocity_mps = -123.4567;
    target.std_velocity_mps = 0.0123;
  }
  picture.take("frame", to_json(frame));
  EXPECT_THAT(
      all_of(picture),
      AllOf(HasSubstr("target 2   1234.56789 m +- 0.12 mm   -123.4567 m/s +- 1.23 cm/s   ok"),
            HasSubstr("target 4   "), HasSubstr(" % full")));
  EXPECT_LE(picture.lines({80, 100}, false).size(), 24u);
  frame.targets->clear();
  picture.take("frame", to_json(frame));
  EXPECT_THAT(all_of(picture), Not(HasSubstr("target ")));
}

// A frame that is ok may show more than the configured model has, and the status what to do.
TEST(WatchPicture, ShowsTheFindings) {
  WatchPicture picture("tcp://127.0.0.1:9872", Characters::utf8);
  StatusMessage status;
  picture.take("status", to_json(status));
  FrameMessage frame = frame_at(100, FrameStatus::ok);
  picture.take("frame", to_json(frame));
  EXPECT_THAT(all_of(picture), AllOf(HasSubstr("state starting   device connected\n"),
                                     HasSubstr("frame ok   effort -   12,345 photons\n")));
  frame.findings = {{"pulse_width", 0.3841, 0.0123, "", 30, ""},
                    {"jerk", -37.5, 4, "m/s3", 20, ""}};
  frame.targets.emplace(2);
  frame.targets->back().status = FrameStatus::ok;
  frame.targets->back().findings = {{"fading", 0.25, 0.05, "", 15, ""}};
  picture.take("frame", to_json(frame));
  status.findings = {{"pulse_width", 0.3841, 0.0123, "", 30, "Calibrate the pulse."}};
  picture.take("status", to_json(status));
  EXPECT_THAT(
      all_of(picture, {140, 40}),
      AllOf(HasSubstr("\npulse width 0.384 +- 0.012: Calibrate the pulse.\n"),
            HasSubstr("frame ok   pulse width 0.384 +- 0.012, jerk -37.5 +- 4 m/s3   effort -"),
            HasSubstr(" ok   fading 0.25 +- 0.05\n")));
}

TEST(WatchPicture, KeepsToItsSizeAndLetsNoControlCodeThrough) {
  WatchPicture picture("tcp://[::1]:9872", Characters::utf8);
  picture.take("status", R"({"state":"degraded","reason":"\u001b[2J\u0007 überlang )" +
                             std::string(300, 'x') + R"("})");
  picture.take("frame", to_json(frame_at(100, FrameStatus::ok)));
  for (const WatchPicture::Size size : {WatchPicture::Size{80, 24}, {20, 3}, {1, 1}, {300, 60}}) {
    const auto lines = picture.lines(size, false);
    EXPECT_LE(lines.size(), size.rows);
    for (const std::string& line : lines) {
      std::size_t width = 0;
      for (const char byte : line) width += (static_cast<unsigned char>(byte) & 0xC0U) != 0x80U;
      EXPECT_LE(width, size.columns) << line;
    }
    EXPECT_THAT(lines, Each(Not(HasSubstr("\033"))));
  }
}

// Four pixels in a row, of which the last shows no target.
SceneMessage scene_of_four() {
  SceneMessage scene;
  scene.whole.timestamp_s = 3725.25;
  for (int i = 0; i < 4; ++i) {
    FrameMessage frame = frame_at(3725.25, i < 3 ? FrameStatus::ok : FrameStatus::no_target);
    frame.distance_m = frame.velocity_mps = std::nullopt;
    if (i < 3) frame.distance_m = frame.velocity_mps = 20.0 + i;
    scene.pixels.push_back({std::string(1, static_cast<char>('a' + i)), 0.1 * i, 0.0, frame});
  }
  return scene;
}

TEST(WatchPicture, ShowsThePicturesOfSeveralPixels) {
  WatchPicture picture("tcp://127.0.0.1:9872", Characters::ascii);
  picture.take("status", to_json(StatusMessage{}));
  picture.take("scene", to_json(scene_of_four()));
  EXPECT_THAT(
      all_of(picture),
      AllOf(HasSubstr("\n01:02:05.250  3 ok, 1 no_target; range 20.0000 _ to 22.0000 # m; "
                      "velocity\n20.0000 _ to 22.0000 # m/s\n  __==##.     __==##. \n\nring"),
            Not(HasSubstr("no frame yet")), Not(HasSubstr("signal"))));
  EXPECT_THAT(all_of(picture, {20, 40}), HasSubstr("\n  _=#.    _=#.\n"));
  picture.take("scene", "{");
  EXPECT_THAT(all_of(picture), HasSubstr("messages that cannot be read 1"));
  // The daemon comes back with one pixel, and with several again.
  picture.take("frame", to_json(frame_at(100, FrameStatus::ok)));
  EXPECT_THAT(all_of(picture), AllOf(HasSubstr("frame ok"), Not(HasSubstr("range "))));
  picture.take("scene", to_json(scene_of_four()));
  EXPECT_THAT(all_of(picture), AllOf(Not(HasSubstr("frame ok")), HasSubstr("range ")));
}

TEST(WatchPicture, ShowsTheValuesOfOnePixelBelowThePictures) {
  WatchPicture picture("tcp://127.0.0.1:9872", Characters::ascii, "frame/b");
  FrameMessage frame = frame_at(100, FrameStatus::ok);
  frame.pixel = "b";
  picture.take("frame/b", to_json(frame));
  picture.take("scene", to_json(scene_of_four()));
  frame.pixel = "ba";
  frame.distance_m = 1;
  picture.take("frame/ba", to_json(frame));
  EXPECT_THAT(all_of(picture), AllOf(HasSubstr("__==##.     __==##. \n\npixel b: ok   effort"),
                                     HasSubstr("284.50000 m"), HasSubstr("distance: 284.5 to")));
}

TEST(WatchPicture, PassesOverWhatIsNoStatus) {
  WatchPicture picture("tcp://127.0.0.1:9872", Characters::utf8);
  for (const char* json : {"", "[]", "{", R"({"state":3,"lost_tags":-1,"ring_fill_ratio":"full"})",
                           R"({"lost_tags":"many","device":null,"recording":3})",
                           R"({"recording":{"state":1,"file":[],"bytes":-1,"seconds":""}})"}) {
    EXPECT_NO_THROW(picture.take("status", json)) << json;
    EXPECT_NO_THROW(picture.take("version", json)) << json;
  }
  EXPECT_THAT(all_of(picture), HasSubstr("lost tags 0"));
}

TEST(Sparkline, ColumnsAreSecondsAndGapsStayBlank) {
  Sparkline line;
  EXPECT_EQ(line.draw(4, Characters::ascii), "    ");
  EXPECT_FALSE(line.range(4));
  line.add(1000.1, 1.0);
  line.add(1000.9, 3.0);
  line.add(1001.5, std::nullopt);
  line.add(1002.5, 16.0);
  EXPECT_EQ(line.draw(4, Characters::ascii), " _ #");
  EXPECT_EQ(line.draw(3, Characters::utf8), "▁ █");
  ASSERT_TRUE(line.range(4));
  EXPECT_EQ(line.range(4)->low, 2.0);
  EXPECT_EQ(line.range(4)->high, 16.0);
  EXPECT_EQ(line.draw(1, Characters::ascii), "~");
}

TEST(Sparkline, ForgetsWhatIsOldAndBeginsAnewWithAnotherReplay) {
  Sparkline line;
  for (int second = 0; second < 2000; ++second) line.add(second, second);
  ASSERT_TRUE(line.range(10'000));
  EXPECT_EQ(line.range(10'000)->low, 1999 - Sparkline::kept_s);
  line.add(10, 5.0);
  EXPECT_EQ(line.draw(2, Characters::ascii), " ~");
  line.add(1e300, 5.0);  // no date
  EXPECT_EQ(line.draw(2, Characters::ascii), " ~");
}

}  // namespace
}  // namespace splid::view
