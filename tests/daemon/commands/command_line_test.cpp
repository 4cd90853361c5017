#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <sstream>

#include "daemon/output/publisher.hpp"
#include "estimator/model/vector_level.hpp"
#include "protocol/status_json.hpp"
#include "tests/support/daemon_scene.hpp"
#include "tests/support/program.hpp"

// The built program, run as a person would: what it prints and its exit codes.

namespace splid {
namespace {

using splid::test::file_text;
using splid::test::Program;
using splid::test::ProgramResult;
using splid::test::run_program;
using ::testing::AllOf;
using ::testing::ElementsAreArray;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

class CommandLine : public ::testing::Test {
 protected:
  CommandLine() {
    run_program({"pattern", "interleaved", "--subperiods-ns", "180", "189", "--output",
                 folder.path("pattern.json")});
    config = write_config("config.json", "\"driver\":\"simulator\",\"pace\":\"max\"");
  }

  std::string write_config(const std::string& name, const std::string& source,
                           const std::string& more = "",
                           const std::string& pattern = "pattern.json") const {
    return folder.write(
        name, R"({"schema":"splid.config","v":[1,0],"source":{)" + source +
                  R"(},"pattern":{"file":")" + pattern +
                  R"("},"pipeline":{"ring_capacity_tags":131072},"publish":{"endpoint":"ipc://)" +
                  folder.path("socket") + "\"}" + more + "}");
  }

  std::string simulate(const std::string& name, const std::string& seconds) const {
    const std::string file = folder.path(name);
    const ProgramResult result =
        run_program({"simulate", "--config", config, "--seconds", seconds, "--output", file});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return file;
  }

