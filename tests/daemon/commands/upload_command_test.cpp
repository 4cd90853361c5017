#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "protocol/pattern_json.hpp"
#include "tests/support/awg_double.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/program.hpp"

// The built program and a generator on a port of this machine.

namespace splid {
namespace {

using test::AwgDouble;
using test::AwgFaults;
using test::ProgramResult;
using test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

bool has_begun_to_send(const std::vector<std::string>& heard) {
  return std::any_of(heard.begin(), heard.end(),
                     [](const std::string& line) { return line.starts_with(":TRAC1:DATA"); });
}

class UploadCommand : public ::testing::Test {
 protected:
  std::string write_config(const std::string& awg, const std::string& pattern) {
    run_program({"pattern", pattern, "--subperiods-ns", "180", "189", "--output",
                 folder.path("pattern.json")});
    return folder.write("config.json",
                        R"({"schema":"splid.config","source":{"driver":"simulator"},)"
                        R"("pattern":{"file":"pattern.json"},"awg":{)" +
                            awg + "}}");
  }
  std::string config_for(const AwgDouble& awg, const std::string& more = "") {
    return write_config(R"("address":")" + awg.address() + "\"" + more, "interleaved");
  }

  test::TempFolder folder;
};

TEST_F(UploadCommand, PlaysThePatternAndWritesWhatIsPlayed) {
  AwgDouble awg;
  const std::string config = config_for(awg);
  const std::string output = folder.path("played.json");
  const ProgramResult result = run_program({"upload", "--config", config, "--output", output});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, IsEmpty());
  EXPECT_THAT(result.err,
              AllOf(HasSubstr("for m8195a: 241920 samples at 64 GSa/s"),
                    HasSubstr("Keysight Technologies M8195A DE00000001, firmware 4.0.0.0-1: plays "
                              "interleaved, 40 pulses in 3780 ns"),
                    HasSubstr("its error queue is empty"), HasSubstr("played.json: ")));
  EXPECT_EQ(awg.errors(), 0U);
  const AwgDouble::Played played = awg.played(0);
  const Pattern pattern = pattern_from_json(test::file_text(output), output);
  ASSERT_EQ(played.pulses_ps.size(), 40U);
  for (std::size_t i = 0; i < 40; ++i) {
    EXPECT_NEAR(pattern.segments[0].pulse_times_ps[i], played.pulses_ps[i], 1e-3);
  }

  const ProgramResult again = run_program({"upload", "--config", config, "--output", output});
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("played.json: exists; --force overwrites it"));
  EXPECT_EQ(run_program({"upload", "--config", config, "--output", output, "--force"}).exit_code,
            0);

  const ProgramResult stopped = run_program({"upload", "--config", config, "--stop"});
  EXPECT_EQ(stopped.exit_code, 0) << stopped.err;
  EXPECT_THAT(stopped.err, HasSubstr("plays nothing, its output is off"));
  EXPECT_FALSE(awg.playing());
}

TEST_F(UploadCommand, ADryRunConnectsToNothing) {
  const std::string output = folder.path("played.json");
  const std::string config = write_config(R"("model":"m8190a")", "interleaved");
  const ProgramResult result =
      run_program({"upload", "--config", config, "--dry-run", "--output", output});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("for m8190a: 30240 samples at 8 GSa/s"));
  EXPECT_TRUE(std::filesystem::exists(output));
}

// A result that has nowhere to go is told before the laser fires.
TEST_F(UploadCommand, LooksWhetherItsResultHasAPlaceFirst) {
  AwgDouble awg;
  const ProgramResult result = run_program(
      {"upload", "--config", config_for(awg), "--output", folder.path("none/played.json")});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, AllOf(HasSubstr("played.json: there is no folder"), HasSubstr("none")));
  EXPECT_THAT(awg.heard(), ::testing::IsEmpty());
}

TEST_F(UploadCommand, FaultsHaveTheirExitCodes) {
  AwgFaults faults;
  faults.error_at = ":INIT:IMM";
  AwgDouble awg(AwgDouble::Model::m8195a, faults);
  ProgramResult result = run_program({"upload", "--config", config_for(awg)});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err,
              AllOf(HasSubstr("error: awg tcp:127.0.0.1:"), HasSubstr(":INIT:IMM: -241, ")));

  result = run_program({"upload", "--config", config_for(awg, R"(,"pulse_v":-3)")});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("/awg/pulse_v: the step from rest_v is 3 V; it must be from"));

  result = run_program({"upload", "--config", config_for(awg, R"(,"min_spacing_ns":10)")});
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("pulse 1 at 180 ns and pulse 2 at 189 ns are 9 ns apart"));

  result = run_program({"upload", "--config", write_config("", "interleaved")});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("awg/address: is missing"));
}

TEST_F(UploadCommand, EndsOnASignalWhileTheGeneratorIsSilent) {
  AwgFaults faults;
  faults.silent_at = ":TRAC1:DATA";
  AwgDouble awg(AwgDouble::Model::m8195a, faults);
  test::Program program({"upload", "--config", config_for(awg)});
  ASSERT_TRUE(test::eventually([&] { return has_begun_to_send(awg.heard()); }));
  program.signal(SIGINT);
  const ProgramResult result = program.wait();
  EXPECT_EQ(result.exit_code, 2) << result.err;
  EXPECT_THAT(result.err, AllOf(HasSubstr(": stopped; upload again"),
                                HasSubstr("whether its outputs are off is not known")));
}

}  // namespace
}  // namespace splid
