#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "estimator/model/vector_level.hpp"
#include "protocol/json_value.hpp"
#include "tests/support/daemon_scene.hpp"
#include "tests/support/program.hpp"

// Small recordings and the frames that come of them, through the built program: the same bits at
// any speed and on any run, and what they were when they were put here.
//
// SPLID_UPDATE=1 writes the expected frames anew; the reason belongs into the commit. The
// recordings are of splid simulate --seconds 0.13 with the *.scene.json beside them.

namespace splid {
namespace {

using nlohmann::json;
using test::run_program;

constexpr const char* folder = SPLID_SOURCE_DIR "/tests/data/golden/";

// Of numbers, relative: sine and logarithm differ in their last bit from one C library to another.
constexpr double tolerance = 1e-9;

class Golden : public ::testing::TestWithParam<const char*> {
 protected:
  [[nodiscard]] std::string file(const std::string& ending) const {
    return std::string(folder) + GetParam() + ending;
  }
  [[nodiscard]] std::string frames_at(const std::string& speed) const {
    const test::ProgramResult result = run_program(
        {"replay", file(".ptu"), "--config", file(".json"), "--speed", speed, "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::istringstream lines(result.out);
    std::string frames;
    for (std::string line; std::getline(lines, line);) frames += repeatable(line) + "}\n";
    return frames;
  }
};

void expect_same(const json& found, const json& expected, const std::string& place) {
  ASSERT_EQ(found.type_name(), std::string(expected.type_name())) << place;
  if (expected.is_number()) {
    const auto want = expected.get<double>();
    EXPECT_NEAR(found.get<double>(), want, tolerance * std::abs(want)) << place;
  } else if (expected.is_object()) {
    EXPECT_EQ(found.size(), expected.size()) << place;
    for (const auto& [key, value] : expected.items()) {
      ASSERT_TRUE(found.contains(key)) << place << "/" << key;
      expect_same(found[key], value, place + "/" + key);
    }
  } else {
    EXPECT_EQ(found, expected) << place;
  }
}

TEST_P(Golden, FramesAreTheSameAtAnySpeedAndAsTheyWere) {
  const std::string frames = frames_at("max");
  if (std::getenv("SPLID_UPDATE") != nullptr) std::ofstream(file(".frames")) << frames;
  EXPECT_EQ(frames, frames_at("max"));
  EXPECT_EQ(frames, frames_at("0.7"));
  std::istringstream found(frames);
  std::istringstream expected(test::file_text(file(".frames")));
  int count = 0;
  for (std::string line, wanted; std::getline(expected, wanted); ++count) {
    ASSERT_TRUE(std::getline(found, line)) << count;
    expect_same(json_value(line), json_value(wanted), "frame " + std::to_string(count));
  }
  EXPECT_EQ(found.peek(), std::istringstream::traits_type::eof());
  EXPECT_GE(count, 6);
}

TEST_P(Golden, FramesAreTheSameAtEveryVectorLevel) {
  const std::string frames = frames_at("max");
  for (const VectorLevel level : runnable_vector_levels()) {
    const std::string name = vector_level_name(level);
    ::setenv("SPLID_VECTOR_LEVEL", name.c_str(), 1);
    EXPECT_NE(run_program({"--version"}).out.find("kernels: " + name), std::string::npos);
    EXPECT_EQ(frames_at("max"), frames) << name;
  }
  ::unsetenv("SPLID_VECTOR_LEVEL");
}

INSTANTIATE_TEST_SUITE_P(Modes, Golden, ::testing::Values("interleaved", "random", "mrr"),
                         [](const auto& mode) { return std::string(mode.param); });

}  // namespace
}  // namespace splid