  std::vector<std::string> frames(const std::string& recording, const std::string& speed) const {
    const ProgramResult result =
        run_program({"replay", recording, "--config", config, "--speed", speed, "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::vector<std::string> lines = lines_of(result.out);
    for (std::string& line : lines) line = repeatable(line);
    return lines;
  }

  void expect_error(const std::vector<std::string>& arguments, int exit_code,
                    const ::testing::Matcher<const std::string&>& err) const {
    const ProgramResult result = run_program(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << arguments.front() << ": " << result.err;
    EXPECT_THAT(result.err, err);
    EXPECT_THAT(result.out, IsEmpty());
  }

  splid::test::TempFolder folder;
  std::string config;
};

TEST_F(CommandLine, WithoutArgumentsHelpsAndFails) {
  expect_error({}, 2, AllOf(HasSubstr("replay"), HasSubstr("listen")));
}

TEST_F(CommandLine, SaysItsVersionOnStandardOutput) {
  const ProgramResult result = run_program({"--version"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out, std::string("splid " SPLID_VERSION " (search kernels: ") +
                            vector_level_name(best_vector_level()) + ")\n");
}

TEST_F(CommandLine, RefusesVectorsThatTheProcessorDoesNotRun) {
  ::setenv("SPLID_VECTOR_LEVEL", "avx1024", 1);
  expect_error({"--version"}, 2,
               HasSubstr("SPLID_VECTOR_LEVEL=avx1024: this processor runs generic"));
  ::unsetenv("SPLID_VECTOR_LEVEL");
}

TEST_F(CommandLine, NamesTheNearestCommand) {
  expect_error({"repaly"}, 2, HasSubstr("no command 'repaly'; did you mean replay?"));
  expect_error({"frobnicate"}, 2, HasSubstr("no command 'frobnicate'"));
  expect_error({"ctl", "statsu"}, 2,
               HasSubstr("no command 'statsu'; did you mean status? (splid ctl --help lists all)"));
  expect_error({"pattern", "mr"}, 2, HasSubstr("no command 'mr'; did you mean mrr?"));
}

TEST_F(CommandLine, UsageErrorsExitWithTwo) {
  expect_error({"run"}, 2, HasSubstr("--config"));
  expect_error({"replay", "--config", config}, 2, HasSubstr("recording"));
  expect_error({"run", "--config", config, "--fast"}, 2, HasSubstr("--fast"));
  expect_error({"simulate", "--config", config, "--seconds", "-1", "--output", "x.ptu"}, 2,
               HasSubstr("--seconds"));
  expect_error({"replay", "x.ptu", "--config", config, "--speed", "warp"}, 2,
               HasSubstr("--speed warp"));
  expect_error({"check"}, 2, HasSubstr("needs a FILE"));
  expect_error({"listen", "--max-distance-rmse-mm", "3"}, 2, HasSubstr("--truth"));
}

TEST_F(CommandLine, APublicKeyMayBeginLikeAnOption) {
  const std::string key = "-czW00AWntRxK67vUQLxl6fhoFMtkOPHgqhBPlqM";
  for (const std::string command : {"listen", "view"}) {
    const auto together = HasSubstr("--key and --server-key go together");
    expect_error({command, "--server-key", key}, 2, together);
    expect_error({command, "--server-key=" + key}, 2, together);
    expect_error({command, "--server-key", key.substr(0, 39)}, 2, HasSubstr("no option -c"));
    expect_error({command, "--endpoint", key}, 2, HasSubstr("no option -c"));
  }
}

TEST_F(CommandLine, ConfigErrorsNameTheirPlace) {
  const std::string missing = folder.path("missing.json");
  expect_error({"run", "--config", missing}, 2, HasSubstr(missing));
  expect_error({"run", "--config", write_config("a.json", R"("driver":"simulater")")}, 2,
               AllOf(HasSubstr("simulater"), HasSubstr("simulator")));
  expect_error({"run", "--config",
                write_config("b.json", R"("driver":"simulator")", R"(,"frame":{"lenght_ms":50})")},
               2, AllOf(HasSubstr("/frame"), HasSubstr("lenght_ms"), HasSubstr("length_ms")));
  expect_error({"run", "--config",
                write_config("c.json", R"("driver":"simulator")", R"(,"frame":{"length_ms":-5})")},
               2, AllOf(HasSubstr("/frame/length_ms"), HasSubstr("-5")));
}

TEST_F(CommandLine, RecordingErrorsNameFileAndByte) {
  const std::string missing = folder.path("missing.ptu");
  expect_error({"replay", missing, "--config", config}, 4,
               AllOf(HasSubstr(missing), HasSubstr("No such file")));
  const std::string text = folder.write("text.ptu", "this is no recording at all");
  expect_error({"replay", text, "--config", config}, 4,
               AllOf(HasSubstr(text), HasSubstr("known format")));
  const std::string whole = file_text(simulate("whole.ptu", "0.1"));
  const std::string cut = folder.write("cut.ptu", whole.substr(0, 1000));
  expect_error({"replay", cut, "--config", config}, 4, AllOf(HasSubstr(cut), HasSubstr("byte")));
  std::string t3 = whole;
  // Measurement_Mode: name of 32 bytes, index, type, then the value.
  const auto mode = t3.find("Measurement_Mode") + 40;
  ASSERT_EQ(t3[mode], 2);
  t3[mode] = 3;
  expect_error({"replay", folder.write("t3.ptu", t3), "--config", config}, 4, HasSubstr("T3"));
}

TEST_F(CommandLine, WarnsOfAChannelThatNeverOccurs) {
  const std::string recording = simulate("a.ptu", "0.2");
  const std::string other =
      write_config("other.json", R"("driver":"simulator")", R"(,"channels":{"photon":[5]})");
  const ProgramResult result = run_program({"replay", recording, "--config", other});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err,
              HasSubstr("channels.photon 5 never occurs; " + recording + " has input 1"));
}

TEST_F(CommandLine, AWrongPatternPeriodIsADataErrorThatSaysWhatFits) {
  const std::string recording = simulate("a.ptu", "0.5");
  run_program({"pattern", "random", "--period-ns", "3770", "--output", folder.path("other.json")});
  const std::string wrong = write_config("wrong.json", R"("driver":"simulator")", "", "other.json");
  const ProgramResult result = run_program({"replay", recording, "--config", wrong, "--json"});
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, AllOf(HasSubstr("splid: error:"), HasSubstr("3780"), HasSubstr("3770")));
  EXPECT_GE(lines_of(result.out).size(), 10u);
  EXPECT_THAT(result.out, Not(HasSubstr("\"status\":\"ok\"")));
}

TEST_F(CommandLine, NamesOfFilesAreShownWithoutTheirControlCharacters) {
  const std::string name = folder.path("a\033[2J\nsplid: error: b");
  const std::string pattern = name + "/pattern.json";
  std::filesystem::create_directory(name);
  write_config("a\033[2J\nsplid: error: b/config.json", R"("driver":"simulator")");
  const std::vector<std::vector<std::string>> commands = {
      {"pattern", "random", "--output", pattern},
      {"check", pattern},
      {"check", name + "/config.json"},
      {"keys", "--output", name},
      {"simulate", "--config", name + "/config.json", "--seconds", "0.2", "--output",
       name + "/a.ptu"},
      {"check", name + "/a.ptu"},
      {"convert", name + "/a.ptu", name + "/b.ptu"},
      {"replay", name + "/a.ptu", "--config", name + "/config.json", "--no-publish"},
      {"upload", "--config", name + "/config.json"}};
  for (const std::vector<std::string>& words : commands) {
    const ProgramResult result = run_program(words);
    EXPECT_THAT(result.err + result.out, HasSubstr("a?[2J?splid: error: b")) << words.front();
    EXPECT_THAT(result.err + result.out,
                AllOf(Not(HasSubstr("\033")), Not(HasSubstr("\nsplid: error: b"))));
  }
}

// A daemon that is stopped is not at fault.
TEST_F(CommandLine, AWrongPatternIsAWarningWhereAStopWasAskedFor) {
  const std::string recording = simulate("a.ptu", "4");
  run_program({"pattern", "random", "--period-ns", "3770", "--output", folder.path("other.json")});
  const std::string wrong = write_config("wrong.json", R"("driver":"simulator")", "", "other.json");
  Program replay({"replay", recording, "--config", wrong, "--speed", "0.1"});
  const ProgramResult heard = run_program({"listen", "--endpoint", "ipc://" + folder.path("socket"),
                                           "--count", "3", "--timeout", "60"});
  EXPECT_EQ(heard.exit_code, 0) << heard.err;
  replay.signal(SIGTERM);
  const ProgramResult result = replay.wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, AllOf(HasSubstr("warning: "), HasSubstr("3780"), HasSubstr("3770"),
                                Not(HasSubstr("splid: error:"))));
}

TEST_F(CommandLine, ACheckSaysWhichValueIsTakenForOneThatIsNoMore) {
  const std::string config =
      write_config("c.json", R"("driver":"simulator")", R"(,"estimator":{"effort":"exhaustive"})");
  const ProgramResult result = run_program({"check", config});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, AllOf(HasSubstr("warning: " + config + ": /estimator/effort: "),
                                HasSubstr("\"balanced\" is taken for it")));
}

TEST_F(CommandLine, ReplayGivesTheSameFramesAtAnySpeedAndAgain) {
  const std::string recording = simulate("a.ptu", "0.6");
  const std::vector<std::string> once = frames(recording, "max");
  ASSERT_GE(once.size(), 12u);
  EXPECT_THAT(once[0], HasSubstr("\"status\":\"ok\""));
  for (const char* speed : {"max", "10", "1"}) {
    EXPECT_THAT(frames(recording, speed), ElementsAreArray(once)) << speed;
  }
}

TEST_F(CommandLine, AReplayEndsWithWhatItFound) {
  const std::string recording = simulate("a.ptu", "0.6");
  const ProgramResult result =
      run_program({"replay", recording, "--config", config, "--no-publish", "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err,
              AllOf(HasSubstr(" ok"), HasSubstr("distance 284."), HasSubstr("m (median; 90 % of "),
                    HasSubstr("velocity +1."), HasSubstr(" cm/s a frame)")));
}

TEST_F(CommandLine, SimulateRepeatsItselfAndRefusesToOverwrite) {
  const std::string first = simulate("a.ptu", "0.2");
  const std::string before = file_text(first);
  expect_error({"simulate", "--config", config, "--seconds", "0.1", "--output", first}, 2,
               HasSubstr("--force"));
  EXPECT_EQ(file_text(first), before);
  EXPECT_THAT(frames(simulate("b.ptu", "0.2"), "max"), ElementsAreArray(frames(first, "max")));
  EXPECT_THAT(file_text(folder.path("a.truth.json")), HasSubstr("splid.truth"));
}

TEST_F(CommandLine, SimulateNeedsAScene) {
  expect_error(
      {"simulate", "--config", write_config("r.json", R"("driver":"replay","recording":"a.ptu")"),
       "--seconds", "1", "--output", folder.path("a.ptu")},
      2, AllOf(HasSubstr("/source/driver"), HasSubstr("simulator")));
}

TEST_F(CommandLine, RecordedRunAndSimulatedFileHoldTheSameTags) {
  const std::string simulated = simulate("a.ptu", "0.3");
  const std::string scene =
      write_config("s.json", R"("driver":"simulator","pace":"max","seconds":0.3)");
  const std::string recorded = folder.path("b.ptu");
  const ProgramResult result = run_program({"record", "--config", scene, "--output", recorded});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(frames(recorded, "max"), ElementsAreArray(frames(simulated, "max")));
  expect_error({"record", "--config", scene, "--output", recorded}, 2, HasSubstr("exists"));
}

TEST_F(CommandLine, ADiskThatFillsUpWhileRecordingIsADeviceError) {
  const std::string scene =
      write_config("s.json", R"("driver":"simulator","pace":"max","seconds":2)");
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit little{300'000, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &little);
  const std::string file = folder.path("a.ptu");
  const ProgramResult result = run_program({"record", "--config", scene, "--output", file});
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr(file + ": File too large after 300000 bytes"));
  EXPECT_EQ(run_program({"check", file}).exit_code, 0);
}

TEST_F(CommandLine, APortInUseIsADeviceError) {
  const Publisher other("tcp://127.0.0.1:*", 10);
  const std::string taken = folder.write(
      "taken.json", R"({"schema":"splid.config","v":[1,0],"source":{"driver":"simulator"},)"
                    R"("pattern":{"file":"pattern.json"},"publish":{"endpoint":")" +
                        other.endpoint() + "\"}}");
  expect_error({"run", "--config", taken}, 3,
               AllOf(HasSubstr(other.endpoint()), HasSubstr("Address already in use"),
                     HasSubstr("publish.endpoint"), HasSubstr("another program")));
}

// As where the installed service measures: who prints needs no port, who does not is told who has
// it.
TEST_F(CommandLine, AReplayWithoutAPortPrintsOrSaysWhoHasIt) {
  const std::string recording = simulate("a.ptu", "0.2");
  Publisher other("tcp://127.0.0.1:*", 10);
  const std::string taken =
      write_config("taken.json", R"("driver":"simulator")", R"(,"scene":{"max_speed_mps":150})");
  std::string text = file_text(taken);
  const std::string own = "ipc://" + folder.path("socket");
  text.replace(text.find(own), own.size(), other.endpoint());
  (void)folder.write("taken.json", text);

  const ProgramResult printed = run_program({"replay", recording, "--config", taken, "--json"});
  EXPECT_EQ(printed.exit_code, 0) << printed.err;
  EXPECT_EQ(lines_of(printed.out).size(),
            lines_of(run_program({"replay", recording, "--config", config, "--json"}).out).size());
  EXPECT_THAT(printed.err, HasSubstr("frames are printed and not published"));

  VersionMessage version;
  version.release = "7.8.9";
  version.pattern = "the-other-pattern";
  StatusMessage status;
  status.source = "the other source";
  other.publish_version(to_json(version));
  other.publish_status(to_json(status));
  expect_error(
      {"replay", recording, "--config", taken}, 3,
      AllOf(HasSubstr("splid 7.8.9"), HasSubstr("the other source"), HasSubstr("the-other-pattern"),
            HasSubstr("--no-publish"), HasSubstr("systemctl stop splid")));
  const ProgramResult silent =
      run_program({"replay", recording, "--config", taken, "--no-publish"});
  EXPECT_EQ(silent.exit_code, 0);
  EXPECT_THAT(silent.err, HasSubstr("not publishing"));
}

TEST_F(CommandLine, RunStopsOnSignalWithZero) {
  const std::string live = write_config("live.json", R"("driver":"simulator")");
  for (const int number : {SIGINT, SIGTERM}) {
    Program daemon({"run", "--config", live});
    const ProgramResult heard =
        run_program({"listen", "--endpoint", "ipc://" + folder.path("socket"), "--count", "2",
                     "--timeout", "20"});
    EXPECT_EQ(heard.exit_code, 0) << heard.err;
    EXPECT_EQ(lines_of(heard.out).size(), 3u) << heard.out;  // with the heading
    daemon.signal(number);
    const ProgramResult result = daemon.wait();
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.err, AllOf(HasSubstr("source "), HasSubstr("pattern.json"),
                                  HasSubstr("publishing at ipc://"), HasSubstr(" frames: ")));
  }
}

