#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <sstream>
#include <string>

#include "protocol/frame_json.hpp"
#include "tests/support/light_scene.hpp"
#include "tests/support/program.hpp"

// Whose metre the built program measures in: simulated recordings of which either oscillator is
// off, replayed with either of them as drift.reference.

namespace splid {
namespace {

struct MeanError {
  double distance_m = 0, velocity_mps = 0;
  double std_distance_m = 0, std_velocity_mps = 0;  // of the means
};

class ClockReferenceOf : public ::testing::Test {
 protected:
  ClockReferenceOf() {
    std::filesystem::copy(SPLID_SOURCE_DIR "/config/patterns/interleaved-180-189.json",
                          folder.path("p.json"));
  }

  std::string write(const std::string& name, const std::string& source,
                    const std::string& drift) const {
    return folder.write(name, R"({"schema":"splid.config","v":[1,0],"source":{)" + source +
                                  R"(},"pattern":{"file":"p.json"},"drift":{)" + drift +
                                  R"(},"publish":{"endpoint":"ipc://)" + folder.path("socket") +
                                  "\"}" + test::small_ring + "}");
  }

  // 20 frames of a target that leaves at 20 m/s from 284.5 m. In the tagger's clock it does so
  // later where that clock is fast.
  MeanError replayed(const std::string& reference, double tagger_ppm) const {
    const std::string config = write("r.json", R"("driver":"replay","recording":"a.ptu","speed":0)",
                                     R"("reference":")" + reference + "\"");
    const test::ProgramResult result =
        test::run_program({"replay", folder.path("a.ptu"), "--config", config, "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    MeanError mean;
    double frames = 0;
    std::istringstream lines(result.out);
    for (std::string line; std::getline(lines, line);) {
      const FrameMessage frame = frame_from_json(line);
      if (frame.status != FrameStatus::ok) continue;
      const double mid_s = static_cast<double>(frame.start_ps) * 1e-12 + frame.duration_ms * 5e-4;
      mean.distance_m += *frame.distance_m - (284.5 + 20 * mid_s / (1 + tagger_ppm * 1e-6));
      mean.velocity_mps += *frame.velocity_mps - 20;
      mean.std_distance_m += std::pow(*frame.std_distance_m, 2);
      mean.std_velocity_mps += std::pow(*frame.std_velocity_mps, 2);
      ++frames;
    }
    EXPECT_GE(frames, 19);
    mean.distance_m /= frames;
    mean.velocity_mps /= frames;
    mean.std_distance_m = std::sqrt(mean.std_distance_m) / frames;
    mean.std_velocity_mps = std::sqrt(mean.std_velocity_mps) / frames;
    return mean;
  }

  test::TempFolder folder;
};

TEST_F(ClockReferenceOf, TheBetterOscillatorMakesTheDistanceRight) {
  for (const double tagger_ppm : {0.0, 25.0}) {
    // The tagger counts 25 ppm too much in a period: the generator is slow, or the tagger fast.
    const std::string scene =
        write("s.json",
              R"("driver":"simulator","pace":"max","seconds":1.02,"drift_ppm":25,"tagger_ppm":)" +
                  std::to_string(tagger_ppm) +
                  R"(,"target":{"motion":"linear","distance_m":284.5,"velocity_mps":20})",
              "");
    const test::ProgramResult made = test::run_program(
        {"record", "--config", scene, "--output", folder.path("a.ptu"), "--force"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    for (const std::string reference : {"tagger", "pattern"}) {
      const MeanError mean = replayed(reference, tagger_ppm);
      const bool is_right = (tagger_ppm == 0) == (reference == "tagger");
      const double wrong_m = tagger_ppm == 0 ? -284.5 * 25e-6 : 284.5 * 25e-6;  // 7 mm
      EXPECT_NEAR(mean.distance_m, is_right ? 0 : wrong_m, 4.5 * mean.std_distance_m)
          << reference << ", tagger " << tagger_ppm << " ppm fast";
      EXPECT_NEAR(mean.velocity_mps, 0, 4.5 * mean.std_velocity_mps);
      EXPECT_LT(mean.std_distance_m, 2e-4);
    }
  }
}

}  // namespace
}  // namespace splid
