#include "daemon/tradeoff/tradeoff.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/daemon_scene.hpp"
#include "tests/support/program.hpp"

namespace splid {
namespace {

using splid::test::file_text;
using splid::test::ProgramResult;
using splid::test::run_program;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

// Each reading is a millisecond after the one before, as if every estimate took one.
double steady_ms() {
  static double now_ms = 0;
  return ++now_ms;
}

std::vector<TradeoffRow> measured(const Config& config, const TradeoffPlan& plan,
                                  const TradeoffEvents& events, const std::stop_token& stop = {}) {
  return measure_tradeoff(config, find_origin(config, ""), plan, steady_ms, events, stop);
}

const TradeoffEvents no_events = {[](const std::string&, double) {}, [](const std::string&) {}};

// The RMSE of 200 errors is known to 5 %: four of those.
TEST(Tradeoff, RowsHoldWhatTheSceneGives) {
  const Config config = scene_config(1);
  const auto rows = measured(config, {{5, 10}, 200}, no_events);
  ASSERT_THAT(rows, SizeIs(2 * settings_of_length({}, 5).size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const TradeoffRow& row = rows[i];
    SCOPED_TRACE(setting_name(row.setting.estimator));
    EXPECT_EQ(row.setting.length_ms, i < rows.size() / 2 ? 5 : 10);
    EXPECT_EQ(row.frames, 200u);
    EXPECT_EQ(row.compared, 200u);
    EXPECT_EQ(row.wrong_peaks, 0u);
    EXPECT_EQ(row.no_value, 0u);
    EXPECT_EQ(row.p50_ms, 1);
    EXPECT_EQ(row.p99_ms, 1);
    EXPECT_NEAR(row.photons, 189.3 * row.setting.length_ms, 6);
    EXPECT_NEAR(row.distance_ratio().value_or(0), 1, 0.2);
    EXPECT_NEAR(row.velocity_ratio().value_or(0), 1, 0.2);
    EXPECT_NEAR(row.distance_bound_m.value_or(0), 0.62e-3 * std::sqrt(50 / row.setting.length_ms),
                0.02e-3 * std::sqrt(50 / row.setting.length_ms));
  }
}

TEST(Tradeoff, ASceneAtRestHasNoVelocityToMeasure) {
  Config config = scene_config(1);
  config.scene.motion = Motion::static_target;
  auto& scene = dynamic_cast<SimulatorOptions&>(*config.source);
  scene.target.motion = simulator::MotionKind::linear;
  const auto rows = measured(config, {{5}, 100}, no_events);
  ASSERT_THAT(rows, Not(IsEmpty()));
  EXPECT_FALSE(rows.front().velocity_rmse_mps);
  EXPECT_FALSE(rows.front().velocity_ratio());
  EXPECT_NEAR(rows.front().distance_ratio().value_or(0), 1, 0.28);
}

TEST(Tradeoff, WithoutATargetNothingIsComparedAndNothingInvented) {
  Config config = scene_config(1);
  dynamic_cast<SimulatorOptions&>(*config.source).detection.signal_per_pulse = 0;
  const auto rows = measured(config, {{5}, 20}, no_events);
  ASSERT_THAT(rows, Not(IsEmpty()));
  EXPECT_EQ(rows.front().no_value, 20u);
  EXPECT_FALSE(rows.front().distance_rmse_m);
  EXPECT_FALSE(rows.front().distance_bound_m);
  EXPECT_FALSE(rows.front().distance_ratio());
}

TEST(Tradeoff, ProgressGoesFromNothingToAll) {
  std::vector<double> done;
  TradeoffEvents events = no_events;
  events.progress = [&](const std::string&, double part) { done.push_back(part); };
  measured(scene_config(1), {{5, 10}, 10}, events);
  ASSERT_THAT(done, Not(IsEmpty()));
  EXPECT_EQ(done.front(), 0);
  EXPECT_NEAR(done.back(), 1, 0.02);
  EXPECT_TRUE(std::is_sorted(done.begin(), done.end()));
}

TEST(Tradeoff, AStopEndsItWithWhatIsThere) {
  std::stop_source stop;
  TradeoffEvents events = no_events;
  std::size_t estimated = 0;
  events.progress = [&](const std::string& doing, double) {
    if (doing.find("making") == std::string::npos && ++estimated == 30) stop.request_stop();
  };
  const auto rows = measured(scene_config(1), {{5, 10}, 20}, events, stop.get_token());
  // 21 frames of the first setting, 9 of the second; the first frame of each is not judged.
  ASSERT_THAT(rows, SizeIs(2));
  EXPECT_EQ(rows[0].frames, 20u);
  EXPECT_EQ(rows[1].frames, 8u);
}

TEST(Tradeoff, TheThreadsClockCountsWorkAndNotSleep) {
  const double begin_ms = thread_cpu_ms();
  volatile double sum = 0;
  while (thread_cpu_ms() - begin_ms < 5) sum = sum + 1;
  EXPECT_GT(sum, 0);
}

class TradeoffProgram : public ::testing::Test {
 protected:
  TradeoffProgram() {
    run_program({"pattern", "interleaved", "--subperiods-ns", "180", "189", "--output",
                 folder.path("pattern.json")});
    config = folder.write(
        "config.json",
        R"({"schema":"splid.config","v":[1,0],"source":{"driver":"simulator"},)"
        R"("pattern":{"file":"pattern.json"},"pipeline":{"ring_capacity_tags":131072}})");
  }

  ProgramResult run(std::vector<std::string> more) const {
    std::vector<std::string> arguments = {"tradeoff", "--config", config,      "--plot", plot(),
                                          "--frames", "12",       "--lengths", "5,10"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(arguments);
  }
  [[nodiscard]] std::string plot() const { return folder.path("plot.svg"); }

  splid::test::TempFolder folder;
  std::string config;
};

TEST_F(TradeoffProgram, PrintsATableAndWritesThePlot) {
  const ProgramResult result = run({"--csv", folder.path("table.csv")});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("simulated target"), HasSubstr("exhaustive"),
                                HasSubstr("balanced"), HasSubstr("fast")));
  EXPECT_THAT(result.err, HasSubstr(plot()));
  EXPECT_THAT(file_text(plot()), AllOf(HasSubstr("<svg"), HasSubstr("</svg>")));
  EXPECT_THAT(file_text(folder.path("table.csv")), HasSubstr("effort,"));
}

TEST_F(TradeoffProgram, PrintsARowALineAsJson) {
  const ProgramResult result = run({"--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  std::istringstream lines(result.out);
  std::size_t rows = 0;
  for (std::string line; std::getline(lines, line); ++rows) {
    const auto row = nlohmann::json::parse(line);
    EXPECT_EQ(row.at("schema"), "splid.tradeoff");
    EXPECT_EQ(row.at("frames"), 12);
    EXPECT_GT(row.at("compute_ms_p50"), 0);
    EXPECT_GE(row.at("compute_ms_p99"), row.at("compute_ms_p50"));
  }
  EXPECT_EQ(rows, 2 * settings_of_length({}, 5).size());
}

TEST_F(TradeoffProgram, ASeedGivesItsOwnFramesAgain) {
  const auto photons = [&](const char* seed) {
    const std::string out = run({"--json", "--seed", seed}).out;
    return nlohmann::json::parse(out.substr(0, out.find('\n'))).at("photons").get<double>();
  };
  EXPECT_EQ(photons("7"), photons("7"));
  EXPECT_NE(photons("7"), photons("8"));
}

TEST_F(TradeoffProgram, ABudgetIsMetOrADataError) {
  const ProgramResult met = run({"--budget-ms", "10000"});
  EXPECT_EQ(met.exit_code, 0) << met.err;
  EXPECT_THAT(met.out, AllOf(HasSubstr("within 10000 ms"), HasSubstr("\"length_ms\": 10")));
  const ProgramResult missed = run({"--budget-ms", "0.000001"});
  EXPECT_EQ(missed.exit_code, 4);
  EXPECT_THAT(missed.out, HasSubstr("balanced"));
  EXPECT_THAT(missed.err, HasSubstr("no setting is done within 1e-06 ms"));
}

TEST_F(TradeoffProgram, ErrorsHaveTheExitCodesOfTheOtherCommands) {
  const auto expect_error = [](const ProgramResult& result, int exit_code, const char* text) {
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_THAT(result.err, HasSubstr(text));
  };
  expect_error(run_program({"tradeoff"}), 2, "--config");
  expect_error(run({"--frames", "2"}), 2, "--frames");
  expect_error(run({"--budget-ms", "-1"}), 2, "--budget-ms");
  expect_error(run({folder.path("missing.ptu")}), 4, "missing.ptu");
  expect_error(run({"--csv", folder.path("no/such/folder.csv")}), 3, "folder.csv");
}

TEST_F(TradeoffProgram, ASignalEndsItCleanly) {
  std::vector<std::string> arguments = {"tradeoff",  "--config", config,     "--plot",  plot(),
                                        "--lengths", "5",        "--frames", "1000000", "--json"};
  splid::test::Program program(arguments);
  while (program.err().find("frames of the configured scene") == std::string::npos) {
    std::this_thread::sleep_for(std::chrono::milliseconds{5});
  }
  program.signal(SIGINT);
  const ProgramResult result = program.wait();
  EXPECT_EQ(result.exit_code, 2) << result.err;
  EXPECT_THAT(result.err, HasSubstr("stopped before anything was measured"));
}

}  // namespace
}  // namespace splid
