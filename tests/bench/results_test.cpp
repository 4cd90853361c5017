#include "bench/studies/results.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "protocol/error.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid::studies {
namespace {

Result made_result(int trials) {
  Result result;
  result.job = {
      {.study = Study::fig4, .mode = Mode::random, .velocity_mps = -25}, Estimator::paper, trials};
  result.expectation = {.length_ns = 98280, .chance_lost = 1e-7, .bound = {.delay_ns = 0.0244}};
  result.score.trials = trials;
  result.score.no_value = 1;
  result.score.wrong = 2;
  result.score.ambiguous = 5;
  result.score.wrong_ok = 1;
  result.score.rmse = {0.1, 1.0 / 3, 1e-17, 4, 0.2};
  result.score.rmse_all = {0.3, 1e300, 3, 2, 1};
  result.score.took_s = 2.5;
  result.score.inside_two = {0.1, 0.2, 0.3, 0.4};
  result.score.p99_ms = 3.5;
  result.machine = "Some Processor @ 2.80GHz";
  result.date = "2026-11-21";
  return result;
}

TEST(Results, ALineReadsBackToTheLastBit) {
  const Result result = made_result(1000);
  const std::optional<Result> back = from_csv(to_csv(result));
  ASSERT_TRUE(back);
  EXPECT_EQ(key(back->job), key(result.job));
  EXPECT_EQ(back->score.trials, 1000);
  EXPECT_EQ(back->score.no_value, 1);
  EXPECT_EQ(back->score.wrong, 2);
  EXPECT_EQ(back->score.ambiguous, 5);
  EXPECT_EQ(back->score.wrong_ok, 1);
  EXPECT_EQ(back->score.rmse, result.score.rmse);
  EXPECT_EQ(back->score.rmse_all, result.score.rmse_all);
  EXPECT_EQ(back->score.took_s, 2.5);
  EXPECT_EQ(back->score.inside_two, result.score.inside_two);
  EXPECT_EQ(back->score.p99_ms, 3.5);
  EXPECT_EQ(back->expectation.chance_lost, 1e-7);
  EXPECT_EQ(back->expectation.bound.delay_ns, 0.0244);
  EXPECT_EQ(back->machine, result.machine);
  EXPECT_EQ(back->date, result.date);
  EXPECT_FALSE(from_csv(to_csv(result).substr(10)));
  EXPECT_FALSE(from_csv(""));
}

TEST(Results, ACutLineIsTakenAwayAndTheRunGoesOn) {
  const test::TempFolder folder;
  const auto file = folder.path("results.csv");
  ResultFile(file).append(made_result(10));
  const auto whole = std::filesystem::file_size(file);
  std::ofstream(file, std::ios::app) << "fig2,baseline,bal";
  EXPECT_EQ(read_results(folder.path("")).size(), 1U);
  Result other = made_result(10);
  other.job.cell.velocity_mps = 25;
  ResultFile(file).append(other);
  EXPECT_EQ(read_results(folder.path("")).size(), 2U);
  EXPECT_GT(std::filesystem::file_size(file), whole);
}

TEST(Results, OfSeveralRunsTheOneOfMostTrialsCounts) {
  const test::TempFolder folder;
  ResultFile(folder.path("results-1of2.csv")).append(made_result(1000));
  ResultFile(folder.path("results-2of2.csv")).append(made_result(10));
  const Results results = read_results(folder.path(""));
  ASSERT_EQ(results.size(), 1U);
  EXPECT_EQ(results.begin()->second.score.trials, 1000);
}

TEST(Results, AForeignFileIsNamed) {
  const test::TempFolder folder;
  std::ofstream(folder.path("other.csv")) << "a,b\n1,2\n";
  try {
    read_results(folder.path(""));
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("other.csv"), std::string::npos);
  }
}

}  // namespace
}  // namespace splid::studies
