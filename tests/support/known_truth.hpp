#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "protocol/frame_json.hpp"
#include "protocol/truth.hpp"
#include "tests/support/light_scene.hpp"
#include "tests/support/program.hpp"

namespace splid::test {

// Scenes that the built program simulates into a recording, with their truth beside it, and
// replays: what it publishes of them is compared with that truth.
class KnownTruth : public ::testing::Test {
 protected:
  KnownTruth() {
    std::filesystem::copy(SPLID_SOURCE_DIR "/config/patterns/interleaved-180-189.json",
                          folder.path("p.json"));
  }

  // scene: members of the simulator's source. Fills `truth`.
  void simulate(const std::string& scene, const std::string& seconds) {
    const std::string file = config("s.json", R"("driver":"simulator",)" + scene, "");
    const ProgramResult made = run_program(
        {"simulate", "--config", file, "--seconds", seconds, "--output", folder.path("a.ptu")});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    truth = truth_from_json(file_text(folder.path("a.truth.json")));
  }

  // The frames that lie in the recording as a whole, which the last frame does not. more: further
  // sections of the configuration.
  std::vector<FrameMessage> replayed(const std::string& more) const {
    const std::string file = config("r.json", R"("driver":"replay","recording":"a.ptu")", more);
    const ProgramResult result =
        run_program({"replay", folder.path("a.ptu"), "--config", file, "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::vector<FrameMessage> frames;
    std::istringstream lines(result.out);
    for (std::string line; std::getline(lines, line);) frames.push_back(frame_from_json(line));
    std::erase_if(frames, [](const FrameMessage& frame) {
      return frame.status == FrameStatus::no_sync || frame.status == FrameStatus::incomplete;
    });
    return frames;
  }

  // Where the scene's target is at the middle of a frame; 1 and more: its further targets.
  [[nodiscard]] SceneTruth::State true_state(const FrameMessage& frame,
                                             std::size_t target = 0) const {
    SceneTruth of = truth;
    if (target > 0) {
      of.distance_m = truth.more_targets.at(target - 1).distance_m;
      of.velocity_mps = truth.more_targets.at(target - 1).velocity_mps;
    }
    return of.at(frame.start_ps + std::llround(frame.duration_ms * 5e8)).value();
  }
  [[nodiscard]] double true_signal(std::size_t target) const {
    return target == 0 ? truth.signal_per_pulse
                       : truth.more_targets.at(target - 1).signal_per_pulse;
  }

  TempFolder folder;
  SceneTruth truth;

 private:
  std::string config(const std::string& name, const std::string& source,
                     const std::string& more) const {
    return folder.write(name, R"({"schema":"splid.config","v":[1,0],"source":{)" + source +
                                  R"(},"pattern":{"file":"p.json"},"publish":{"endpoint":"ipc://)" +
                                  folder.path("socket") + "\"}" + small_ring + more + "}");
  }
};

// Errors over the deviations that were published with the values.
class Pulls {
 public:
  void add(double value, double truth, double std) {
    EXPECT_GT(std, 0);
    const double pull = (value - truth) / std;
    sum_ += pull;
    squares_ += pull * pull;
    ++count_;
  }
  [[nodiscard]] double count() const { return count_; }

  // Of n errors whose deviations are right, the mean is off by 1 / sqrt(n), and the rms is 1 with a
  // deviation of 1 / sqrt(2 n).
  void expect_right(const std::string& of) const {
    ASSERT_GT(count_, 0) << of;
    const double rms = std::sqrt(squares_ / count_);
    EXPECT_LT(std::abs(sum_ / count_), 4 / std::sqrt(count_)) << of << " is off";
    EXPECT_NEAR(rms, 1, 4 / std::sqrt(2 * count_)) << of << " has wrong deviations";
  }

 private:
  double sum_ = 0, squares_ = 0, count_ = 0;
};

}  // namespace splid::test
