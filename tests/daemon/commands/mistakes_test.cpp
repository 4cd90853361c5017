#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdint>
#include <filesystem>

#include "tests/support/light_scene.hpp"
#include "tests/support/program.hpp"

// Mistakes that people make, in the built program: each is told with what was given, what was
// expected, where it came from and what to do; and what would be as wrong at the next start ends
// with 2, in `run` and in `check` alike.

namespace splid {
namespace {

using splid::test::file_text;
using splid::test::ProgramResult;
using splid::test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class Mistakes : public ::testing::Test {
 protected:
  Mistakes() {
    run_program({"pattern", "periodic", "--output", folder.path("pattern.json")});
    config = write_config("config.json", "");
  }

  // more: members beside those that every configuration here has.
  std::string write_config(const std::string& name, const std::string& more,
                           const std::string& source = R"("driver":"simulator")",
                           const std::string& pattern = "pattern.json") const {
    const std::string publish =
        more.find("\"publish\"") != std::string::npos
            ? ""
            : R"(,"publish":{"endpoint":"ipc://)" + folder.path("s") + "\"}";
    const char* ring = more.find("\"pipeline\"") == more.npos ? test::small_ring : "";
    return folder.write(name, R"({"schema":"splid.config","v":[1,0],"source":{)" + source +
                                  R"(},"pattern":{"file":")" + pattern + "\"}" + publish + ring +
                                  more + "}");
  }

  static void expect_error(const std::vector<std::string>& arguments, int exit_code,
                           const ::testing::Matcher<std::string>& words) {
    const ProgramResult result = run_program(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_THAT(result.err, words);
    EXPECT_THAT(result.err, AllOf(HasSubstr("splid: error: "), Not(HasSubstr("000000000"))));
    EXPECT_THAT(result.out, IsEmpty());
  }

  // At every start, and told beforehand.
  static void expect_lasting(const std::string& file, const ::testing::Matcher<std::string>& words,
                             int exit_code = 2) {
    expect_error({"run", "--config", file}, exit_code, words);
    expect_error({"check", file}, exit_code, words);
  }

  test::TempFolder folder;
  std::string config;
};

// What never ends is not read: /dev/zero took memory until there was none, a pipe waited.
TEST_F(Mistakes, FilesThatAreNoRegularFilesAreRefused) {
  ASSERT_EQ(::mkfifo(folder.path("pipe").c_str(), 0600), 0);
  const auto refusal = [](const std::string& file) {
    return HasSubstr(file + ": is no file but a folder, a device, a pipe or a socket");
  };
  for (const std::string& file : {std::string("/dev/zero"), folder.path("pipe")}) {
    expect_lasting(write_config("c.json", "", R"("driver":"simulator")", file), refusal(file));
    expect_lasting(write_config("c.json", R"(,"encoder":{"file":")" + file +
                                              R"("},"channels":{"encoder":"marker:1"})"),
                   refusal(file));
    expect_error({"run", "--config", file}, 2, refusal(file));
    expect_error({"listen", "--key", file, "--server-key", file}, 2, refusal(file));
    expect_error({"listen", "--truth", file}, 2, refusal(file));
  }
}