TEST_F(CommandLine, ListenComparesWithTheTruthAndEndsWithTheDaemon) {
  const std::string recording = simulate("a.ptu", "0.5");
  const std::string endpoint = "ipc://" + folder.path("socket");
  for (const auto& [limit, exit_code] : {std::pair{"5", 0}, std::pair{"0.0001", 4}}) {
    Program listener({"listen", "--endpoint", endpoint, "--truth", folder.path("a.truth.json"),
                      "--max-distance-rmse-mm", limit, "--timeout", "20"});
    const ProgramResult replayed =
        run_program({"replay", recording, "--config", config, "--wait-for-subscriber", "20"});
    EXPECT_EQ(replayed.exit_code, 0) << replayed.err;
    const ProgramResult heard = listener.wait();
    EXPECT_EQ(heard.exit_code, exit_code) << heard.err;
    EXPECT_THAT(heard.err, AllOf(HasSubstr("11 frames, 0 lost"), HasSubstr("distance RMSE")));
    EXPECT_THAT(heard.out, AllOf(HasSubstr("error"), Not(HasSubstr("WRONG PEAK"))));
  }
}

TEST_F(CommandLine, ListenersGetTheLinesOfTheReplay) {
  const std::string recording = simulate("a.ptu", "0.4");
  Program listener(
      {"listen", "--json", "--endpoint", "ipc://" + folder.path("socket"), "--timeout", "20"});
  const ProgramResult replayed = run_program(
      {"replay", recording, "--config", config, "--json", "--wait-for-subscriber", "20"});
  const ProgramResult heard = listener.wait();
  EXPECT_EQ(heard.exit_code, 0) << heard.err;
  EXPECT_GE(lines_of(heard.out).size(), 8u);
  EXPECT_EQ(heard.out, replayed.out);
}

