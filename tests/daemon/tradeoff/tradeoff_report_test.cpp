#include "daemon/tradeoff/tradeoff_report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/daemon_scene.hpp"

namespace splid {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TradeoffRow row(Effort effort, double length_ms, double p50_ms) {
  TradeoffRow made;
  made.setting.estimator.effort = effort;
  made.setting.length_ms = length_ms;
  made.frames = 200;
  made.compared = 199;
  made.photons = 9470;
  made.p50_ms = p50_ms;
  made.p99_ms = 1.5 * p50_ms;
  made.no_value = 1;
  made.distance_rmse_m = 0.62e-3;
  made.distance_bound_m = 0.5e-3;
  made.velocity_rmse_mps = 0.043;
  made.velocity_bound_mps = 0.04;
  return made;
}

const std::vector<TradeoffRow> rows = {row(Effort::exhaustive, 20, 4), row(Effort::fast, 20, 1),
                                       row(Effort::exhaustive, 50, 9), row(Effort::fast, 50, 3)};

TradeoffReport report_of(std::span<const TradeoffRow> of) {
  return {of, ErrorsAgainst::scene, "a scene", {}, std::nullopt};
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

TEST(TradeoffTable, HasALineASettingAndMarksTheKnees) {
  TradeoffReport report = report_of(rows);
  report.budget_ms = 5;
  const auto lines = lines_of(tradeoff_table(report));
  ASSERT_EQ(lines.size(), 3 + rows.size());
  EXPECT_EQ(lines[3],
            "     20  exhaustive               4        6     0.62   1.240       4.3   1.075       "
            " 0      "
            "1     200");
  EXPECT_THAT(lines[4], HasSubstr("200 *"));
  EXPECT_THAT(lines[5], Not(HasSubstr("*")));
  EXPECT_THAT(lines[6], HasSubstr("200 *"));
  EXPECT_THAT(lines[4] + lines[6], HasSubstr(" <"));
}

TEST(TradeoffTable, ShowsADashForWhatIsNotKnown) {
  TradeoffRow nothing;
  nothing.frames = 200;
  nothing.no_value = 200;
  const auto lines = lines_of(tradeoff_table(report_of(std::vector{nothing})));
  EXPECT_EQ(std::count(lines.back().begin(), lines.back().end(), '-'), 4);
}

TEST(TradeoffJson, IsAnObjectALine) {
  const auto lines = lines_of(tradeoff_json(report_of(rows)));
  ASSERT_EQ(lines.size(), rows.size());
  EXPECT_EQ(
      lines[1],
      R"({"schema":"splid.tradeoff","v":[1,0],)"
      R"("method":"search","tracked":false,"effort":"fast","length_ms":20,"frames":200,"photons":9470,)"
      R"("compute_ms_p50":1,"compute_ms_p99":1.5,"reference":"scene","compared":199,)"
      R"("distance_rmse_m":0.00062,"distance_bound_m":5e-04,)"
      R"("distance_rmse_over_bound":1.24,"velocity_rmse_mps":0.043,)"
      R"("velocity_bound_mps":0.04,"velocity_rmse_over_bound":1.075,)"
      R"("wrong_peaks":0,"no_value":1,"knee":true})");
  TradeoffRow rest = rows[0];
  rest.velocity_rmse_mps.reset();
  EXPECT_THAT(tradeoff_json(report_of(std::vector{rest})), Not(HasSubstr("velocity_rmse")));
}

TEST(TradeoffCsv, HasTheMembersOfTheJsonAsColumns) {
  TradeoffReport report = report_of(rows);
  report.budget_ms = 100;
  const auto lines = lines_of(tradeoff_csv(report));
  ASSERT_EQ(lines.size(), 1 + rows.size());
  for (const std::string& line : lines) {
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), 19) << line;
  }
  EXPECT_THAT(lines[0],
              AllOf(HasSubstr("method,tracked,effort,length_ms"), HasSubstr("knee,within_budget")));
  EXPECT_THAT(lines[2], HasSubstr("fast,20,200,9470,1,1.5,scene,"));
}

TEST(TradeoffChart, HasAPanelAQuantityAndASeriesASetting) {
  const Chart chart = tradeoff_chart(report_of(rows));
  ASSERT_EQ(chart.panels.size(), 3u);
  EXPECT_THAT(chart.subtitle, HasSubstr("a scene"));
  for (std::size_t panel = 0; panel < 3; ++panel) {
    std::vector<std::string> names;
    for (const ChartSeries& series : chart.panels[panel].series) names.push_back(series.label);
    if (panel < 2) {
      EXPECT_THAT(names, ElementsAre("exhaustive", "fast", "Cramer-Rao bound"));
    } else {
      EXPECT_THAT(names, ElementsAre("exhaustive", "fast"));
    }
    EXPECT_THAT(chart.panels[panel].x.title, HasSubstr("ms"));
    EXPECT_TRUE(chart.panels[panel].x.logarithmic);
  }
  const ChartPoint& point = chart.panels[1].series[1].points[1];
  EXPECT_EQ(point.x, 3);
  EXPECT_EQ(point.x_range->high, 4.5);
  EXPECT_DOUBLE_EQ(point.y, 1.075);
  EXPECT_EQ(point.label, "50");
  EXPECT_DOUBLE_EQ(chart.panels[2].series[0].points[0].y, 0.5);
}

TEST(TradeoffAdvice, NamesTheKneeOrWhatTheBudgetAllowsAndItsLines) {
  TradeoffReport report = report_of(rows);
  const std::string knee = tradeoff_advice(report, 50);
  EXPECT_THAT(knee, AllOf(HasSubstr("knee at 50 ms (*): fast"), HasSubstr("\"effort\":\"fast\""),
                          HasSubstr("\"length_ms\": 50")));
  report.budget_ms = 2;
  EXPECT_THAT(tradeoff_advice(report, 50),
              AllOf(HasSubstr("knee at 50 ms"), HasSubstr("within 2 ms"), HasSubstr("frames of 20"),
                    HasSubstr("\"length_ms\": 20"), Not(HasSubstr("\"length_ms\": 50"))));
}

TEST(TradeoffTitle, NamesTheScene) {
  const Config config = scene_config(1);
  EXPECT_EQ(
      tradeoff_title(config, find_origin(config, "")),
      "interleaved, 40 pulses in 3780 ns; S 0.00135, b 175000 /s; 284.5 m \u00b1 4 m in 20 s");
}

}  // namespace
}  // namespace splid
