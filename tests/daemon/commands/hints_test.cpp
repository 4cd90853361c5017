#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/light_scene.hpp"
#include "tests/support/program.hpp"

// What people try that is nearly right, in the built program: it is taken, or the error says how it
// is written.

namespace splid {
namespace {

using splid::test::file_text;
using splid::test::ProgramResult;
using splid::test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class Hints : public ::testing::Test {
 protected:
  Hints() {
    run_program({"pattern", "periodic", "--output", folder.path("pattern.json")});
    config = folder.write("config.json",
                          R"({"schema":"splid.config","source":{"driver":"simulator"},)"
                          R"("pattern":{"file":"pattern.json"},"publish":{"endpoint":"ipc://)" +
                              folder.path("s") + "\"}" + test::small_ring + "}");
  }

  static void expect_error(const std::vector<std::string>& arguments,
                           const ::testing::Matcher<std::string>& words) {
    const ProgramResult result = run_program(arguments);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_THAT(result.err, words);
    EXPECT_THAT(result.out, IsEmpty());
  }

  splid::test::TempFolder folder;
  std::string config;
};

TEST_F(Hints, AConfigurationWithoutItsSchema) {
  const std::string file = folder.write(
      "a.json",
      R"({"scene":{"max_speed_mps":5},"source":{"driver":"simulator"},"pattern":{"file":"p"}})");
  expect_error({"check", file}, AllOf(HasSubstr("/schema: is missing and has no default; add "
                                                "\"schema\":\"splid.config\""),
                                      Not(HasSubstr("did you mean"))));
  const std::string slip =
      folder.write("b.json", R"({"shema":"splid.config","source":{"driver":"simulator"}})");
  expect_error({"check", slip}, HasSubstr("\"shema\" is an unknown key: did you mean "
                                          "schema?"));
}

TEST_F(Hints, AnInstrumentInThePlaceOfAFile) {
  for (const char* name : {"001:002", "unix:/nowhere/bridge.sock", "tcp:10.0.0.6:9880", "tdc2"}) {
    expect_error({"check", name}, HasSubstr(std::string(name) +
                                            ": there is no file of that name; check takes files; "
                                            "an instrument is tried by splid devices --try "));
  }
  expect_error({"check", "/nowhere/splid.json"},
               AllOf(HasSubstr("No such file"), Not(HasSubstr("--try"))));
}

TEST_F(Hints, OptionsBeforeTheCommand) {
  expect_error({"--config", config, "replay", "a.ptu"},
               HasSubstr("options stand behind the command; write splid replay --config ..."));
  expect_error({"-c", config, "run"}, HasSubstr("write splid run -c ..."));
  expect_error({"--config", config}, HasSubstr("--config"));
  EXPECT_EQ(run_program({"--help"}).exit_code, 0);
}

TEST_F(Hints, APageAtAnAddressThatIsNone) {
  expect_error({"view", "--http", "lab"},
               HasSubstr("--http lab: has no port; write it as in 127.0.0.1:9874"));
  expect_error({"view", "--http", "http://127.0.0.1:9874/"},
               HasSubstr("is a URL; write the address and the port alone, as in 127.0.0.1:9874"));
}

TEST_F(Hints, ListsHaveCommasOrBlanks) {
  for (const char* kind : {"interleaved", "mrr"}) {
    const std::string option = kind == std::string("mrr") ? "--periods-ns" : "--subperiods-ns";
    std::vector<std::string> commas = {"pattern", kind,       option,
                                       "180,189", "--output", folder.path("commas.json")};
    std::vector<std::string> blanks = {
        "pattern", kind, option, "180", "189", "--output", folder.path("blanks.json")};
    if (kind == std::string("mrr")) {
      commas.insert(commas.end(), {"--repeats", "21,20"});
      blanks.insert(blanks.end(), {"--repeats", "21", "20"});
    }
    EXPECT_EQ(run_program(commas).exit_code, 0) << run_program(commas).err;
    EXPECT_EQ(run_program(blanks).exit_code, 0) << run_program(blanks).err;
    EXPECT_EQ(file_text(folder.path("commas.json")), file_text(folder.path("blanks.json")));
  }
  for (const std::vector<std::string>& lengths : {std::vector<std::string>{"5,10"}, {"5", "10"}}) {
    std::vector<std::string> words = {"tradeoff", "--config", config,   "--frames",
                                      "10",       "--json",   "--plot", folder.path("t.svg"),
                                      "--lengths"};
    words.insert(words.end(), lengths.begin(), lengths.end());
    const ProgramResult result = run_program(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, AllOf(HasSubstr("\"length_ms\":5,"), HasSubstr("\"length_ms\":10,")));
  }
}

// What a file is, the module says; without it, how to get the picture.
TEST_F(Hints, APlotOfWhatIsNoneSaysSo) {
  const std::string text = folder.write("a.dat", "hello");
  const ProgramResult result = run_program({"plot", text, "--output", folder.path("a.png")});
  EXPECT_NE(result.exit_code, 0);
  EXPECT_THAT(result.err, AllOf(HasSubstr("splid: error: "), HasSubstr("a.dat")));
  EXPECT_FALSE(std::filesystem::exists(folder.path("a.png")));
  const ProgramResult missing = run_program({"plot", folder.path("none.csv")});
  EXPECT_EQ(missing.exit_code, 4) << missing.err;
  EXPECT_THAT(missing.err, HasSubstr("none.csv: No such file"));
}

TEST_F(Hints, ConvertTakesItsOutputAsAnOptionToo) {
  const std::string recording = folder.path("a.ptu");
  run_program({"simulate", "--config", config, "--seconds", "0.1", "--output", recording});
  for (const char* option : {"-o", "--output"}) {
    const std::string output = folder.path(std::string("b") + option + ".ptu");
    const ProgramResult result = run_program({"convert", recording, option, output});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(std::filesystem::exists(output));
  }
  expect_error({"convert", recording}, HasSubstr("output"));
}

TEST_F(Hints, CheckTakesSeveralFilesAndSaysWhichAreWrong) {
  const std::string pattern = folder.path("pattern.json");
  const std::string wrong = folder.write("wrong.json", "{}");
  const ProgramResult good = run_program({"check", config, pattern});
  EXPECT_EQ(good.exit_code, 0) << good.err;
  EXPECT_THAT(good.out,
              AllOf(HasSubstr(config + ": a configuration"), HasSubstr(pattern + ": a pattern")));
  const ProgramResult mixed =
      run_program({"check", wrong, folder.write("a.dat", "hello"), pattern});
  EXPECT_EQ(mixed.exit_code, 2) << mixed.err;
  EXPECT_THAT(mixed.out, HasSubstr(pattern + ": a pattern"));
  EXPECT_THAT(mixed.err, AllOf(HasSubstr("splid: error: " + wrong), HasSubstr("a.dat")));
}

TEST_F(Hints, AWidthInAnotherUnit) {
  const auto with_sigma = [&](const std::string& sigma) {
    std::string text = file_text(config);
    text.insert(text.find("\"pattern\""), R"("pulse":{"sigma_ps":)" + sigma + "},");
    return folder.write("width.json", text);
  };
  expect_error({"check", with_sigma("0.1")},
               HasSubstr("/pulse/sigma_ps: 0.1 is below 1 ps, the least allowed"));
  run_program(
      {"pattern", "periodic", "--period-ns", "12", "--output", folder.path("pattern.json")});
  expect_error({"check", with_sigma("12500")},
               AllOf(HasSubstr("/pulse/sigma_ps: 12500 is above 12000 ps, the mean spacing"),
                     HasSubstr("pattern.json")));
}

// The tagger's step alone spreads a pulse.
TEST_F(Hints, AWidthBelowTheRecordingsStep) {
  const std::string recording = folder.path("a.ptu");
  run_program({"simulate", "--config", config, "--seconds", "0.1", "--output", recording});
  std::string bytes = file_text(recording);
  // Its value follows a name of 32 bytes, an index and a type.
  const double step_s = 400e-12;
  const auto value = bytes.find("MeasDesc_GlobalResolution") + 40;
  bytes.replace(value, sizeof step_s, reinterpret_cast<const char*>(&step_s), sizeof step_s);
  const std::string coarse = folder.write("coarse.ptu", bytes);
  const auto words = HasSubstr(config +
                               ": /pulse/sigma_ps: 100 is below 116 ps, by which the "
                               "recording's steps of 400 ps alone spread a pulse");
  expect_error({"replay", coarse, "--config", config, "--no-publish"}, words);
  expect_error({"calibrate", coarse, "--config", config, "--output", folder.path("f.json")}, words);
}

}  // namespace
}  // namespace splid
