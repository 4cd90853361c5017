#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "protocol/json_value.hpp"
#include "tests/support/light_scene.hpp"
#include "tests/support/patience.hpp"
#include "tests/support/program.hpp"
#include "tests/support/python_program.hpp"
#include "tests/support/read_back.hpp"
#include "tests/support/sanitized.hpp"
#include "tests/support/small_disk.hpp"

// The tables of frames that the built program writes, as h5py reads them.

namespace splid::recording {
namespace {

using nlohmann::json;
using test::file_text;
using test::Program;
using test::ProgramResult;
using test::run_program;
using ::testing::HasSubstr;

const std::string golden = SPLID_SOURCE_DIR "/tests/data/golden/interleaved";

std::vector<std::string> table_lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::string read_table(const std::string& what, const std::vector<std::string>& files) {
  std::vector<std::string> arguments = {what};
  arguments.insert(arguments.end(), files.begin(), files.end());
  const ProgramResult read = test::python("tests/support/python/read_table.py", arguments).wait();
  EXPECT_EQ(read.exit_code, 0) << read.err;
  return read.out;
}

// A message's members by their columns' names.
std::map<std::string, json> members_of(const json& message, const std::string& before = "") {
  std::map<std::string, json> members;
  for (const auto& [name, value] : message.items()) {
    if (name == "schema" || name == "v") continue;
    if (value.is_object()) {
      members.merge(members_of(value, before + name + "_"));
    } else {
      members[before + name] = value;
    }
  }
  return members;
}

// The value of a row, which is absent where the message has none.
void expect_same_value(const std::string& name, const json& value,
                       const std::map<std::string, json>& in) {
  const auto member = in.find(name);
  if (name == "uncounted_losses" && value == 0) return;
  if (name == "start_ps") {
    EXPECT_EQ(std::to_string(value.get<std::int64_t>()), member->second.get<std::string>()) << name;
  } else if (member != in.end()) {
    EXPECT_EQ(value, member->second) << name;
  } else {
    const bool is_none = value == "" || value == -1 || value.is_null();
    EXPECT_TRUE(is_none) << name << " is " << value << " and no member of the message";
  }
}

class TablesProgram : public ::testing::Test {
 protected:
  [[nodiscard]] ProgramResult replay(const std::vector<std::string>& more) const {
    std::vector<std::string> all = {"replay", golden + ".ptu", "--config", golden + ".json",
                                    "--no-publish"};
    all.insert(all.end(), more.begin(), more.end());
    return run_program(all);
  }
  // The pattern's syncs and 60,000 photons a second.
  [[nodiscard]] std::string config(const std::string& record, const std::string& source,
                                   const std::string& more = "") const {
    return folder.write(
        "config.json",
        R"({"schema":"splid.config","v":[1,0],"source":{"driver":"simulator",)" + source +
            R"(},"pattern":{"file":")" SPLID_SOURCE_DIR
            R"(/config/patterns/interleaved-180-189.json"},"record":{)" +
            record + R"(},"control":{"endpoint":"off"},"publish":{"endpoint":"ipc://)" +
            folder.path("frames") + "\"}" + more + test::with_light_scene(test::small_ring) + "}");
  }
  test::TempFolder folder;
};

TEST_F(TablesProgram, EachValueOfAReplayIsThatOfItsJson) {
  const std::string table = folder.path("a.h5");
  const ProgramResult result = replay({"--json", "--output", table});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("7 frames in " + table));
  const std::vector<std::string> messages = table_lines(result.out);
  const std::vector<std::string> rows = table_lines(read_table("frames", {table}));
  ASSERT_EQ(rows.size(), messages.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto members = members_of(json_value(messages[i]));
    const json row = json_value(rows[i]);
    for (const auto& [name, value] : row.items()) expect_same_value(name, value, members);
    for (const auto& [name, value] : members) EXPECT_TRUE(row.contains(name)) << name;
  }
}

