#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "daemon/stream/frame_message.hpp"
#include "protocol/frame_json.hpp"
#include "protocol/pattern_json.hpp"
#include "tests/support/light_scene.hpp"
#include "tests/support/program.hpp"

// The built program where the configuration's pattern is not the one that was played.

namespace splid {
namespace {

using test::ProgramResult;
using test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

const std::string played = "interleaved-180-189";

class PatternProgram : public ::testing::Test {
 protected:
  [[nodiscard]] std::string config(const std::string& pattern, const std::string& scene) const {
    return folder.write(pattern + ".config.json",
                        R"({"schema":"splid.config","v":[1,0],"source":{"driver":"simulator")" +
                            scene +
                            R"(},"pattern":{"file":")" SPLID_SOURCE_DIR "/config/patterns/" +
                            pattern + R"(.json"},"publish":{"endpoint":"ipc://)" +
                            folder.path("socket") + "\"}" + test::small_ring + "}");
  }

  void record(const std::string& seconds, const std::string& scene = "") const {
    const ProgramResult made = run_program({"simulate", "--config", config(played, scene),
                                            "--seconds", seconds, "--output", recording});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }

  [[nodiscard]] ProgramResult replay(const std::string& pattern) const {
    return run_program({"replay", recording, "--config", config(pattern, ""), "--json"});
  }

  splid::test::TempFolder folder;
  std::string recording = folder.path("scene.ptu");
};

// But the last, which ends with the recording.
std::vector<FrameMessage> frames_of(const ProgramResult& result) {
  std::vector<FrameMessage> frames;
  std::istringstream lines(result.out);
  for (std::string line; std::getline(lines, line);) frames.push_back(frame_from_json(line));
  if (!frames.empty()) frames.pop_back();
  return frames;
}

TEST_F(PatternProgram, NoFrameOfAnotherPatternIsOkAndTheReasonIsSaid) {
  record("1");
  for (const std::string wrong : {"random-40", "periodic-3780"}) {
    const ProgramResult result = replay(wrong);
    EXPECT_EQ(result.exit_code, 4) << wrong;
    EXPECT_THAT(result.err, AllOf(HasSubstr("was recorded with another pattern (interleaved"),
                                  HasSubstr("the photons contradict the pattern"),
                                  HasSubstr("Set pattern.file to the pattern")));
    const auto frames = frames_of(result);
    EXPECT_EQ(frames.size(), 20u);
    EXPECT_TRUE(std::ranges::any_of(
        frames, [](const FrameMessage& frame) { return pattern_finding(frame) != nullptr; }));
    for (const FrameMessage& frame : frames) {
      // A line of chance through other light may look like any target's, with the odds of one.
      EXPECT_NE(frame.status, FrameStatus::ok) << wrong;
      EXPECT_FALSE(pattern_finding(frame) != nullptr && frame.distance_m.has_value());
    }
  }
}

TEST_F(PatternProgram, ThePatternThatWasPlayedIsBelievedAndNothingIsSaid) {
  record("0.5");
  const ProgramResult result = replay(played);
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err, AllOf(Not(HasSubstr("another pattern")), Not(HasSubstr("contradict"))));
  const auto frames = frames_of(result);
  EXPECT_EQ(frames.size(), 10U);
  for (const FrameMessage& frame : frames) EXPECT_EQ(frame.status, FrameStatus::ok);
}

TEST_F(PatternProgram, CalibrateAndTradeoffSayThatTheRecordingHasAnotherPattern) {
  record("0.3");
  const std::string other = config("random-40", "");
  const auto said = HasSubstr("was recorded with another pattern (interleaved");
  EXPECT_THAT(run_program({"calibrate", recording, "--config", other, "--output",
                           folder.path("found.json")})
                  .err,
              said);
  EXPECT_THAT(run_program({"tradeoff", recording, "--config", other, "--lengths", "50", "--plot",
                           folder.path("plot.svg"), "--frames", "10"})
                  .err,
              said);
}

}  // namespace
}  // namespace splid