TEST_F(Mistakes, NumbersWithUnitsOrSigns) {
  expect_error({"simulate", "--config", config, "--seconds", "10s", "--output", "x.ptu"}, 2,
               AllOf(HasSubstr("--seconds"), HasSubstr("\"10s\" must be a number above 0")));
  expect_error({"listen", "--timeout", "0"}, 2, HasSubstr("\"0\" must be a number above 0"));
  expect_error({"listen", "--count", "-1"}, 2, HasSubstr("\"-1\" must be a whole number"));
  expect_error({"listen", "--count", "0", "--timeout", "1"}, 2,
               HasSubstr("\"0\" must be a whole number above 0"));
  expect_error({"replay", "a.ptu", "--config", config, "--wait-for-subscriber", "10s"}, 2,
               AllOf(HasSubstr("--wait-for-subscriber"), HasSubstr("must be a number from 0 to")));
  expect_error({"tradeoff", "--config", config, "--budget-ms", "10ms"}, 2,
               AllOf(HasSubstr("--budget-ms"), HasSubstr("must be a number above 0")));
  expect_error({"tradeoff", "--config", config, "--seed", "-1"}, 2,
               AllOf(HasSubstr("--seed"), HasSubstr("\"-1\" must be a whole number")));
  expect_error({"tradeoff", "--config", config, "--lengths", "10,20ms"}, 2,
               AllOf(HasSubstr("--lengths"), HasSubstr("must be a number from 0.1 to 60000")));
  expect_error({"tradeoff", "--config", config, "--frames", "5"}, 2,
               AllOf(HasSubstr("--frames"), HasSubstr("must be a whole number from 10 to 1")));
  expect_error({"simulate", "--config", config, "--seconds", "1e300", "--output", "x.ptu"}, 2,
               HasSubstr("must be a number above 0 and at most 4000000"));
  expect_error({"pattern", "random", "--pulses", "2.5", "--output", folder.path("p")}, 2,
               HasSubstr("\"2.5\" must be a whole number"));
  expect_error({"pattern", "periodic", "--period-ns", "4us", "--output", folder.path("p")}, 2,
               HasSubstr("--period-ns = 4us is not a number"));
}

TEST_F(Mistakes, OptionsWithASlip) {
  expect_error({"run", "--confg", config}, 2,
               HasSubstr("no option --confg; did you mean --config? (splid run --help"));
  expect_error({"run", "--confg=" + config}, 2, HasSubstr("did you mean --config?"));
  expect_error({"run", "-x", config}, 2, HasSubstr("no option -x (splid run --help"));
  expect_error({"ctl", "status", "--jsn"}, 2, HasSubstr("did you mean --json?"));
  expect_error({"replay", "a.ptu", "--config"}, 2, HasSubstr("--config: its value is missing"));
  expect_error({"devices", "extra"}, 2,
               AllOf(HasSubstr("extra"), HasSubstr("splid devices --help")));
}

TEST_F(Mistakes, KeysWithASlip) {
  const std::string slip =
      folder.write("slip.json", R"({"schema":"splid.config","source":{"driver":"simulator"},)"
                                R"("patern":{"file":"pattern.json"}})");
  expect_lasting(
      slip, AllOf(HasSubstr("/pattern: is missing"), HasSubstr("\"patern\" is an unknown key")));
}

// What only the estimator knows is told as early, with the same words at the same place, and by a
// replay too.
TEST_F(Mistakes, OptionsThatTheEstimatorRefuses) {
  const std::string recording = folder.path("a.ptu");
  run_program({"simulate", "--config", config, "--seconds", "0.1", "--output", recording});
  const auto expect_refused = [&](const std::string& more, const std::string& words) {
    const std::string file = write_config("refused.json", more);
    expect_lasting(file, HasSubstr(file + ": " + words));
    expect_error({"replay", recording, "--config", file}, 2, HasSubstr(file + ": " + words));
  };
  const std::string paper = R"(,"estimator":{"method":"paper"},"scene":)";
  expect_refused(paper + R"({"motion":"accelerating"})",
                 "/estimator/method: is \"paper\", but scene.motion is \"accelerating\"");
  expect_refused(paper + R"({"targets":2})",
                 "/estimator/method: is \"paper\", but scene.targets is 2");
  expect_refused(R"(,"frame":{"length_ms":3500},"scene":{"motion":"accelerating",)"
                 R"("max_acceleration_mps2":1000})",
                 "/scene/max_acceleration_mps2: with 1000 a frame of ");
  EXPECT_EQ(
      run_program({"check", write_config("auto.json", paper + R"({"motion":"auto"})")}).exit_code,
      0);
}