TEST_F(TablesProgram, TextHasTheDigitsOfTheJson) {
  const std::string table = folder.path("a.csv");
  const ProgramResult result = replay({"--json", "--output", table});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::vector<std::string> messages = table_lines(result.out);
  const std::vector<std::string> rows = table_lines(file_text(table));
  ASSERT_EQ(rows.size(), messages.size() + 1);
  std::vector<std::string> names;
  std::istringstream head(rows[0]);
  for (std::string name; std::getline(head, name, ',');) names.push_back(name);
  for (std::size_t i = 0; i < messages.size(); ++i) {
    std::istringstream row(rows[i + 1] + ",");
    std::string value;
    for (const std::string& name : names) {
      ASSERT_TRUE(std::getline(row, value, ',')) << name;
      if (value.empty() || name == "uncounted_losses") continue;
      const std::size_t nested = name.find('_');
      const std::string inner = "\"" + name.substr(nested + 1) + "\":" + value;
      const std::string whole = "\"" + name + "\":" + value;
      const std::string quoted = "\"" + name + "\":\"" + value + "\"";
      EXPECT_THAT(messages[i],
                  ::testing::AnyOf(HasSubstr(whole), HasSubstr(quoted), HasSubstr(inner)));
    }
  }
}

TEST_F(TablesProgram, FactsStandBesideTheFrames) {
  ASSERT_EQ(replay({"--output", folder.path("a.h5")}).exit_code, 0);
  const json facts = json_value(read_table("facts", {folder.path("a.h5")}));
  const std::string summed =
      Program({golden + ".ptu"}, "/usr/bin/sha256sum").wait().out.substr(0, 64);
  EXPECT_EQ(facts["recording_sha256"], summed);
  EXPECT_EQ(facts["recording"], golden + ".ptu");
  EXPECT_EQ(facts["program"].get<std::string>().rfind("splid ", 0), 0U);
  EXPECT_EQ(facts["configuration"]["schema"], "splid.config");
  EXPECT_EQ(facts["pattern"]["schema"], "splid.pattern");
}

TEST_F(TablesProgram, ATableReplacesNothingThatItShouldNot) {
  const ProgramResult neither = replay({"--output", folder.path("a.txt")});
  EXPECT_EQ(neither.exit_code, 2);
  EXPECT_THAT(neither.err, HasSubstr("--output " + folder.path("a.txt") +
                                     ": a table of frames ends in .h5 (HDF5) or in .csv"));
  const std::string mine = folder.write("a.h5", "mine");
  EXPECT_THAT(replay({"--output", mine}).err, HasSubstr("the file exists"));
  EXPECT_EQ(file_text(mine), "mine");
  EXPECT_EQ(replay({"--output", mine, "--force"}).exit_code, 0);
  EXPECT_EQ(read_table("rows", {mine}), "7\n");
  std::filesystem::create_symlink(golden + ".ptu", folder.path("b.h5"));
  const ProgramResult own = replay({"--output", folder.path("b.h5"), "--force"});
  EXPECT_EQ(own.exit_code, 2);
  EXPECT_THAT(own.err, HasSubstr("to write there would destroy it"));
}

TEST_F(TablesProgram, AReplayEndsWhereItsTableCannotBeWritten) {
  const test::SmallDisk disk(1);
  if (!disk.mounted()) GTEST_SKIP() << "takes root, to mount a small disk";
  disk.fill_but(4096);
  const ProgramResult result = replay({"--output", disk.path("a.h5")});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("No space left on device"));
}

TEST_F(TablesProgram, ARunKeepsItsFramesBesideItsRecordings) {
  for (const std::string kind : {"h5", "csv"}) {
    const std::string kept = folder.path(kind);
    const std::string file =
        config(R"("folder":")" + kept + R"(","max_file_s":1,"frames":")" + kind + "\"",
               R"("pace":"live","seconds":1.9)");
    const ProgramResult result = run_program({"run", "--config", file});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const std::vector<std::string> recordings = test::recordings_in(kept);
    ASSERT_EQ(recordings.size(), 2U);
    int rows = 0;
    for (const std::string& recording : recordings) {
      const std::string table = recording + ".frames." + kind;
      rows += kind == "h5" ? std::stoi(read_table("rows", {table}))
                           : static_cast<int>(table_lines(file_text(table)).size()) - 1;
    }
    // Frames of 50 ms, and what is left of the last. A recorder may be late by 0.9 s.
    EXPECT_GE(rows, 38);
    EXPECT_THAT(result.err, HasSubstr("; " + std::to_string(rows) + " frames in 2 tables"));
    EXPECT_THAT(result.err, HasSubstr(" " + std::to_string(rows) + " frames: "));
  }
}

