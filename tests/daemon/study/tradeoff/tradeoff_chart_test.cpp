#include "daemon/study/tradeoff/tradeoff_chart.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace splid {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TradeoffRow chart_row(Effort effort, double length_ms, double p50_ms, double distance_mm) {
  TradeoffRow made;
  made.setting.estimator.effort = effort;
  made.setting.length_ms = length_ms;
  made.frames = 200;
  made.compared = 200;
  made.p50_ms = p50_ms;
  made.p99_ms = 1.5 * p50_ms;
  made.distance_rmse_m = distance_mm * 1e-3;
  made.distance_bound_m = 0.5e-3;
  made.velocity_rmse_mps = 0.043;
  made.velocity_bound_mps = 0.04;
  return made;
}

TradeoffReport chart_report(std::span<const TradeoffRow> rows) {
  TradeoffReport report;
  report.rows = rows;
  report.title = "a scene";
  return report;
}

std::vector<TradeoffRow> two_lengths() {
  return {chart_row(Effort::exhaustive, 20, 4, 0.9), chart_row(Effort::fast, 20, 1, 0.9),
          chart_row(Effort::exhaustive, 50, 9, 0.6), chart_row(Effort::fast, 50, 3, 0.6)};
}

std::vector<std::string> titles(const Chart& chart) {
  std::vector<std::string> all;
  for (const ChartPanel& panel : chart.panels) all.push_back(panel.title + ", " + panel.y.title);
  return all;
}

TEST(TradeoffChart, ShowsWhatAFrameCostsAgainstWhatItIsWorth) {
  const std::vector<TradeoffRow> rows = two_lengths();
  const Chart chart = tradeoff_chart(chart_report(rows));
  EXPECT_THAT(chart.subtitle, HasSubstr("a scene"));
  ASSERT_THAT(titles(chart),
              ElementsAre("Distance at mid-frame, RMSE, mm", "Velocity, RMSE, cm/s"));
  for (const ChartPanel& panel : chart.panels) {
    EXPECT_THAT(panel.x.title, HasSubstr("ms"));
    EXPECT_TRUE(panel.x.logarithmic && panel.y.logarithmic);
  }
  const ChartSeries& fast = chart.panels[0].series[1];
  EXPECT_EQ(fast.label, "fast");
  ASSERT_EQ(fast.points.size(), 2u) << "a curve through its lengths";
  EXPECT_EQ(fast.points[1].x, 3);
  EXPECT_DOUBLE_EQ(fast.points[1].y, 0.6);
  EXPECT_EQ(fast.points[1].label, "50 ms");
  EXPECT_DOUBLE_EQ(chart.panels[1].series[1].points[0].y, 4.3);
}

TEST(TradeoffChart, TheBoundIsALevelLineALength) {
  const std::vector<TradeoffRow> rows = two_lengths();
  const Chart chart = tradeoff_chart(chart_report(rows));
  const std::vector<ChartSeries>& series = chart.panels[0].series;
  ASSERT_EQ(series.size(), 4u);
  for (const std::size_t k : {2, 3}) {
    EXPECT_EQ(series[k].label, "Cramer-Rao bound");
    ASSERT_EQ(series[k].points.size(), 2u);
    EXPECT_DOUBLE_EQ(series[k].points[0].y, 0.5);
    EXPECT_DOUBLE_EQ(series[k].points[1].y, 0.5);
  }
  EXPECT_EQ(series[2].points[0].x, 1);
  EXPECT_EQ(series[2].points[1].x, 4);
}

TEST(TradeoffChart, NamesTheChosenPoint) {
  const std::vector<TradeoffRow> rows = two_lengths();
  TradeoffReport report = chart_report(rows);
  const auto callouts = [&] {
    std::vector<std::string> all;
    const Chart chart = tradeoff_chart(report);
    for (const ChartSeries& series : chart.panels[1].series) {
      for (const ChartPoint& point : series.points) {
        if (!point.callout.empty()) all.push_back(point.callout);
      }
    }
    return all;
  };
  EXPECT_THAT(callouts(), ElementsAre("chosen: fast, frames of 50 ms"));
  report.budget_ms = 2;
  EXPECT_THAT(callouts(), ElementsAre("chosen: fast, frames of 20 ms"));
  report.budget_ms = 0.1;
  EXPECT_THAT(callouts(), IsEmpty());
}

TEST(TradeoffChart, FramesThatAreLostHaveAPanelWhereThereAreAny) {
  std::vector<TradeoffRow> rows = two_lengths();
  rows[1].no_value = 10;
  EXPECT_THAT(titles(tradeoff_chart(chart_report(rows))),
              ElementsAre(HasSubstr("mm"), HasSubstr("cm/s"),
                          AllOf(HasSubstr("Missing frames"), HasSubstr("% of frames"))));
  rows[0].wrong_peaks = 1;
  const Chart chart = tradeoff_chart(chart_report(rows));
  ASSERT_EQ(chart.panels.size(), 4u);
  EXPECT_THAT(chart.panels[2].title, HasSubstr("Wrong frames"));
  EXPECT_DOUBLE_EQ(chart.panels[2].series[0].points[0].y, 0.5);
  EXPECT_DOUBLE_EQ(chart.panels[3].series[1].points[0].y, 5);
}

TEST(TradeoffChart, HasNoEmptyPanel) {
  std::vector<TradeoffRow> rows = two_lengths();
  for (TradeoffRow& one : rows) {
    one.velocity_rmse_mps.reset();
    one.velocity_bound_mps.reset();
  }
  EXPECT_THAT(titles(tradeoff_chart(chart_report(rows))), ElementsAre(HasSubstr("mm")));
  for (TradeoffRow& one : rows) one.distance_rmse_m.reset();
  EXPECT_THAT(tradeoff_chart(chart_report(rows)).panels, IsEmpty());
}

}  // namespace
}  // namespace splid
