#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "protocol/frame_columns.hpp"
#include "tests/support/light_scene.hpp"
#include "tests/support/patience.hpp"
#include "tests/support/program.hpp"

// Many recordings through the built program: splid batch, splid merge.

namespace splid::batch {
namespace {

using test::file_text;
using test::Program;
using test::ProgramResult;
using test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;

const std::string golden_path = SPLID_SOURCE_DIR "/tests/data/golden/";

// A table's bytes with zeros for the times that its making took, which a batch leaves out.
std::string without_times(std::string table, std::size_t rows) {
  for (const FrameColumn& column : frame_columns()) {
    if (column.name != "compute_ms" && column.name != "latency_ms") continue;
    for (std::size_t row = 1; row <= rows; ++row) {
      const std::size_t at = table.size() - row * frame_row_bytes() + column.offset;
      table.replace(at, column.bytes, column.bytes, '\0');
    }
  }
  return table;
}

// The tables and the summary in a batch's folder, by their paths in it.
std::map<std::string, std::string> results_in(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    const std::string ending = entry.path().extension();
    if (ending != ".h5" && ending != ".csv") continue;
    files[entry.path().lexically_relative(folder)] = file_text(entry.path());
  }
  return files;
}

// The number that stands in the summary behind the given text.
std::size_t number_behind(const std::string& summary, const std::string& before) {
  const std::size_t at = summary.find(before);
  return at == std::string::npos ? 0 : std::stoul(summary.substr(at + before.size()));
}

class BatchProgram : public ::testing::Test {
 protected:
  // A simulated target with an encoder, in frames of half a millisecond, and a detector whose dead
  // time makes a frame look back to the photons of the frame before.
  void simulate(const std::string& seconds) {
    config = folder.write(
        "config.json",
        R"({"schema":"splid.config","v":[1,0],"source":{)" + std::string(test::light_source) +
            R"(,"pace":"max","seconds":1,"encoder_rate_hz":20000,)"
            R"("target":{"motion":"linear","distance_m":100,"velocity_mps":3}},)"
            R"("encoder":{"m_per_count":0.002,"offset_m":90},"frame":{"length_ms":0.5},)"
            R"("detector":{"dead_time_ns":40},"estimator":{"effort":"fast"},)"
            R"("pattern":{"file":")" SPLID_SOURCE_DIR
            R"(/config/patterns/interleaved-180-189.json"},"publish":{"endpoint":"ipc://)" +
            folder.path("frames") + R"("},"pipeline":{"ring_capacity_tags":262144})" +
            test::with_light_scene("") + "}");
    recording = folder.path("week/scene.ptu");
    std::filesystem::create_directory(folder.path("week"));
    const ProgramResult made =
        run_program({"simulate", "--config", config, "--seconds", seconds, "--output", recording});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }

  [[nodiscard]] std::vector<std::string> batch(const std::string& output,
                                               const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all = {"batch", folder.path("week"), "--config",
                                    config,  "--output",          folder.path(output)};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  // Starts a batch, and sends it a signal once its first slice is kept. Where the batch was faster
  // than the signal, tries again in another folder, which is left in `output`.
  ProgramResult interrupted(int signal, std::string& output) const {
    for (int attempt = 0; attempt < 20; ++attempt) {
      output = "interrupted-" + std::to_string(attempt);
      Program program(batch(output, {"--jobs", "1"}));
      const std::string slice = folder.path(output + "/slices/scene/000000.slice");
      const auto until = std::chrono::steady_clock::now() + test::patience;
      while (!std::filesystem::exists(slice) && std::chrono::steady_clock::now() < until &&
             !std::filesystem::exists(folder.path(output + "/summary.csv"))) {
        std::this_thread::sleep_for(std::chrono::milliseconds{1});
      }
      program.signal(signal);
      const ProgramResult result = program.wait();
      if (result.exit_code != 0) return result;
    }
    ADD_FAILURE() << "every batch ended before the signal came";
    return {};
  }

  test::TempFolder folder;
  std::string config;
  std::string recording;
};

TEST_F(BatchProgram, AnyShardsAndJobsGiveTheBitsOfAReplay) {
  simulate("1.6");
  ASSERT_EQ(run_program(batch("whole", {"--jobs", "1"})).exit_code, 0);
  const auto whole = results_in(folder.path("whole"));
  ASSERT_EQ(whole.size(), 2U);
  const std::size_t frames = number_behind(whole.at("summary.csv"), "\"scene.h5\",done,");
  EXPECT_GE(frames, 3000U);  // more than three slices
  const std::string table = folder.path("replay.h5");
  const ProgramResult replayed =
      run_program({"replay", recording, "--config", config, "--no-publish", "--output", table});
  ASSERT_EQ(replayed.exit_code, 0) << replayed.err;
  EXPECT_EQ(without_times(whole.at("scene.h5"), frames), without_times(file_text(table), frames));
  for (const int count : {2, 7}) {
    const std::string output = "shards-" + std::to_string(count);
    for (int index = 1; index <= count; ++index) {
      const std::string shard = std::to_string(index) + "/" + std::to_string(count);
      const ProgramResult result =
          run_program(batch(output, {"--shard", shard, "--jobs", std::to_string(1 + index % 2)}));
      ASSERT_EQ(result.exit_code, 0) << result.err;
    }
    const ProgramResult merged = run_program({"merge", folder.path(output)});
    EXPECT_EQ(merged.exit_code, 0) << merged.err;
    EXPECT_EQ(results_in(folder.path(output)), whole) << count;
  }
}

