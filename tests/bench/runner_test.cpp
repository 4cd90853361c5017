#include "bench/studies/runner.hpp"

#include <gtest/gtest.h>

#include "tests/support/temp_folder.hpp"

namespace splid::studies {
namespace {

Result good_result() {
  Result result;
  result.job = {{.study = Study::fig2, .mode = Mode::interleaved, .velocity_mps = 30},
                Estimator::search,
                800};
  result.expectation = expect(result.job.cell);
  result.score.trials = 800;
  const Bound& bound = result.expectation.bound;
  result.score.rmse = {bound.delay_ns, bound.velocity_mps, bound.signal_per_pulse,
                       bound.background_per_ns};
  return result;
}

std::size_t faults_of(const Result& result) {
  return faults_of_search({{key(result.job), result}}).size();
}

// 800 trials: 2.5 % a standard error, so 1.05 * 1.1 is allowed.
TEST(Faults, OfTheSearchAreFound) {
  Result result = good_result();
  EXPECT_EQ(faults_of(result), 0U);
  result.score.rmse[velocity] *= 1.15;
  EXPECT_EQ(faults_of(result), 0U);
  result.score.rmse[velocity] *= 1.02;
  EXPECT_EQ(faults_of(result), 1U);
  result.score.rmse[delay] *= 2;
  EXPECT_EQ(faults_of(result), 2U);
  result = good_result();
  result.score.wrong = 1;
  EXPECT_EQ(faults_of(result), 1U);
}

// Six wrong of 800 that are ok are more than the risk of 1e-3 and chance; in any cell.
TEST(Faults, OfTheOddsAreFound) {
  Result result = good_result();
  result.score.ambiguous = result.score.wrong_ok = 0;
  EXPECT_EQ(faults_of(result), 0U);
  result.score.ambiguous = 1;
  EXPECT_EQ(faults_of(result), 1U);
  result.expectation.chance_lost = 0.5;
  EXPECT_EQ(faults_of(result), 0U);
  result.score.wrong_ok = 1;
  EXPECT_EQ(faults_of(result), 0U);
  result.score.wrong_ok = 6;
  EXPECT_EQ(faults_of(result), 1U);
}

TEST(Faults, AreNoneWherePhotonsDoNotDecideOrAnotherEstimatorRan) {
  Result result = good_result();
  result.score.wrong = 400;
  result.score.rmse[delay] *= 2;
  result.job.estimator = Estimator::paper;
  EXPECT_EQ(faults_of(result), 0U);
  result.job.estimator = Estimator::search;
  result.expectation.chance_lost = 0.5;
  EXPECT_EQ(faults_of(result), 0U);
}

TEST(Runner, ResultsAreTheSameForAnyNumberOfThreads) {
  std::vector<Job> jobs;
  for (const Job& job : quick_jobs(4)) {
    if (job.estimator == Estimator::search && job.cell.study == Study::fig2) jobs.push_back(job);
  }
  std::vector<Results> found(2);
  for (const int threads : {1, 2}) {
    const test::TempFolder folder;
    Results& results = found[static_cast<std::size_t>(threads - 1)];
    run_jobs(jobs, threads, 60, {}, ResultFile(folder.path("results.csv")), results);
    EXPECT_EQ(read_results(folder.path("")).size(), jobs.size());
  }
  ASSERT_EQ(found[0].size(), jobs.size());
  for (const auto& [name, result] : found[0]) {
    EXPECT_EQ(result.score.rmse, found[1].at(name).score.rmse);
  }
}

TEST(Runner, AStopLeavesNothingHalfDone) {
  const test::TempFolder folder;
  std::stop_source stop;
  stop.request_stop();
  Results results;
  run_jobs(quick_jobs(4), 2, 60, stop.get_token(), ResultFile(folder.path("results.csv")), results);
  EXPECT_TRUE(results.empty());
  EXPECT_TRUE(read_results(folder.path("")).empty());
}

}  // namespace
}  // namespace splid::studies