TEST_F(TablesProgram, ARecordingsFramesHaveARowForEachPixel) {
  const std::string file =
      config(R"("frames":"h5")",
             R"("array":{"columns":2,"planes":[{"motion":"linear","distance_m":25}]},)"
             R"("pace":"max","seconds":0.2)",
             R"(,"pixels":[{"name":"left","input":1},{"name":"right","input":2}])");
  const std::string recording = folder.path("a.ptu");
  const ProgramResult result = run_program({"record", "--config", file, "--output", recording});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::vector<std::string> rows =
      table_lines(read_table("frames", {recording + ".frames.h5"}));
  ASSERT_GE(rows.size(), 8U);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const json row = json_value(rows[i]);
    EXPECT_EQ(row["sequence"], i / 2);
    EXPECT_EQ(row["pixel"], i % 2 == 0 ? "left" : "right");
    if (row["valid"] == true) {
      EXPECT_NEAR(row["distance_m"].get<double>(), 25, 0.1) << rows[i];
    }
  }
}

TEST_F(TablesProgram, ARecordingsFramesAreThoseOfItsReplay) {
  const std::string file = config(R"("frames":"h5")", R"("pace":"max","seconds":1)");
  const std::string recording = folder.path("a.ptu");
  const ProgramResult result = run_program({"record", "--config", file, "--output", recording});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string table = recording + ".frames.h5";
  EXPECT_THAT(result.err, HasSubstr(" frames in " + table));
  ASSERT_EQ(run_program({"replay", recording, "--config", file, "--no-publish", "--output",
                         folder.path("b.h5")})
                .exit_code,
            0);
  const std::vector<std::string> recorded = table_lines(read_table("frames", {table}));
  const std::vector<std::string> replayed =
      table_lines(read_table("frames", {folder.path("b.h5")}));
  // The last frame is cut at the last tag, whose heartbeat a recording does not have.
  ASSERT_EQ(recorded.size(), replayed.size());
  EXPECT_GE(recorded.size(), 20U);
  for (std::size_t i = 0; i + 1 < recorded.size(); ++i) {
    // But for the time of day, which comes of another clock, and what depends on the machine.
    const auto repeatable = [](const std::string& line) {
      const std::size_t begin = line.find("\"sequence");
      return line.substr(begin, line.find("\"effort") - begin);
    };
    EXPECT_EQ(repeatable(recorded[i]), repeatable(replayed[i]));
  }
  const json facts = json_value(read_table("facts", {table}));
  EXPECT_EQ(facts["recording_sha256"],
            Program({recording}, "/usr/bin/sha256sum").wait().out.substr(0, 64));
  // Neither the recording nor its table is replaced unasked.
  EXPECT_EQ(run_program({"record", "--config", file, "--output", recording}).exit_code, 2);
  EXPECT_EQ(run_program({"record", "--config", file, "--output", recording, "--force"}).exit_code,
            0);
}

TEST_F(TablesProgram, AKilledDaemonLeavesATableWithAllThatWasReadBefore) {
  for (int round = 0; round < test::times(3); ++round) {
    const std::string kept = folder.path("kept" + std::to_string(round));
    // A frame a millisecond, so that a kill may come between any two writes.
    const std::string file =
        config(R"("folder":")" + kept + R"(","frames":"h5")", R"("pace":"max","seconds":1000)");
    Program daemon({"run", "--config", file});
    int rows = 0;
    const auto until = std::chrono::steady_clock::now() + test::patience;
    while (rows < 100 * (round + 1)) {
      ASSERT_LT(std::chrono::steady_clock::now(), until) << daemon.err();
      const std::vector<std::string> recordings = test::recordings_in(kept);
      const std::string table = recordings.empty() ? "" : recordings[0] + ".frames.h5";
      // A reader may come while it is written.
      if (std::filesystem::exists(table)) rows = std::stoi(read_table("rows", {table}));
    }
    daemon.signal(SIGKILL);
    (void)daemon.wait();
    const std::string table = test::recordings_in(kept)[0] + ".frames.h5";
    const std::vector<std::string> frames = table_lines(read_table("frames", {table}));
    EXPECT_GE(static_cast<int>(frames.size()), rows);
    EXPECT_THAT(frames.back(), HasSubstr("\"sequence\": " + std::to_string(frames.size() - 1)));
  }
}

}  // namespace
}  // namespace splid::recording
