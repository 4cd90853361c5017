#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <sstream>
#include <thread>

#include "drivers/encoder/encoder_source.hpp"
#include "protocol/frame_json.hpp"
#include "tests/support/bridge_server.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/light_scene.hpp"
#include "tests/support/python_program.hpp"

// An encoder's counts through the built program: simulated, recorded, replayed.

namespace splid {
namespace {

using splid::test::eventually;
using splid::test::file_text;
using splid::test::Program;
using splid::test::ProgramResult;
using splid::test::python;
using splid::test::run_program;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double m_per_count = 0.002;

class EncoderProgram : public ::testing::Test {
 protected:
  // 0.3 m/s away from 100 m, 2,000 samples a second from 0.2 s on, for a second.
  std::string config(const std::string& encoder) const {
    return folder.write(
        "config.json",
        R"({"schema":"splid.config","v":[1,0],"source":{"driver":"simulator","pace":"max",)"
        R"("seconds":1,"signal_per_pulse":0.01,"encoder_rate_hz":2000,)"
        R"("target":{"motion":"linear","distance_m":100,"velocity_mps":0.3}},)"
        R"("encoder":{"m_per_count":0.002,"offset_m":90)" +
            encoder +
            R"(},"pattern":{"file":")" SPLID_SOURCE_DIR
            R"(/config/patterns/interleaved-180-189.json"},"publish":{"endpoint":"ipc://)" +
            folder.path("frames") + "\"}" + test::small_ring + "}");
  }

  // References must be the truth to within what counting leaves: 0.29 of a count a sample, less in
  // the mean, unless all samples of a slow target round alike.
  void expect_references(const ProgramResult& replayed) const {
    EXPECT_EQ(replayed.exit_code, 0) << replayed.err;
    int references = 0;
    std::istringstream lines(replayed.out);
    for (std::string line; std::getline(lines, line);) {
      const FrameMessage frame = frame_from_json(line);
      if (!frame.reference) continue;
      ++references;
      const double mid_s = static_cast<double>(frame.start_ps) * 1e-12 + frame.duration_ms / 2e3;
      EXPECT_NEAR(*frame.reference->distance_m, 100 + 0.3 * mid_s, m_per_count / 4);
      EXPECT_NEAR(*frame.reference->velocity_mps, 0.3, 0.02);
    }
    // 20 frames, of which the first four have no samples.
    EXPECT_GE(references, 15);
    EXPECT_LE(references, 16);
    EXPECT_THAT(replayed.err, HasSubstr(" compared with the encoder, 0 wrong peaks"));
    EXPECT_THAT(replayed.err, HasSubstr("distance RMSE 0."));
  }

  splid::test::TempFolder folder;
  std::string recording = folder.path("scene.ptu");
};

TEST_F(EncoderProgram, ASimulatedScenesCountsGoWithItsRecording) {
  const std::string file = config("");
  const ProgramResult made =
      run_program({"simulate", "--config", file, "--seconds", "1", "--output", recording});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(run_program({"check", recording}).out,
              HasSubstr("counts of its encoder are beside it in scene.ptu.encoder.csv"));
  const ProgramResult replayed = run_program({"replay", recording, "--config", file, "--json"});
  expect_references(replayed);
  // Other counts, by name: a gap at sample 150 ends the references.
  std::string counts = "0";
  for (int i = 0; i < 150; ++i) counts += ",5000";
  const std::string given = folder.write("gap.csv", counts + "\noverrun\n150,5000\n");
  const ProgramResult broken =
      run_program({"replay", recording, "--config", file, "--json", "--encoder", given});
  EXPECT_EQ(broken.exit_code, 0);
  EXPECT_THAT(broken.err, HasSubstr("no reference: the encoder's counts have a gap"));
  EXPECT_THAT(broken.out, HasSubstr("\"reference\":{\"distance_m\":100"));
  const std::string nonsense = folder.write("nonsense.csv", "0;5000\n");
  const ProgramResult refused =
      run_program({"replay", recording, "--config", file, "--encoder", nonsense});
  EXPECT_THAT(refused.err, HasSubstr("splid: error: " + nonsense + ": line 1"));
  EXPECT_EQ(refused.exit_code, 4);
}

TEST_F(EncoderProgram, ABridgesCountsAreKeptAndReplayed) {
  splid::test::BridgeServer server(folder.path("encoder.sock"));
  const std::string file = config(R"(,"address":")" + server.address() + "\"");
  std::string source = file_text(file);
  source.replace(source.find("\"max\""), 5, "\"live\"");
  Program recorder(
      {"record", "--config", folder.write("live.json", source), "--output", recording});
  ASSERT_TRUE(server.accept());
  for (int first = 0; first < 1'600; first += 20) {
    std::string line = std::to_string(first);
    for (int i = first; i < first + 20; ++i) {
      const double distance_m = 100 + 0.3 * (0.2 + i / 2000.0);
      line += ',' + std::to_string(std::lround((distance_m - 90) / m_per_count));
    }
    server.send(line + "\n");
  }
  EXPECT_EQ(recorder.wait().exit_code, 0);
  expect_references(run_program({"replay", recording, "--config", file, "--json"}));
}