TEST_F(CommandLine, ListenGivesUpAfterItsTimeout) {
  expect_error(
      {"listen", "--json", "--endpoint", "ipc://" + folder.path("nobody"), "--timeout", "0.2"}, 3,
      HasSubstr("no message"));
}

TEST_F(CommandLine, CheckSaysWhatAFileHolds) {
  EXPECT_THAT(run_program({"check", config}).out, HasSubstr("a configuration"));
  EXPECT_THAT(run_program({"check", folder.path("pattern.json")}).out,
              HasSubstr("interleaved, 40 pulses in 3780 ns, unambiguous to 566.608 m, closest "
                        "pulses 9 ns apart"));
  const ProgramResult recording = run_program({"check", simulate("a.ptu", "0.1")});
  EXPECT_EQ(recording.exit_code, 0);
  EXPECT_THAT(recording.out, AllOf(HasSubstr("record type 0x01010204"), HasSubstr("input 1"),
                                   HasSubstr("26,45"), HasSubstr("sync period")));
  expect_error({"check", folder.write("nothing", "")}, 4, HasSubstr("is empty"));
  expect_error({"check", folder.write("text", "hello")}, 4, HasSubstr("neither"));
  expect_error({"check", folder.path("missing")}, 2, HasSubstr("No such file"));
  expect_error({"check", folder.write("bad.json", R"({"schema":"splid.pattern","v":[1,0]})")}, 4,
               HasSubstr("bad.json"));
  const ProgramResult schema = run_program({"check", "--schema"});
  EXPECT_EQ(schema.exit_code, 0);
  EXPECT_THAT(schema.out, HasSubstr("json-schema.org"));
}

