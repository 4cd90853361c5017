#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <sstream>
#include <string>

#include "protocol/frame_json.hpp"
#include "tests/support/light_scene.hpp"
#include "tests/support/program.hpp"

// What the built program publishes of a simulated target that turns round at 9.9 m/s^2, in frames
// of 100 ms, beside where the target was.

namespace splid {
namespace {

struct Errors {
  double distance = 0, acceleration = 0;  // rms, in published deviations
  double mean_m = 0;                      // of the distance
  double frames = 0, accelerated = 0;     // those that are ok; those with an acceleration
};

class Accelerating : public ::testing::Test {
 protected:
  Accelerating() {
    std::filesystem::copy(SPLID_SOURCE_DIR "/config/patterns/interleaved-180-189.json",
                          folder.path("p.json"));
    const std::string scene =
        config("s.json",
               R"("driver":"simulator","pace":"max","seconds":0.51,"target":{"motion":"sinusoid",)"
               R"("distance_m":284.5,"amplitude_m":4,"period_s":4,"phase_turns":0.1875})",
               "moving");
    const test::ProgramResult made =
        test::run_program({"record", "--config", scene, "--output", folder.path("a.ptu")});
    EXPECT_EQ(made.exit_code, 0) << made.err;
  }

  std::string config(const std::string& name, const std::string& source,
                     const std::string& motion) const {
    return folder.write(
        name, R"({"schema":"splid.config","v":[1,0],"source":{)" + source +
                  R"(},"pattern":{"file":"p.json"},"frame":{"length_ms":100},"scene":{"motion":")" +
                  motion + R"("},"publish":{"endpoint":"ipc://)" + folder.path("socket") + "\"}" +
                  test::small_ring + "}");
  }

  Errors replayed(const std::string& motion) const {
    const std::string file =
        config("r.json", R"("driver":"replay","recording":"a.ptu","speed":0)", motion);
    const test::ProgramResult result =
        test::run_program({"replay", folder.path("a.ptu"), "--config", file, "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    Errors errors;
    std::istringstream lines(result.out);
    for (std::string line; std::getline(lines, line);) {
      const FrameMessage frame = frame_from_json(line);
      if (frame.status != FrameStatus::ok) continue;
      const double mid_s = static_cast<double>(frame.start_ps) * 1e-12 + frame.duration_ms * 5e-4;
      const double turn = 2 * std::numbers::pi * (mid_s / 4 + 0.1875);
      const double off_m = *frame.distance_m - (284.5 + 4 * std::sin(turn));
      ++errors.frames;
      errors.mean_m += off_m;
      errors.distance += std::pow(off_m / *frame.std_distance_m, 2);
      if (!frame.acceleration_mps2) continue;
      ++errors.accelerated;
      const double there_mps2 = -4 * std::pow(std::numbers::pi / 2, 2) * std::sin(turn);
      errors.acceleration +=
          std::pow((*frame.acceleration_mps2 - there_mps2) / *frame.std_acceleration_mps2, 2);
    }
    errors.mean_m /= errors.frames;
    errors.distance = std::sqrt(errors.distance / errors.frames);
    errors.acceleration = std::sqrt(errors.acceleration / errors.accelerated);
    return errors;
  }

  test::TempFolder folder;
};

// Taken as straight, the path is off by a t^2 / 24 = 4.1 mm, nine deviations of a straight one. The
// deviations hold that.
TEST_F(Accelerating, IsSeenWhereItIsAskedFor) {
  const Errors moving = replayed("moving");
  EXPECT_EQ(moving.frames, 5);
  EXPECT_EQ(moving.accelerated, 0);
  EXPECT_NEAR(moving.mean_m, -0.0040, 0.0010);
  EXPECT_LT(moving.distance, 2);
  for (const std::string motion : {"accelerating", "auto"}) {
    const Errors errors = replayed(motion);
    EXPECT_EQ(errors.frames, 5);
    EXPECT_EQ(errors.accelerated, 5) << motion;
    EXPECT_LT(errors.distance, 2) << motion;
    EXPECT_LT(errors.acceleration, 2) << motion;
  }
}

}  // namespace
}  // namespace splid
