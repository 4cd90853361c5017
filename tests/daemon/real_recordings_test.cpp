#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <sstream>
#include <vector>

#include "protocol/messages.hpp"
#include "tests/support/program.hpp"
#include "tests/support/real_recording.hpp"

// The built program on recordings of real instruments, from the pattern that is in them to frames.

namespace splid {
namespace {

using splid::test::ProgramResult;
using splid::test::run_program;

class RealRecordings : public ::testing::Test {
 protected:
  void use(const std::string& name) {
    recording = test::real_recording_path(name).string();
    if (!std::filesystem::exists(recording)) {
      GTEST_SKIP() << recording << " is not there; SPLID_DATA names the folder of the recordings";
    }
  }

  [[nodiscard]] std::string write_config(const std::string& name, const std::string& photon,
                                         const std::string& pattern) const {
    return folder.write(name, R"({"schema":"splid.config","v":[1,0],"source":{"driver":"replay",)"
                              R"("recording":")" +
                                  recording + R"("},"channels":{"photon":)" + photon +
                                  R"(},"pattern":{"file":")" + pattern +
                                  R"("},"pipeline":{"ring_capacity_tags":8388608},)"
                                  R"("publish":{"endpoint":"ipc://)" +
                                  folder.path("socket") + R"("}})");
  }

  [[nodiscard]] std::vector<FrameMessage> replay(const std::string& config) const {
    const ProgramResult result = run_program({"replay", recording, "--config", config, "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::vector<FrameMessage> frames;
    std::istringstream lines(result.out);
    for (std::string line; std::getline(lines, line);) frames.push_back(frame_from_json(line));
    return frames;
  }

  splid::test::TempFolder folder;
  std::string recording;
};

// A pulsed source at rest: the pattern is found in one detector's photons, then every frame
// measures the period, the jitter and a velocity of zero (an independent fit: 0 to 2.6 cm/s, +- 1
// to 2).
TEST_F(RealRecordings, QutagFramesMeasureASourceAtRest) {
  use("qutag_sync_t2.ptu");
  if (IsSkipped()) return;
  folder.write("nominal.json", R"({"schema":"splid.pattern","v":[1,0],"mode":"baseline",)"
                               R"("unambiguous_delay_ps":12512.6,"segments":[{"period_ps":12512.6,)"
                               R"("pulse_times_ps":[0],"amplitudes":[1],"repeats":0}]})");
  for (const std::string input : {"1", "2"}) {
    const std::string found = folder.path("found" + input + ".json");
    const ProgramResult calibrated =
        run_program({"calibrate", recording, "--config",
                     write_config("nominal" + input, input, "nominal.json"), "--output", found});
    ASSERT_EQ(calibrated.exit_code, 0) << calibrated.err;
    EXPECT_NE(calibrated.err.find("4 pulses"), std::string::npos) << calibrated.err;

    const std::vector<FrameMessage> frames = replay(write_config("found" + input, input, found));
    ASSERT_EQ(frames.size(), 6U);
    for (std::size_t k = 0; k < frames.size(); ++k) {
      const FrameMessage& frame = frames[k];
      // The recording ends within the sixth frame.
      EXPECT_EQ(frame.status, k < 5 ? FrameStatus::ok : FrameStatus::incomplete);
      ASSERT_TRUE(frame.sync && frame.sync->period_ps && frame.sync->jitter_ps);
      EXPECT_NEAR(*frame.sync->period_ps, 12512.626, 0.005);
      EXPECT_GE(*frame.sync->jitter_ps, 9);
      EXPECT_LE(*frame.sync->jitter_ps, 12);
      ASSERT_TRUE(frame.velocity_mps && frame.std_velocity_mps && frame.delay_ns);
      EXPECT_LT(std::abs(*frame.velocity_mps), 3 * *frame.std_velocity_mps) << k;
      EXPECT_LT(*frame.std_velocity_mps, 0.025);
      EXPECT_NEAR(*frame.distance_m, *frames[0].distance_m, 0.0006) << k;  // 4 ps
    }
  }
}

TEST_F(RealRecordings, HydraHarpWithoutSyncsSaysSo) {
  use("hydraharp400_t2_hbt.ptu");
  if (IsSkipped()) return;
  const ProgramResult checked = run_program({"check", recording});
  ASSERT_EQ(checked.exit_code, 0) << checked.err;
  for (const char* fact :
       {"409,482", "159,298", "224,721", "25,463", "8584904 ps", "999986166686 ps"}) {
    EXPECT_NE(checked.out.find(fact), std::string::npos) << fact << "\n" << checked.out;
  }

  folder.write("pattern.json", R"({"schema":"splid.pattern","v":[1,0],"mode":"baseline",)"
                               R"("unambiguous_delay_ps":3780000,"segments":[{"period_ps":3780000,)"
                               R"("pulse_times_ps":[0],"amplitudes":[1],"repeats":0}]})");
  const auto frames = replay(write_config("config.json", "[0,1]", "pattern.json"));
  ASSERT_EQ(frames.size(), 20U);
  std::uint64_t photons = 0;
  for (const FrameMessage& frame : frames) {
    EXPECT_EQ(frame.status, FrameStatus::no_sync);
    EXPECT_FALSE(frame.valid());
    EXPECT_FALSE(frame.distance_m.has_value());
    photons += frame.photons.value_or(0);
  }
  EXPECT_EQ(photons, 159298U + 224721U);
  EXPECT_EQ(frames[0].start_ps, 8584904);
}

}  // namespace
}  // namespace splid