TEST_F(CommandLine, PatternsOfEachKindCanBeMade) {
  const std::string out = folder.path("p.json");
  const std::vector<std::vector<std::string>> kinds{
      {"random", "--pulses", "20", "--seed", "7"},
      {"random", "--stratified"},
      {"periodic", "--period-ns", "94.5", "--ambiguous"},
      {"mrr", "--periods-ns", "180", "189", "--repeats", "1000"}};
  for (std::vector<std::string> arguments : kinds) {
    const std::string kind = arguments.front();
    arguments.insert(arguments.begin(), "pattern");
    arguments.insert(arguments.end(), {"--output", out});
    const ProgramResult made = run_program(arguments);
    EXPECT_EQ(made.exit_code, 0) << kind << made.err;
    EXPECT_THAT(made.err, HasSubstr("closest pulses"));
    EXPECT_EQ(run_program({"check", out}).exit_code, 0) << kind;
  }
  expect_error({"pattern", "interleaved", "--subperiods-ns", "180", "--output", out}, 2,
               HasSubstr("two"));
}

TEST_F(CommandLine, PatternsHaveTheSetUpAsDefaultAndTellTheirSideLobes) {
  const std::string out = folder.path("p.json");
  const ProgramResult random = run_program({"pattern", "random", "--output", out});
  EXPECT_THAT(random.err,
              AllOf(HasSubstr("random, 40 pulses in 3780 ns"),
                    HasSubstr("highest side lobe of its autocorrelation: 3 of 40 pulses (7.5 %) "
                              "within 200 ps at a shift of ")));
  EXPECT_THAT(run_program({"pattern", "periodic", "--output", out}).err,
              AllOf(HasSubstr("baseline, 1 pulses in 3780 ns"), Not(HasSubstr("side lobe"))));
  EXPECT_THAT(
      run_program({"pattern", "interleaved", "--subperiods-ns", "180", "189", "--output", out}).err,
      HasSubstr("21 of 40 pulses (52.5 %) within 200 ps at a shift of 180 ns"));
}

}  // namespace
}  // namespace splid