TEST_F(Mistakes, FilesOfAnotherKind) {
  const std::string recording = folder.path("a.ptu");
  run_program({"simulate", "--config", config, "--seconds", "0.1", "--output", recording});
  const std::string gzip = folder.write("b.json.gz", std::string("\x1f\x8b\x08\0\0", 5));
  const std::string pattern = folder.path("pattern.json");
  expect_error({"run", "--config", recording}, 2,
               HasSubstr("is a PTU recording, but a configuration is expected"));
  expect_error({"run", "--config", pattern}, 2,
               AllOf(HasSubstr("is a splid pattern"), HasSubstr("/pattern/file")));
  expect_error({"run", "--config", gzip}, 2, HasSubstr("gunzip"));
  expect_error({"run", "--config", folder.write("empty.json", "")}, 2, HasSubstr("is empty"));
  expect_error({"replay", config, "--config", config}, 4,
               HasSubstr("is a splid configuration, but a recording is expected"));
  expect_error({"replay", gzip, "--config", config}, 4, HasSubstr("gunzip"));
  expect_error({"check", gzip}, 4, HasSubstr("gunzip"));
  expect_error({"check", folder.write("a.spc", "1234")}, 4, HasSubstr("Becker & Hickl"));
  expect_error({"check", folder.write("a.jpg", "\xff\xd8\xff\xe0")}, 4,
               HasSubstr("a picture (JPEG)"));
  expect_error({"check", folder.write("b.ptu", "")}, 4, HasSubstr("b.ptu: is empty"));
  expect_error({"check", folder.write("b.spc", "")}, 4, HasSubstr("b.spc: is empty"));
  expect_error({"check", folder.write("a.dat", "hello")}, 4,
               AllOf(HasSubstr("splid reads PTU"), HasSubstr("docs/guide/recording.md")));
  expect_error({"check", folder.path("")}, 2, AllOf(HasSubstr("is a folder"), HasSubstr("batch")));
  expect_error({"listen", "--truth", config}, 4, HasSubstr("--truth: "));
  expect_error({"listen", "--key", folder.path("none"), "--server-key", "x"}, 2,
               AllOf(HasSubstr("--key: "), HasSubstr("No such file")));
}

// A sparse file takes no room. To read it whole would take a minute, and as much memory as it is
// long; the program is killed once it has worked for 5 s.
TEST_F(Mistakes, LongFilesOfAnUnknownKind) {
  const std::string unknown = folder.write("tags.dat", std::string("\x01\x02\x03", 3));
  std::filesystem::resize_file(unknown, std::uintmax_t{64} << 30U);
  test::Program shell({"-c", "ulimit -t 5; exec '" SPLID_BINARY "' check '" + unknown + "'"},
                      "/bin/sh");
  const ProgramResult result = shell.wait();
  EXPECT_EQ(result.exit_code, 4) << result.err;
  EXPECT_THAT(result.err, HasSubstr("is neither a configuration or pattern"));
}

TEST_F(Mistakes, PatternsThatAreNoneAreTheConfigurations) {
  const auto with = [&](const std::string& pattern) {
    return write_config("c.json", "", R"("driver":"simulator")", pattern);
  };
  folder.write("broken.json", R"({"schema":"splid.pattern","v":[1,0])");
  expect_lasting(with("broken.json"),
                 AllOf(HasSubstr("/pattern/file: "), HasSubstr("broken.json")));
  expect_lasting(with("config.json"),
                 AllOf(HasSubstr("/pattern/file: "), HasSubstr("is a splid configuration")));
  expect_lasting(with("none.json"), AllOf(HasSubstr("/pattern/file: "), HasSubstr("none.json")));
}

TEST_F(Mistakes, EndpointsThatCannotBeBound) {
  const auto publish = [&](const std::string& endpoint) {
    return write_config("c.json",
                        R"(,"publish":{"endpoint":")" + endpoint +
                            R"("},"security":{"unprotected":"anyone on the network may read"})");
  };
  expect_lasting(publish("tcp://lidar.example.org:9872"), HasSubstr("names of hosts"));
  expect_lasting(publish("ipc://" + folder.path("none/socket")),
                 AllOf(HasSubstr("/publish/endpoint"), HasSubstr("No such file")));
  // These may be there in ten seconds.
  expect_lasting(publish("tcp://nonic7:9872"), HasSubstr("no interface of this machine"), 3);
  expect_lasting(publish("tcp://192.0.2.1:9872"), HasSubstr("no address of this machine"), 3);
  expect_lasting(
      write_config("d.json", "", R"("driver":"bridge","address":"tcp://127.0.0.1:9880")"),
      AllOf(HasSubstr("/source/address"), HasSubstr("write tcp:127.0.0.1:9880")));
  expect_lasting(write_config("e.json", R"(,"control":{"endpoint":"ipc://)" +
                                            folder.path("none/control") + "\"}"),
                 HasSubstr("/control/endpoint"));
}

