#include "daemon/study/tradeoff/tradeoff.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "protocol/json_value.hpp"
#include "tests/support/daemon_scene.hpp"
#include "tests/support/program.hpp"

namespace splid::tradeoff {
namespace {

using splid::test::file_text;
using splid::test::ProgramResult;
using splid::test::run_program;
using ::testing::AllOf;
using ::testing::ElementsAreArray;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

// Each reading is a millisecond after the one before, as if every estimate took one.
double now_ms = 0;
double step_ms = 1;
double steady_ms() { return now_ms += step_ms; }

class SteadyClock final : public Clock {
 public:
  [[nodiscard]] double unix_s() const override { return 0; }
  [[nodiscard]] std::int64_t steady_ns() const override { return std::llround(steady_ms() * 1e6); }
};

std::vector<Row> measured(const Config& config, const Plan& plan, const Events& events,
                          const std::stop_token& stop = {}) {
  const SteadyClock wall;
  return measure(config, find_origin(config, ""), plan, {steady_ms, wall}, events, stop);
}

const Events no_events = {[](std::size_t, double) {},
                          [](const std::string&, double, std::optional<double>) {},
                          [](const Row&) {}, [](double) {}, [](const std::string&) {}};

// Two efforts, each frame on its own and tracked, and one without findings.
constexpr std::size_t settings = 5;

// The RMSE of 200 errors is known to 5 %: four of those.
TEST(Tradeoff, RowsHoldWhatTheSceneGives) {
  const Config config = scene_config(1);
  const auto rows = measured(config, {{5, 10}, 200}, no_events);
  ASSERT_THAT(rows, SizeIs(2 * settings));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Row& row = rows[i];
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
  auto& scene = dynamic_cast<simulator::Options&>(*config.source);
  scene.target.motion = simulator::MotionKind::linear;
  const auto rows = measured(config, {{5}, 100}, no_events);
  ASSERT_THAT(rows, Not(IsEmpty()));
  EXPECT_FALSE(rows.front().velocity_rmse_mps);
  EXPECT_FALSE(rows.front().velocity_ratio());
  EXPECT_NEAR(rows.front().distance_ratio().value_or(0), 1, 0.28);
}

TEST(Tradeoff, WithoutATargetNothingIsComparedAndNothingInvented) {
  Config config = scene_config(1);
  dynamic_cast<simulator::Options&>(*config.source).detection.signal_per_pulse = 0;
  const auto rows = measured(config, {{5}, 20}, no_events);
  ASSERT_THAT(rows, Not(IsEmpty()));
  EXPECT_EQ(rows.front().no_value, 20u);
  EXPECT_FALSE(rows.front().distance_rmse_m);
  EXPECT_FALSE(rows.front().distance_bound_m);
  EXPECT_FALSE(rows.front().distance_ratio());
}

TEST(Tradeoff, ThePapersMethodIsMeasuredWhereAsked) {
  const auto rows = measured(scene_config(1), {{5}, 5, true}, no_events);
  ASSERT_THAT(rows, SizeIs(settings + 1));
  EXPECT_EQ(rows.back().setting.estimator.method, Method::paper);
  Config config = scene_config(1);
  config.estimator.method = Method::paper;
  for (const Row& row : measured(config, {{5}, 5}, no_events)) {
    EXPECT_EQ(row.setting.estimator.method, Method::search);
  }
}

TEST(Tradeoff, EachRowIsToldAsItIsMeasured) {
  std::vector<std::string> told;
  Events events = no_events;
  events.reckoned = [&](std::size_t rows, double) { told.push_back(std::to_string(rows)); };
  events.progress = [&](const std::string& doing, double, std::optional<double>) {
    const std::string what = doing.substr(0, doing.find_first_of(":"));
    if (told.empty() || told.back() != what) told.push_back(what);
  };
  events.row = [&](const Row& row) {
    told.push_back("row " + setting_name(row.setting.estimator));
  };
  events.length_done = [&](double length_ms) { told.push_back(std::to_string(length_ms)); };
  measured(scene_config(1), {{5}, 5}, events);
  std::vector<std::string> expected = {"trying frames of 5 ms"};
  std::vector<std::string> names;
  for (const Setting& setting : settings_of_length({}, 5, false)) {
    names.push_back(setting_name(setting.estimator));
    expected.push_back("trying " + names.back() + ", frames of 5 ms");
  }
  expected.push_back("5");
  expected.push_back("making frames of 5 ms");
  for (const std::string& name : names) {
    expected.push_back(name + ", frames of 5 ms");
    expected.push_back("row " + name);
  }
  expected.push_back("5.000000");
  EXPECT_THAT(told, ElementsAreArray(expected));
}

// By a clock that goes fifty times as far with each frame of effort fast as with the others.
TEST(Tradeoff, TheTimeLeftIsTrueFromTheStart) {
  struct Said {
    double done_s, left_s;
  };
  std::vector<Said> said;
  Events events = no_events;
  events.progress = [&](const std::string& doing, double done_s, std::optional<double> left_s) {
    step_ms = doing.find("fast") == std::string::npos ? 1 : 50;
    if (left_s) said.push_back({done_s, *left_s});
  };
  double reckoned_s = 0;
  events.reckoned = [&](std::size_t, double seconds) { reckoned_s = seconds; };
  measured(scene_config(1), {{5, 10}, 100}, events);
  step_ms = 1;
  ASSERT_THAT(said, Not(IsEmpty()));
  const double all_s = said.back().done_s;
  EXPECT_NEAR(reckoned_s, all_s - said.front().done_s, 0.5 * all_s);
  EXPECT_NEAR(said.back().left_s, 0, 0.02 * all_s);
  for (const Said& one : said) {
    EXPECT_NEAR((one.done_s + one.left_s) / all_s, 1, 0.5) << one.done_s;
  }
}

TEST(Tradeoff, AStopEndsItWithWhatIsThere) {
  std::stop_source stop;
  Events events = no_events;
  std::size_t estimated = 0;
  std::size_t lengths = 0;
  events.progress = [&](const std::string& doing, double, std::optional<double> left_s) {
    const bool estimates = left_s && doing.find("making") == std::string::npos;
    if (estimates && ++estimated == 30) stop.request_stop();
  };
  events.length_done = [&](double) { ++lengths; };
  const auto rows = measured(scene_config(1), {{5, 10}, 20}, events, stop.get_token());
  // 21 frames of the first setting, 9 of the second; the first frame of each is not judged.
  ASSERT_THAT(rows, SizeIs(2));
  EXPECT_EQ(rows[0].frames, 20u);
  EXPECT_EQ(rows[1].frames, 8u);
  EXPECT_EQ(lengths, 0u);
}

TEST(Tradeoff, AStopOfTheTrialsHasNoRows) {
  std::stop_source stop;
  Events events = no_events;
  events.progress = [&](const std::string&, double, std::optional<double>) { stop.request_stop(); };
  EXPECT_THAT(measured(scene_config(1), {{5, 10}, 20}, events, stop.get_token()), IsEmpty());
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

  ProgramResult run(std::vector<std::string> more, const std::string& frames = "12") const {
    std::vector<std::string> arguments = {"tradeoff", "--config", config,      "--plot", plot(),
                                          "--frames", frames,     "--lengths", "5,10"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(arguments);
  }
  [[nodiscard]] std::string plot() const { return folder.path("plot.svg"); }

  splid::test::TempFolder folder;
  std::string config;
};

TEST_F(TradeoffProgram, PrintsATableAndWritesIt) {
  const ProgramResult result = run({"--csv", folder.path("table.csv")}, "20");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("simulated target"), HasSubstr("balanced"),
                                HasSubstr("fast, tracked"), HasSubstr("no findings")));
  std::istringstream lines(file_text(folder.path("table.csv")));
  std::string line;
  std::getline(lines, line);
  EXPECT_THAT(line, AllOf(HasSubstr("effort,"), EndsWith(",chosen")));
  std::size_t rows = 0;
  std::size_t chosen = 0;
  for (; std::getline(lines, line); ++rows) chosen += line.ends_with(",true") ? 1 : 0;
  EXPECT_EQ(rows, 2 * settings);
  EXPECT_EQ(chosen, 1U);
}

// Python's tests look at what is drawn.
TEST_F(TradeoffProgram, WhatIsNotDrawnSaysWhyAndHow) {
  const std::string picture = folder.path("plot.nonsense");
  const ProgramResult result = run_program(
      {"tradeoff", "--config", config, "--plot", picture, "--frames", "12", "--lengths", "5"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const std::string table = folder.path("plot.csv");
  EXPECT_THAT(result.err,
              AllOf(HasSubstr("the table is in " + table), HasSubstr(picture + " is not drawn: "),
                    AnyOf(HasSubstr("python3 -m splid.plots tradeoff " + table + " " + picture),
                          HasSubstr("Format 'nonsense' is not supported"))));
  EXPECT_THAT(file_text(table), HasSubstr("effort,"));
}

// But for the times, which are of each run.
TEST_F(TradeoffProgram, SharesPutTogetherAreTheWhole) {
  const auto run_with = [&](const std::string& table, std::vector<std::string> more) {
    more.insert(more.end(), {"--lengths", "5,10,20", "--csv", folder.path(table)});
    std::vector<std::string> arguments = {
        "tradeoff", "--config", config, "--frames", "20", "--plot", folder.path("plot.nonsense")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(arguments);
  };
  // Columns 1 to 7 and 10 to 19.
  const auto facts_of = [&](const std::string& table) {
    std::istringstream lines(file_text(folder.path(table)));
    std::vector<std::string> facts;
    for (std::string line; std::getline(lines, line);) {
      std::istringstream fields(line);
      std::string fact;
      std::string field;
      for (int column = 1; column <= 19 && std::getline(fields, field, ','); ++column) {
        if (column != 8 && column != 9) fact += field + ",";
      }
      facts.push_back(fact);
    }
    return facts;
  };
  ASSERT_EQ(run_with("whole.csv", {}).exit_code, 0);
  for (const char* shard : {"1/4", "2/4", "3/4"}) {
    const ProgramResult share = run_with("t.csv", {"--shard", shard});
    EXPECT_EQ(share.exit_code, 0) << share.err;
    EXPECT_THAT(share.err, AllOf(HasSubstr("--merge 4"), Not(HasSubstr("is not drawn"))));
  }
  const ProgramResult missing = run_with("t.csv", {"--merge", "4"});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_THAT(missing.err, HasSubstr("t-4of4.csv"));
  const ProgramResult idle = run_with("t.csv", {"--shard", "4/4"});
  EXPECT_EQ(idle.exit_code, 0) << idle.err;
  EXPECT_THAT(idle.err, HasSubstr("no frame length is left for share 4/4"));
  const ProgramResult merged = run_with("t.csv", {"--merge", "4"});
  EXPECT_EQ(merged.exit_code, 0) << merged.err;
  EXPECT_THAT(merged.out, AllOf(HasSubstr("simulated target"), HasSubstr("recommended at 20 ms")));
  EXPECT_EQ(facts_of("t.csv"), facts_of("whole.csv"));
  EXPECT_EQ(facts_of("t.csv").size(), 1 + 3 * settings);
}

TEST_F(TradeoffProgram, PrintsARowALineAsJson) {
  const ProgramResult result = run({"--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  std::istringstream lines(result.out);
  std::size_t rows = 0;
  for (std::string line; std::getline(lines, line); ++rows) {
    const auto row = json_value(line);
    EXPECT_EQ(row.at("schema"), "splid.tradeoff");
    EXPECT_EQ(row.at("frames"), 12);
    EXPECT_GT(row.at("compute_ms_p50"), 0);
    EXPECT_GE(row.at("compute_ms_p99"), row.at("compute_ms_p50"));
  }
  EXPECT_EQ(rows, 2 * settings);
}

TEST_F(TradeoffProgram, ASeedGivesItsOwnFramesAgain) {
  const auto photons = [&](const char* seed) {
    const std::string out = run({"--json", "--seed", seed}).out;
    return json_value(out.substr(0, out.find('\n'))).at("photons").get<double>();
  };
  EXPECT_EQ(photons("7"), photons("7"));
  EXPECT_NE(photons("7"), photons("8"));
}

TEST_F(TradeoffProgram, TooFewFramesAreNoRecommendation) {
  const ProgramResult result = run({});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out,
              AllOf(HasSubstr("no setting is recommended"), HasSubstr("12 of 12 frames"),
                    HasSubstr("20 are needed"), Not(HasSubstr("\"estimator\""))));
  const ProgramResult budget = run({"--budget-ms", "10000"});
  EXPECT_EQ(budget.exit_code, 4);
  EXPECT_THAT(budget.err, HasSubstr("20 are needed"));
}

TEST_F(TradeoffProgram, ABudgetIsMetOrADataError) {
  const ProgramResult met = run({"--budget-ms", "10000"}, "20");
  EXPECT_EQ(met.exit_code, 0) << met.err;
  EXPECT_THAT(met.out, AllOf(HasSubstr("within 10000 ms"), HasSubstr("\"length_ms\": 10")));
  const ProgramResult missed = run({"--budget-ms", "0.000001"}, "20");
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

// Until it has printed the text on standard output, which is no terminal here; false after a
// minute.
bool has_printed(const splid::test::Program& program, const std::string& text) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds{60};
  while (std::chrono::steady_clock::now() < until) {
    if (program.out().find(text) != std::string::npos) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds{5});
  }
  return false;
}

// The paper's method alone would take minutes.
TEST_F(TradeoffProgram, ASignalEndsItWithTheRowsThatAreThere) {
  splid::test::Program program({"tradeoff", "--config", config, "--plot", plot(), "--lengths",
                                "5,200", "--frames", "50", "--paper"});
  ASSERT_TRUE(has_printed(program, "fast, tracked")) << program.err();
  program.signal(SIGINT);
  const ProgramResult result = program.wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, AllOf(HasSubstr("12 settings to measure: about"),
                                HasSubstr("stopped: this is what was measured so far")));
  EXPECT_THAT(file_text(folder.path("plot.csv")), HasSubstr("\nsearch,true,fast,on,5,"));
}

TEST_F(TradeoffProgram, ASignalBeforeTheFirstRowSaysSo) {
  splid::test::Program program({"tradeoff", "--config", config, "--plot", plot(), "--lengths", "5",
                                "--frames", "1000000", "--json"});
  while (program.err().find("frames of the configured scene") == std::string::npos) {
    std::this_thread::sleep_for(std::chrono::milliseconds{5});
  }
  program.signal(SIGINT);
  const ProgramResult result = program.wait();
  EXPECT_EQ(result.exit_code, 2) << result.err;
  EXPECT_THAT(result.err, HasSubstr("stopped before anything was measured"));
}

}  // namespace
}  // namespace splid::tradeoff
