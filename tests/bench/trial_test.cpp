#include "bench/studies/trial.hpp"

#include <gtest/gtest.h>

namespace splid::studies {
namespace {

Job bright_job(Estimator estimator, int trials) {
  return {{.study = Study::fig2, .mode = Mode::interleaved, .velocity_mps = 30}, estimator, trials};
}

// 60 trials: the rms of 60 normal errors is within 0.27 of one (3 standard deviations).
TEST(Trial, ABrightCellIsAtItsBound) {
  const Job job = bright_job(Estimator::search, 60);
  const Expectation e = expect(job.cell);
  const std::optional<Score> found = run_job(job, e, {});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->right(), 60);
  EXPECT_NEAR(found->rmse[delay] / e.bound.delay_ns, 1, 0.27);
  EXPECT_NEAR(found->rmse[delay_start] / e.bound.delay_start_ns, 1, 0.27);
  EXPECT_EQ(found->rmse_all, found->rmse);  // there are no wrong peaks
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

// The first trial is there whatever the time, and no other begins after it.
TEST(Trial, TheTimeOfACellEndsIt) {
  const Job job = bright_job(Estimator::search, 1'000'000);
  const std::optional<Score> found = run_job(job, expect(job.cell), {}, 1e-9);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->trials, 1);
  EXPECT_GT(found->took_s, 0);
}

Score fig5_score(Estimator estimator) {
  const Job job{
      {.study = Study::fig5, .mode = Mode::interleaved, .velocity_mps = 30}, estimator, 60};
  return run_job(job, expect(job.cell), {}).value();
}

// [P] Fig. 5. With 100 and 104 for 99.9 and 104.1 ns the ten turns of this delay make one remainder
// 1 ns too large and the other 1 ns too small. That is a quarter of their common divisor, the most
// that the theorem bears, so that half of the frames are a turn off. The refinement stays within
// ten pulse widths and cannot mend that. The mixed-integer program is right in all of them.
TEST(Trial, WangsTheoremFailsOnPeriodsThatAreNoWholeNumbers) {
  const Score wang = fig5_score(Estimator::wang);
  const Score wang_start = fig5_score(Estimator::wang_start);
  EXPECT_GT(wang.wrong, 15);
  EXPECT_EQ(wang.no_value, 0);
  EXPECT_GT(wang.rmse_all[delay_start], 1);
  const Score paper = fig5_score(Estimator::paper);
  const Score paper_start = fig5_score(Estimator::paper_start);
  EXPECT_EQ(paper.wrong, 0);
  EXPECT_LT(paper.rmse_all[delay_start], 0.03);
  EXPECT_LT(paper.rmse_all[delay_start], paper_start.rmse_all[delay_start]);
  EXPECT_NE(wang.rmse_all, wang_start.rmse_all);
}

}  // namespace
}  // namespace splid::studies