// The second socket of one place could be bound at no start.
TEST_F(Mistakes, PlacesThatAreGivenToTwoSockets) {
  const std::string file = folder.path("s");
  const auto places = [&](const std::string& publish, const std::string& more) {
    return write_config("c.json", R"(,"publish":{"endpoint":")" + publish + "\"" + more);
  };
  const auto both = [](const char* first, const char* second) {
    return AllOf(HasSubstr(first), HasSubstr(second), HasSubstr("listens too"));
  };
  expect_lasting(places("ipc://" + file, R"(},"control":{"endpoint":"ipc://)" + file + "\"}"),
                 both("/control/endpoint", "/publish/endpoint"));
  expect_lasting(
      places("ipc://" + file, R"(,"local_endpoint":"ipc://)" + folder.path("./s") + "\"}"),
      both("/publish/local_endpoint", "/publish/endpoint"));
  expect_lasting(places("tcp://127.0.0.1:9899", R"(},"metrics":{"http":"localhost:9899"})"),
                 both("/metrics/http", "/publish/endpoint"));
  expect_lasting(places("tcp://*:9899", R"(,"local_endpoint":"tcp://127.0.0.1:9899"},)"
                                        R"("security":{"unprotected":)"
                                        R"("anyone on the network may read"})"),
                 both("/publish/local_endpoint", "/publish/endpoint"));
  expect_lasting(places("ipc://" + config, "}"),
                 AllOf(HasSubstr("/publish/endpoint"), HasSubstr("is no socket")));
}

// Nothing is written over what is read.
TEST_F(Mistakes, PlacesThatAreReadAndWritten) {
  const std::string pattern = folder.path("pattern.json");
  const std::string before = file_text(pattern);
  const std::string scene = R"("driver":"simulator","pace":"max","seconds":0.1)";
  expect_lasting(write_config("c.json", "", scene + R"(,"truth":"./pattern.json")"),
                 AllOf(HasSubstr("/source/truth"), HasSubstr("/pattern/file")));
  expect_lasting(write_config("d.json", R"(,"metrics":{"file":"d.json"})", scene),
                 AllOf(HasSubstr("/metrics/file"), HasSubstr("the configuration itself")));
  EXPECT_EQ(file_text(pattern), before);
}

TEST_F(Mistakes, LocalhostIsThisMachine) {
  const std::string file = write_config("c.json", R"(,"publish":{"endpoint":"tcp://localhost:*"})",
                                        R"("driver":"simulator","pace":"max","seconds":0.2)");
  const ProgramResult result = run_program({"run", "--config", file});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("publishing at tcp://127.0.0.1:"));
}

TEST_F(Mistakes, FilesThatAConfigurationNames) {
  const auto replay = [&](const std::string& recording) {
    return write_config("c.json", "", R"("driver":"replay","recording":")" + recording + "\"");
  };
  expect_lasting(replay("none.ptu"), AllOf(HasSubstr("/source/recording"), HasSubstr("none.ptu")));
  expect_lasting(replay("config.json"),
                 AllOf(HasSubstr("/source/recording"), HasSubstr("is a splid configuration")));
  expect_lasting(write_config("d.json", R"(,"encoder":{"file":"none.csv"},)"
                                        R"("channels":{"encoder":"marker:1"})"),
                 AllOf(HasSubstr("/encoder/file"), HasSubstr("none.csv")));
  expect_lasting(write_config("e.json", R"(,"security":{"server_key":"none.key_secret",)"
                                        R"("allow_list":"none.keys"})"),
                 AllOf(HasSubstr("/security/allow_list"), HasSubstr("none.keys")));
  expect_lasting(write_config("f.json", "", R"("driver":"simulator","truth":"none/truth.json")"),
                 HasSubstr("/source/truth"));
}

