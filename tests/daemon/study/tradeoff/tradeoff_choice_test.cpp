#include "daemon/study/tradeoff/tradeoff_choice.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace splid::tradeoff {
namespace {

using ::testing::HasSubstr;
using ::testing::Optional;

Row choice_row(Effort effort, double length_ms, double p50_ms, double distance_mm,
               std::size_t wrong_peaks = 0, std::size_t no_value = 0) {
  Row made;
  made.setting.estimator.effort = effort;
  made.setting.length_ms = length_ms;
  made.frames = 200;
  made.compared = 200;
  made.p50_ms = p50_ms;
  made.p99_ms = 2 * p50_ms;
  made.distance_rmse_m = distance_mm * 1e-3;
  made.velocity_rmse_mps = 0.04;
  made.wrong_peaks = wrong_peaks;
  made.no_value = no_value;
  return made;
}

// The configured effort is `balanced`.
std::optional<std::size_t> knee(const std::vector<Row>& rows, double length_ms = 50) {
  return find_knee(rows, length_ms, {});
}

TEST(Knee, IsTheCheapestThatIsAsAccurate) {
  EXPECT_THAT(
      knee({choice_row(Effort::exhaustive, 50, 20, 0.6), choice_row(Effort::balanced, 50, 5, 0.609),
            choice_row(Effort::fast, 50, 1, 0.62)}),
      Optional(1));
  EXPECT_THAT(
      knee({choice_row(Effort::exhaustive, 50, 20, 0.6), choice_row(Effort::balanced, 50, 5, 0.609),
            choice_row(Effort::fast, 50, 1, 0.611)}),
      Optional(2));
}

TEST(Knee, ComparesVelocitiesToo) {
  std::vector<Row> rows = {choice_row(Effort::balanced, 50, 5, 0.6),
                           choice_row(Effort::fast, 50, 1, 0.6)};
  rows[1].velocity_rmse_mps = 0.041;
  EXPECT_THAT(knee(rows), Optional(0));
  rows[1].velocity_rmse_mps.reset();
  rows[0].velocity_rmse_mps.reset();
  EXPECT_THAT(knee(rows), Optional(1));
}

TEST(Knee, LosesNoMoreFramesThanAnyOther) {
  EXPECT_THAT(knee({choice_row(Effort::exhaustive, 50, 20, 0.6),
                    choice_row(Effort::balanced, 50, 5, 0.6, 0, 1),
                    choice_row(Effort::fast, 50, 1, 0.6, 1, 0)}),
              Optional(0));
  // Where all lose some, the fewest; the accuracy of those that lose more does not count.
  EXPECT_THAT(
      knee({choice_row(Effort::exhaustive, 50, 20, 0.6, 3),
            choice_row(Effort::balanced, 50, 5, 0.6, 3), choice_row(Effort::fast, 50, 1, 0.3, 4)}),
      Optional(1));
}

TEST(Knee, LeavesTheConfiguredSettingWhereTheOthersSaveNothing) {
  EXPECT_THAT(
      knee({choice_row(Effort::exhaustive, 50, 1.05, 0.6),
            choice_row(Effort::balanced, 50, 1.05, 0.6), choice_row(Effort::fast, 50, 1, 0.6)}),
      Optional(1));
  EXPECT_THAT(
      knee({choice_row(Effort::exhaustive, 50, 1.05, 0.6),
            choice_row(Effort::balanced, 50, 1.2, 0.6), choice_row(Effort::fast, 50, 1, 0.6)}),
      Optional(2));
}

TEST(Knee, IsTrackedOnlyWhereTheConfiguredSettingIs) {
  std::vector<Row> rows = {choice_row(Effort::balanced, 50, 1.2, 0.6),
                           choice_row(Effort::balanced, 50, 0.3, 0.6)};
  rows[1].setting.estimator.tracked = true;
  EXPECT_THAT(find_knee(rows, 50, {}), Optional(0));
  EXPECT_THAT(find_knee(rows, 50, {.tracked = true}), Optional(1));
  EXPECT_THAT(find_within_budget(rows, 1), Optional(1));
}

TEST(Knee, IsOfOneLength) {
  const std::vector<Row> rows = {choice_row(Effort::balanced, 20, 1, 0.9),
                                 choice_row(Effort::balanced, 50, 2, 0.6)};
  EXPECT_THAT(knee(rows, 20), Optional(0));
  EXPECT_THAT(knee(rows, 50), Optional(1));
  EXPECT_EQ(knee(rows, 100), std::nullopt);
}

TEST(Knee, IsNoneWhereNothingWasCompared) {
  Row nothing = choice_row(Effort::balanced, 50, 1, 0, 0, 200);
  nothing.distance_rmse_m.reset();
  EXPECT_EQ(knee({nothing}), std::nullopt);
  EXPECT_EQ(find_within_budget(std::vector{nothing}, 10), std::nullopt);
}

// An RMSE of four frames is chance, and an RMSE of no frames is no figure at all.
TEST(Choice, IsMadeByEnoughFrames) {
  std::vector<Row> rows = {choice_row(Effort::balanced, 50, 1, 0.6)};
  rows[0].compared = fewest_frames_to_choose + 2;
  rows[0].wrong_peaks = 2;
  EXPECT_THAT(knee(rows), Optional(0));
  EXPECT_THAT(find_within_budget(rows, 10), Optional(0));
  rows[0].wrong_peaks = 3;
  EXPECT_EQ(knee(rows), std::nullopt);
  EXPECT_EQ(find_within_budget(rows, 10), std::nullopt);
}

TEST(Choice, TakesNoErrorOfNothing) {
  std::vector<Row> rows = {choice_row(Effort::balanced, 50, 1, 0)};
  EXPECT_EQ(knee(rows), std::nullopt);
  EXPECT_EQ(find_within_budget(rows, 10), std::nullopt);
  rows[0] = choice_row(Effort::balanced, 50, 1, 0.6);
  rows[0].velocity_bound_mps = 0.04;
  rows[0].velocity_rmse_mps.reset();
  EXPECT_EQ(knee(rows), std::nullopt);
}

TEST(Choice, IsNeverThePapersMethod) {
  std::vector<Row> rows = {choice_row(Effort::balanced, 50, 2, 0.6, 3),
                           choice_row(Effort::balanced, 50, 1, 0.3)};
  rows[1].setting.estimator.method = Method::paper;
  EXPECT_THAT(knee(rows), Optional(0));
  EXPECT_THAT(find_knee(rows, 50, rows[1].setting.estimator), Optional(0));
  EXPECT_THAT(find_within_budget(rows, 10), Optional(0));
}

// p99 is twice p50 in these rows.
TEST(Budget, IsKeptByTheNinetyNinthPercentile) {
  const std::vector<Row> rows = {choice_row(Effort::exhaustive, 50, 4, 0.5),
                                 choice_row(Effort::balanced, 50, 2, 0.6),
                                 choice_row(Effort::fast, 50, 1, 0.7)};
  EXPECT_THAT(find_within_budget(rows, 8), Optional(0));
  EXPECT_THAT(find_within_budget(rows, 7.9), Optional(1));
  EXPECT_THAT(find_within_budget(rows, 3.9), Optional(2));
  EXPECT_EQ(find_within_budget(rows, 1.9), std::nullopt);
}

TEST(Budget, NoFrameTakesLongerThanItLasts) {
  const std::vector<Row> rows = {choice_row(Effort::exhaustive, 5, 3, 0.5),
                                 choice_row(Effort::fast, 5, 1, 0.6)};
  EXPECT_THAT(find_within_budget(rows, 100), Optional(1));
}

TEST(Budget, PrefersFramesThatAreNotLostThenAccuracyThenTime) {
  EXPECT_THAT(find_within_budget(std::vector{choice_row(Effort::fast, 20, 1, 0.5, 1),
                                             choice_row(Effort::balanced, 50, 2, 0.6)},
                                 10),
              Optional(1));
  EXPECT_THAT(find_within_budget(std::vector{choice_row(Effort::balanced, 50, 2, 0.6),
                                             choice_row(Effort::balanced, 200, 4, 0.3)},
                                 10),
              Optional(1));
  EXPECT_THAT(find_within_budget(std::vector{choice_row(Effort::exhaustive, 50, 3, 0.6),
                                             choice_row(Effort::balanced, 50, 2, 0.605)},
                                 10),
              Optional(1));
}

TEST(Budget, DistanceAndVelocityCountAlike) {
  std::vector<Row> rows = {choice_row(Effort::balanced, 50, 2, 0.6),
                           choice_row(Effort::balanced, 200, 3, 0.66)};
  rows[1].velocity_rmse_mps = 0.03;
  EXPECT_THAT(find_within_budget(rows, 10), Optional(1));
}

TEST(ConfigurationLines, HoldWhatTheSettingIs) {
  Setting setting;
  setting.length_ms = 20;
  setting.estimator.effort = Effort::fast;
  const std::string lines = configuration_lines(setting);
  EXPECT_THAT(lines, HasSubstr("\"frame\": {\"length_ms\": 20}"));
  EXPECT_THAT(lines, HasSubstr("\"effort\":\"fast\""));
  EXPECT_THAT(lines, HasSubstr("\"method\":\"search\""));
}

}  // namespace
}  // namespace splid::tradeoff
