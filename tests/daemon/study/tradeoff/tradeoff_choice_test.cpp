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

Row tracked_row(double length_ms, double p50_ms, double distance_mm, std::size_t wrong_peaks = 0,
                std::size_t no_value = 0) {
  Row made = choice_row(Effort::balanced, length_ms, p50_ms, distance_mm, wrong_peaks, no_value);
  made.setting.estimator.tracked = true;
  return made;
}

std::optional<std::size_t> within(const std::vector<Row>& rows, double budget_ms) {
  return find_within_budget(rows, budget_ms, {});
}

// The configured effort is `balanced`.
std::optional<std::size_t> knee(const std::vector<Row>& rows, double length_ms = 50) {
  return find_knee(rows, length_ms, {});
}

TEST(Knee, IsTheCheapestThatIsAsAccurate) {
  EXPECT_THAT(knee({choice_row(Effort::balanced, 50, 20, 0.6), tracked_row(50, 5, 0.609),
                    choice_row(Effort::fast, 50, 1, 0.62)}),
              Optional(1));
  EXPECT_THAT(knee({choice_row(Effort::balanced, 50, 20, 0.6), tracked_row(50, 5, 0.609),
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
  EXPECT_THAT(knee({choice_row(Effort::balanced, 50, 20, 0.6), tracked_row(50, 5, 0.6, 0, 3),
                    choice_row(Effort::fast, 50, 1, 0.6, 3, 0)}),
              Optional(0));
  // Where all lose some, the fewest; the accuracy of those that lose more does not count.
  EXPECT_THAT(knee({choice_row(Effort::balanced, 50, 20, 0.6, 3), tracked_row(50, 5, 0.6, 3),
                    choice_row(Effort::fast, 50, 1, 0.3, 6)}),
              Optional(1));
}

// Two frames of 200.
TEST(Knee, IsNotDecidedByTheChanceOfAFrame) {
  EXPECT_THAT(
      knee({choice_row(Effort::balanced, 50, 5, 0.6), choice_row(Effort::fast, 50, 1, 0.6, 1, 1)}),
      Optional(1));
}

TEST(Knee, LeavesTheConfiguredSettingWhereTheOthersSaveNothing) {
  EXPECT_THAT(knee({tracked_row(50, 1.2, 0.6), choice_row(Effort::balanced, 50, 1.2, 0.6),
                    choice_row(Effort::fast, 50, 1, 0.6)}),
              Optional(1));
  EXPECT_THAT(knee({tracked_row(50, 1.2, 0.6), choice_row(Effort::balanced, 50, 1.3, 0.6),
                    choice_row(Effort::fast, 50, 1, 0.6)}),
              Optional(0))
      << "with the configured effort";
  EXPECT_THAT(knee({tracked_row(50, 1.3, 0.6), choice_row(Effort::balanced, 50, 1.3, 0.6),
                    choice_row(Effort::fast, 50, 1, 0.6)}),
              Optional(2));
}

TEST(Knee, OfFramesOnTheirOwnIsNotTracked) {
  const std::vector<Row> rows = {choice_row(Effort::balanced, 50, 1.3, 0.6),
                                 tracked_row(50, 0.3, 0.6)};
  EXPECT_THAT(knee(rows), Optional(1));
  EXPECT_THAT(find_knee(rows, 50, {}, KneeOf::frames_on_their_own), Optional(0));
  EXPECT_THAT(within(rows, 1), Optional(1));
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
  EXPECT_EQ(within({nothing}, 10), std::nullopt);
}

// An RMSE of four frames is chance, and an RMSE of no frames is no figure at all.
TEST(Choice, IsMadeByEnoughFrames) {
  std::vector<Row> rows = {choice_row(Effort::balanced, 50, 1, 0.6)};
  rows[0].compared = fewest_frames_to_choose + 2;
  rows[0].wrong_peaks = 2;
  EXPECT_THAT(knee(rows), Optional(0));
  EXPECT_THAT(within(rows, 10), Optional(0));
  rows[0].wrong_peaks = 3;
  EXPECT_EQ(knee(rows), std::nullopt);
  EXPECT_EQ(within(rows, 10), std::nullopt);
}

TEST(Choice, TakesNoErrorOfNothing) {
  std::vector<Row> rows = {choice_row(Effort::balanced, 50, 1, 0)};
  EXPECT_EQ(knee(rows), std::nullopt);
  EXPECT_EQ(within(rows, 10), std::nullopt);
  rows[0] = choice_row(Effort::balanced, 50, 1, 0.6);
  rows[0].velocity_bound_mps = 0.04;
  rows[0].velocity_rmse_mps.reset();
  EXPECT_EQ(knee(rows), std::nullopt);
}

// The table does not show what findings save from.
TEST(Choice, HasTheFindingsOfTheConfiguration) {
  std::vector<Row> rows = {choice_row(Effort::balanced, 50, 2, 0.6),
                           choice_row(Effort::balanced, 50, 1, 0.6)};
  rows[1].setting.estimator.findings = FindingsWanted::off;
  EXPECT_THAT(knee(rows), Optional(0));
  EXPECT_THAT(within(rows, 10), Optional(0));
  EXPECT_THAT(find_knee(rows, 50, rows[1].setting.estimator), Optional(1));
}

TEST(Choice, IsNeverThePapersMethod) {
  std::vector<Row> rows = {choice_row(Effort::balanced, 50, 2, 0.6, 3),
                           choice_row(Effort::balanced, 50, 1, 0.3)};
  rows[1].setting.estimator.method = Method::paper;
  EXPECT_THAT(knee(rows), Optional(0));
  EXPECT_THAT(find_knee(rows, 50, rows[1].setting.estimator), Optional(0));
  EXPECT_THAT(within(rows, 10), Optional(0));
}

// p99 is twice p50 in these rows.
TEST(Budget, IsKeptByTheNinetyNinthPercentile) {
  const std::vector<Row> rows = {tracked_row(50, 4, 0.5), choice_row(Effort::balanced, 50, 2, 0.6),
                                 choice_row(Effort::fast, 50, 1, 0.7)};
  EXPECT_THAT(within(rows, 8), Optional(0));
  EXPECT_THAT(within(rows, 7.9), Optional(1));
  EXPECT_THAT(within(rows, 3.9), Optional(2));
  EXPECT_EQ(within(rows, 1.9), std::nullopt);
}

TEST(Budget, NoFrameTakesLongerThanItLasts) {
  const std::vector<Row> rows = {choice_row(Effort::balanced, 5, 3, 0.5),
                                 choice_row(Effort::fast, 5, 1, 0.6)};
  EXPECT_THAT(within(rows, 100), Optional(1));
}

TEST(Budget, PrefersFramesThatAreNotLostThenAccuracyThenTime) {
  EXPECT_THAT(
      within({choice_row(Effort::fast, 20, 1, 0.5, 3), choice_row(Effort::balanced, 50, 2, 0.6)},
             10),
      Optional(1));
  EXPECT_THAT(
      within({choice_row(Effort::balanced, 50, 2, 0.6), choice_row(Effort::balanced, 200, 4, 0.3)},
             10),
      Optional(1));
  EXPECT_THAT(within({tracked_row(50, 3, 0.6), choice_row(Effort::balanced, 50, 2, 0.605)}, 10),
              Optional(1));
}

TEST(Budget, DistanceAndVelocityCountAlike) {
  std::vector<Row> rows = {choice_row(Effort::balanced, 50, 2, 0.6),
                           choice_row(Effort::balanced, 200, 3, 0.66)};
  rows[1].velocity_rmse_mps = 0.03;
  EXPECT_THAT(within(rows, 10), Optional(1));
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