TEST_F(Mistakes, FramesAndMemoryThatDoNotFit) {
  expect_lasting(write_config("c.json", R"(,"pipeline":{"ring_capacity_tags":5000})"),
                 AllOf(HasSubstr("c.json: "), HasSubstr("/frame/length_ms")));
  expect_lasting(write_config("d.json", R"(,"pipeline":{"ring_capacity_tags":268435456,)"
                                        R"("estimation_threads":64})"),
                 AllOf(HasSubstr("/pipeline"), HasSubstr("MiB, and this machine has")));
}

TEST_F(Mistakes, MoreInputsThanARecordingHolds) {
  std::string pixels;
  for (int i = 1; i <= 65; ++i) {
    pixels += (i == 1 ? "" : ",") + std::string("{\"input\":") + std::to_string(i) + "}";
  }
  expect_lasting(
      write_config("c.json", R"(,"record":{"folder":"r"},"pixels":[)" + pixels + "]"),
      AllOf(HasSubstr("c.json: /record/folder: /pixels: input 65 is one more than the 64 that"),
            HasSubstr("do not record")));
}

TEST_F(Mistakes, CheckWarnsOfWhatRunWouldBeginWithout) {
  const ProgramResult result =
      run_program({"check", write_config("c.json", R"(,"metrics":{"file":"none/x.prom"},)"
                                                   R"("record":{"folder":")" +
                                                       config + "/tags\"}")});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, AllOf(HasSubstr("/metrics/file"), HasSubstr("/record/folder")));
  const ProgramResult of_folder = run_program(
      {"check", write_config("d.json", R"(,"metrics":{"file":")" + folder.path("") + "\"}")});
  EXPECT_EQ(of_folder.exit_code, 0) << of_folder.err;
  EXPECT_THAT(of_folder.err, AllOf(HasSubstr("/metrics/file"), HasSubstr("is a folder")));
}

// A folder that this user may not look into, and a link to itself, which root cannot follow either.
TEST_F(Mistakes, APlaceThatCannotBeLookedAtIsNamed) {
  const std::string loop = folder.path("loop");
  std::filesystem::create_symlink("loop", loop);
  const ProgramResult result = run_program(
      {"check", write_config("c.json", R"(,"metrics":{"file":"loop/x.prom"},"record":{"folder":")" +
                                           loop + "/tags\"}")});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const std::string unknown = loop + " cannot be looked at: Too many levels of symbolic links";
  EXPECT_THAT(result.err, AllOf(HasSubstr("/metrics/file: " + unknown),
                                HasSubstr("/record/folder: " + loop + "/tags cannot be looked")));
  const std::string output = loop + "/a.ptu";
  expect_error({"simulate", "--config", config, "--seconds", "0.1", "--output", output}, 3,
               HasSubstr(loop + "/a.truth.json: cannot be written: Too many levels of symbolic "
                                "links; name another file"));
}

TEST_F(Mistakes, CheckTakesAByteOrderMarkAsRunDoes) {
  const ProgramResult result =
      run_program({"check", folder.write("marked.json", "\xef\xbb\xbf" + file_text(config))});
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

TEST_F(Mistakes, AFullOutputIsToldByItsExitCode) {
  const std::string full = "exec '" SPLID_BINARY "' check '" + config + "' > /dev/full";
  test::Program shell({"-c", full}, "/bin/sh");
  const ProgramResult result = shell.wait();
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("standard output: No space left on device"));
}

// As head does. What comes after it has many causes to set errno.
TEST_F(Mistakes, AReaderThatLeavesIsNone) {
  const std::string recording = folder.path("a.ptu");
  run_program({"simulate", "--config", config, "--seconds", "2", "--output", recording});
  test::Program shell({"-c", "{ '" SPLID_BINARY "' replay '" + recording + "' --config '" + config +
                                 "' --json --no-publish; echo exit $? >&2; } | head -n 1"},
                      "/bin/sh");
  const ProgramResult result = shell.wait();
  EXPECT_THAT(result.err, AllOf(HasSubstr("exit 0"), Not(HasSubstr("standard output"))));
}

}  // namespace
}  // namespace splid
