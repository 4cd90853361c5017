#include "bench/studies/trial.hpp"

#include <gtest/gtest.h>

namespace splid::studies {
namespace {

Job bright_job(Estimator estimator, int trials) {
  return {{.study = Study::fig2, .mode = Mode::interleaved}, estimator, trials};
}

// 60 trials: the rms of 60 normal errors is within 0.27 of one (3 standard deviations).
TEST(Trial, ABrightCellIsAtItsBound) {
  const Job job = bright_job(Estimator::search, 60);
  const Expectation e = expect(job.cell);
  const std::optional<Score> found = run_job(job, e, {});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->right(), 60);
  EXPECT_NEAR(found->rmse[delay] / e.bound.delay_ns, 1, 0.27);
  EXPECT_NEAR(found->rmse[velocity] / e.bound.velocity_mps, 1, 0.27);
  EXPECT_NEAR(found->rmse[signal] / e.bound.signal_per_pulse, 1, 0.27);
  EXPECT_NEAR(found->rmse[background] / e.bound.background_per_ns, 1, 0.27);
}

TEST(Trial, TheSameJobGivesTheSameNumbers) {
  const Job job = bright_job(Estimator::search, 5);
  const Expectation e = expect(job.cell);
  EXPECT_EQ(run_job(job, e, {})->rmse, run_job(job, e, {})->rmse);
}

TEST(Trial, AStopGivesTheJobUp) {
  std::stop_source stop;
  stop.request_stop();
  const Job job = bright_job(Estimator::search, 5);
  EXPECT_FALSE(run_job(job, expect(job.cell), stop.get_token()));
}

// [P] Fig. 5: with 100 and 104 for 99.9 and 104.1 ns the theorem for whole numbers finds next to
// nothing; only delays of few turns survive the rounding.
TEST(Trial, WangsTheoremFailsOnPeriodsThatAreNoWholeNumbers) {
  const Job job{{.study = Study::fig5, .mode = Mode::mrr, .length_ms = 2}, Estimator::wang, 40};
  const std::optional<Score> found = run_job(job, expect(job.cell), {});
  ASSERT_TRUE(found);
  EXPECT_GT(found->wrong + found->no_value, 30);
}

}  // namespace
}  // namespace splid::studies
