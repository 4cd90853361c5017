#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "daemon/output/publisher.hpp"
#include "protocol/frame_json.hpp"
#include "protocol/status_json.hpp"
#include "tests/support/patience.hpp"
#include "tests/support/program.hpp"
#include "tests/support/temp_folder.hpp"

// `splid listen`, and what it does with messages that are none.

namespace splid {
namespace {

using ::testing::HasSubstr;

TEST(ListenProgram, GoesOnAfterMessagesThatCannotBeRead) {
  const test::TempFolder folder;
  for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--json"}}) {
    Publisher publisher("ipc://" + folder.path("frames" + std::to_string(more.size())), 100);
    std::vector<std::string> arguments = {
        "listen", "--endpoint", publisher.endpoint(), "--count", "2", "--timeout", "60"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    test::Program listening(arguments);
    ASSERT_TRUE(publisher.wait_for_subscriber(test::patience));
    FrameMessage frame;
    frame.duration_ms = 50;
    publisher.publish_frame("{");
    publisher.publish_frame(R"({"schema":"splid.frame"})");
    publisher.publish_frame(to_json(frame));
    publisher.publish_frame("no JSON");
    publisher.publish_frame(to_json(frame));
    const test::ProgramResult result = listening.wait();
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.err, HasSubstr("cannot be read and is left out: "));
    EXPECT_THAT(result.err, HasSubstr("3 frame messages could not be read"));
    EXPECT_EQ(std::count(result.out.begin(), result.out.end(), '\n'), more.empty() ? 3 : 2);
  }
}

// On standard error, since data go to standard output; each once, as long as it stands.
TEST(ListenProgram, TellsEachFindingOfTheStatusOnceWithWhatToDo) {
  const test::TempFolder folder;
  Publisher publisher("ipc://" + folder.path("frames"), 100);
  test::Program listening(
      {"listen", "--endpoint", publisher.endpoint(), "--count", "1", "--timeout", "60"});
  ASSERT_TRUE(publisher.wait_for_subscriber(test::patience));
  StatusMessage status;
  const FrameMessage::Finding wide = {"pulse_width", 0.37, 0.01, "", 30, "Calibrate."};
  const FrameMessage::Finding jerk = {"jerk", -3, 0.5, "m/s3", 20, "Shorten."};
  for (const auto& findings : {std::vector{wide}, {wide, jerk}, {jerk}, {wide}}) {
    status.findings = findings;
    publisher.publish_status(to_json(status));
  }
  FrameMessage frame;
  frame.findings = {jerk};
  publisher.publish_frame(to_json(frame));
  const test::ProgramResult result = listening.wait();
  EXPECT_EQ(result.exit_code, 0);
  const std::string wide_told = "splid: pulse width 0.37 +- 0.01: Calibrate.\n";
  EXPECT_EQ(result.err, wide_told + "splid: jerk -3 +- 0.5 m/s3: Shorten.\n" + wide_told);
  EXPECT_THAT(result.out, HasSubstr("not_run  jerk -3 +- 0.5 m/s3\n"));
  const std::string line = result.out.substr(result.out.find('\n') + 1);
  EXPECT_THAT(line, testing::MatchesRegex("[0-2][0-9]:[0-5][0-9]:[0-6][0-9].[0-9]{3} .*\n"));
}

// What comes of the measurement, where that turns; that all is well is no news at first.
TEST(ListenProgram, TellsWhereTheMeasurementTurnsAndWhy) {
  const test::TempFolder folder;
  Publisher publisher("ipc://" + folder.path("frames"), 100);
  test::Program listening({"listen", "--endpoint", publisher.endpoint(), "--timeout", "60"});
  ASSERT_TRUE(publisher.wait_for_subscriber(test::patience));
  StatusMessage status;
  for (const DaemonState state :
       {DaemonState::starting, DaemonState::streaming, DaemonState::degraded, DaemonState::degraded,
        DaemonState::streaming, DaemonState::stopping}) {
    const bool degraded = state == DaemonState::degraded;
    status.state = state;
    status.measurement = degraded ? "no_sync" : "ok";
    status.reason = degraded ? "look at the cable" : "";
    publisher.publish_status(to_json(status));
  }
  const test::ProgramResult result = listening.wait();
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "splid: no sync: look at the cable\nsplid: ok\n");
}

}  // namespace
}  // namespace splid
