#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "tests/support/known_truth.hpp"

// What the built program publishes of simulated scenes of two and of three targets, each listed
// target beside where it was.

namespace splid {
namespace {

class SeveralTargetsOf : public test::KnownTruth {
 protected:
  // The scene's targets are to be in descending order of their signals, as a frame lists them.
  void expect_all(const std::string& asked_for, std::size_t targets) {
    const auto frames = replayed(R"(,"scene":{"targets":)" + asked_for + "}");
    EXPECT_GE(frames.size(), 9U);
    std::vector<std::array<test::Pulls, 3>> pulls(targets);
    for (const FrameMessage& frame : frames) {
      EXPECT_EQ(frame.status, FrameStatus::ok);
      ASSERT_TRUE(frame.targets);
      ASSERT_EQ(frame.targets->size(), targets);
      EXPECT_EQ(frame.distance_m, frame.targets->front().distance_m);
      for (std::size_t k = 0; k < targets; ++k) {
        const FrameMessage::Target& target = frame.targets->at(k);
        EXPECT_EQ(target.status, FrameStatus::ok);
        const SceneTruth::State there = true_state(frame, k);
        pulls[k][0].add(*target.distance_m, there.distance_m, *target.std_distance_m);
        pulls[k][1].add(*target.velocity_mps, there.velocity_mps, *target.std_velocity_mps);
        pulls[k][2].add(*target.signal_per_pulse, true_signal(k), *target.std_signal_per_pulse);
        EXPECT_LT(*target.std_distance_m, 0.002);
      }
    }
    for (std::size_t k = 0; k < targets; ++k) {
      const std::string of = " of target " + std::to_string(k);
      pulls[k][0].expect_right("distance" + of);
      pulls[k][1].expect_right("velocity" + of);
      pulls[k][2].expect_right("signal" + of);
    }
  }
};

constexpr const char* leaving =
    R"("target":{"motion":"linear","distance_m":284.5,"velocity_mps":20},)";
// A window that stays 2 m before it.
constexpr const char* window =
    R"({"motion":"linear","distance_m":282.5,"velocity_mps":0,"signal_per_pulse":0.0009})";

TEST_F(SeveralTargetsOf, AWindowAndWhatIsBehindItAreBothWhereTheyAre) {
  simulate(std::string(leaving) + R"("more_targets":[)" + window + "]", "0.51");
  expect_all("2", 2);
}

TEST_F(SeveralTargetsOf, ThreeAreWhereTheyAre) {
  simulate(std::string(leaving) + R"("more_targets":[)" + window +
               R"(,{"motion":"linear","distance_m":300,"velocity_mps":-35,)" +
               R"("signal_per_pulse":0.0005}])",
           "0.51");
  expect_all("3", 3);
}

}  // namespace
}  // namespace splid