TEST_F(EncoderProgram, ARecordingWithoutCountsHasNoReference) {
  const std::string file = config("");
  run_program({"simulate", "--config", file, "--seconds", "0.5", "--output", recording});
  std::filesystem::remove(recording + ".encoder.csv");
  const ProgramResult replayed = run_program({"replay", recording, "--config", file, "--json"});
  EXPECT_EQ(replayed.exit_code, 0) << replayed.err;
  EXPECT_THAT(replayed.out, Not(HasSubstr("reference")));
  EXPECT_THAT(replayed.err, Not(HasSubstr("encoder")));
}

// A DAQ's bridge starts the sample clock for whoever connects, and anew when samples were lost.
TEST_F(EncoderProgram, ADaqsBridgeSendsItsCounts) {
  const std::string address = "unix:" + folder.path("daq.sock");
  const Program bridge = python("drivers/encoder/python/nidaqmx_bridge.py",
                                {"--listen", address, "--device", "Dev7", "--rate-hz", "1000"});
  const auto source = open_encoder_socket(address, [](const std::string&) {});
  std::vector<EncoderBatch> batches;
  EncoderBatch batch;
  for (int i = 0; i < 4'000 && batches.size() < 12; ++i) {
    if (source->next(batch)) {
      batches.push_back(batch);
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds{5});
    }
  }
  ASSERT_EQ(batches.size(), 12U) << bridge.err();
  for (std::int64_t k = 0; k < 10; ++k) {
    EXPECT_EQ(batches[k].first_index, 10 * k);
    ASSERT_EQ(batches[k].counts.size(), 10U);
    EXPECT_EQ(batches[k].counts.back(), 5'009 + 10 * k);
  }
  EXPECT_EQ(batches[10], (EncoderBatch{0, {}, true}));
  EXPECT_EQ(batches[11].first_index, 0);
  EXPECT_THAT(bridge.out(), HasSubstr("samples were overwritten"));
}

// Whoever plugs the DAQ in later need not start the bridge again.
TEST_F(EncoderProgram, ADaqsBridgeNamesADeviceThatIsNotThereAndWaits) {
  const std::string address = "unix:" + folder.path("daq.sock");
  const Program bridge = python("drivers/encoder/python/nidaqmx_bridge.py",
                                {"--listen", address, "--device", "Dev8", "--rate-hz", "1000"});
  const auto source = open_encoder_socket(address, [](const std::string&) {});
  EncoderBatch batch;
  const std::string reason = "nidaqmx_bridge: Dev8: Device identifier is invalid.\n";
  EXPECT_TRUE(eventually([&] {
    EXPECT_FALSE(source->next(batch));
    return bridge.out().find(reason + reason) != std::string::npos;
  })) << bridge.out()
      << bridge.err();
}

}  // namespace
}  // namespace splid