TEST_F(BatchProgram, AKilledOneGoesOnAndGivesTheSameBits) {
  simulate("2.2");
  ASSERT_EQ(run_program(batch("whole")).exit_code, 0);
  std::string output;
  EXPECT_EQ(interrupted(SIGKILL, output).exit_code, 128 + SIGKILL);
  const ProgramResult unfinished = run_program({"merge", folder.path(output)});
  EXPECT_EQ(unfinished.exit_code, 4);
  EXPECT_THAT(unfinished.err, HasSubstr("unfinished: " + recording + ": what follows frame"));
  const ProgramResult result = run_program(batch(output));
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(results_in(folder.path(output)), results_in(folder.path("whole")));
}

TEST_F(BatchProgram, CtrlCEndsItWithWordsAndItGoesOn) {
  simulate("2.2");
  ASSERT_EQ(run_program(batch("whole")).exit_code, 0);
  std::string output;
  const ProgramResult stopped = interrupted(SIGINT, output);
  EXPECT_EQ(stopped.exit_code, 130) << stopped.err;
  EXPECT_THAT(stopped.err,
              HasSubstr("stopped: 0 of 1 recordings are measured; the same command resumes"));
  EXPECT_EQ(run_program(batch(output)).exit_code, 0);
  EXPECT_EQ(results_in(folder.path(output)), results_in(folder.path("whole")));
}

TEST_F(BatchProgram, ABadRecordingStopsNoOtherAndIsNamedAtTheEnd) {
  const std::string good = golden_path + "interleaved.ptu";
  const std::string text = folder.write("notes.ptu", "what I did today");
  const std::string cut = folder.write("cut.ptu", file_text(good).substr(0, 100));
  const std::string none = folder.path("none.ptu");
  const std::string output = folder.path("out");
  const std::vector<std::string> command = {
      "batch",    text,  cut, none, good, "--config", golden_path + "interleaved.json",
      "--output", output};
  const ProgramResult result = run_program(command);
  EXPECT_EQ(result.exit_code, 4);
  const std::string at_the_end = result.err.substr(result.err.find("3 of 4 recordings cannot"));
  EXPECT_THAT(at_the_end, AllOf(HasSubstr(text), HasSubstr(cut),
                                HasSubstr(none + ": cannot open the recording: No such file")));
  const std::string summary = file_text(output + "/summary.csv");
  EXPECT_THAT(summary, HasSubstr('"' + good + "\",\"interleaved.h5\",done,7,"));
  EXPECT_THAT(summary, HasSubstr('"' + text + "\",\"\",failed,,"));
  // Each line has as many values.
  std::istringstream lines(summary);
  for (std::string line; std::getline(lines, line);) {
    if (line.find("failed") != std::string::npos) continue;
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), 20) << line;
  }
  // Once the file is good, it is measured.
  std::filesystem::copy_file(good, none);
  EXPECT_EQ(run_program(command).exit_code, 4);
  EXPECT_THAT(file_text(output + "/summary.csv"), HasSubstr("\"none.h5\",done,7,"));
}

TEST_F(BatchProgram, ShardsOfABadRecordingSayTheSame) {
  const std::string good = golden_path + "interleaved.ptu";
  const std::string text = folder.write("notes.ptu", "what I did today");
  for (const std::string count : {"1", "2"}) {
    for (const std::string index : {"1", "2"}) {
      if (index > count) continue;
      run_program({"batch", good, text, "--config", golden_path + "interleaved.json", "--output",
                   folder.path(count), "--shard", index + "/" + count});
    }
    EXPECT_EQ(run_program({"merge", folder.path(count)}).exit_code, 4);
  }
  EXPECT_EQ(results_in(folder.path("1")), results_in(folder.path("2")));
}

TEST_F(BatchProgram, RefusesWhatItCannotDo) {
  const std::string good = golden_path + "interleaved.ptu";
  const auto refused = [&](const std::string& option, const std::string& value) {
    const ProgramResult result =
        run_program({"batch", good, "--config", golden_path + "interleaved.json", "--output",
                     folder.path("out"), option, value});
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_FALSE(std::filesystem::exists(folder.path("out")));
    return result.err;
  };
  EXPECT_THAT(refused("--shard", "8/7"), HasSubstr("--shard 8/7: must be i/N"));
  EXPECT_THAT(refused("--jobs", "0"), HasSubstr("must be a number from 1 to 64"));
  EXPECT_THAT(run_program({"merge", folder.path("")}).err, HasSubstr("there is no batch.json"));
}

}  // namespace
}  // namespace splid::batch
