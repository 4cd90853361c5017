#include "daemon/study/tradeoff/tradeoff_report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/daemon_scene.hpp"

namespace splid::tradeoff {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

Row row(Effort effort, double length_ms, double p50_ms) {
  Row made;
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
  made.distance_interval_m = {0.56e-3, 0.7e-3};
  return made;
}

const std::vector<Row> rows = {row(Effort::balanced, 20, 4), row(Effort::fast, 20, 1),
                               row(Effort::balanced, 50, 9), row(Effort::fast, 50, 3)};

Report report_of(std::span<const Row> of) {
  return {of, ErrorsAgainst::scene, {}, 50, std::nullopt, std::nullopt};
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

TEST(TradeoffTable, HasALineASettingUnderItsNames) {
  const auto head = lines_of(table_head(ErrorsAgainst::scene));
  ASSERT_EQ(head.size(), 3u);
  EXPECT_EQ(
      table_line(rows[0]),
      "     20  balanced                   4        6     0.62   +13 %   1.240      4.3       -   "
      "1.075      0      1     200");
  EXPECT_EQ(head[2].size(), table_line(rows[0]).size());
}

TEST(TradeoffTable, ALengthEndsWithItsKnee) {
  Report report = report_of(rows);
  EXPECT_EQ(knee_line(report, 20), "     20  knee: fast");
  report.stopped_in_ms = 50;
  EXPECT_EQ(knee_line(report, 20), "     20  knee: fast");
  EXPECT_EQ(knee_of(report, 50), std::nullopt) << "the rest of its settings may be better";
}

TEST(TradeoffTable, ShowsADashForWhatIsNotKnown) {
  Row nothing;
  nothing.frames = 200;
  nothing.no_value = 200;
  const std::string line = table_line(nothing);
  EXPECT_EQ(std::count(line.begin(), line.end(), '-'), 6);
}

TEST(TradeoffJson, IsAnObjectALine) {
  EXPECT_EQ(
      row_json(report_of(rows), 1),
      R"({"schema":"splid.tradeoff","v":[1,1],)"
      R"("method":"search","tracked":false,"effort":"fast","findings":"on","length_ms":20,"frames":200,"photons":9470,)"
      R"("compute_ms_p50":1,"compute_ms_p99":1.5,"reference":"scene","compared":199,)"
      R"("distance_rmse_m":0.00062,"distance_rmse_low_m":0.00056,"distance_rmse_high_m":7e-04,)"
      R"("distance_bound_m":5e-04,)"
      R"("distance_rmse_over_bound":1.24,"velocity_rmse_mps":0.043,)"
      R"("velocity_bound_mps":0.04,"velocity_rmse_over_bound":1.075,)"
      R"("wrong_peaks":0,"no_value":1,"knee":true})");
  Row rest = rows[0];
  rest.velocity_rmse_mps.reset();
  EXPECT_THAT(row_json(report_of(std::vector{rest}), 0), Not(HasSubstr("velocity_rmse")));
}

TEST(TradeoffAdvice, NamesTheKneeOrWhatTheBudgetAllowsAndItsLines) {
  Report report = report_of(rows);
  EXPECT_THAT(advice(report),
              AllOf(HasSubstr("recommended at 50 ms: fast"), HasSubstr("\"effort\":\"fast\""),
                    HasSubstr("\"length_ms\": 50")));
  report.budget_ms = 2;
  EXPECT_THAT(advice(report),
              AllOf(HasSubstr("within 2 ms"), HasSubstr("frames of 20"),
                    HasSubstr("\"length_ms\": 20"), Not(HasSubstr("\"length_ms\": 50"))));
  report.budget_ms = 0.1;
  EXPECT_THAT(advice(report), HasSubstr("no setting is done within 0.1 ms"));
}

TEST(TradeoffAdvice, SaysWhyATrackedKneeIsNotRecommended) {
  std::vector<Row> measured = {row(Effort::balanced, 50, 3), row(Effort::balanced, 50, 1)};
  measured[1].setting.estimator.tracked = true;
  Report report = report_of(measured);
  EXPECT_EQ(knee_line(report, 50),
            "     50  knee: balanced, tracked; of frames on their own: balanced");
  EXPECT_THAT(
      advice(report),
      AllOf(HasSubstr("recommended at 50 ms: balanced, 3 ms a frame\n"),
            HasSubstr("the knee there, balanced, tracked, takes 1 ms. It is not recommended, "
                      "since the last digits of a tracked frame depend on"),
            HasSubstr("\"tracked\":false")));
  EXPECT_THAT(row_json(report, 1), HasSubstr("\"knee\":true"));
  report.configured.tracked = true;
  EXPECT_THAT(advice(report), AllOf(HasSubstr("recommended at 50 ms: balanced, tracked"),
                                    Not(HasSubstr("It is not recommended"))));
}

TEST(TradeoffAdvice, IsForTheMeasuredLengthNearestToTheConfiguredOne) {
  Report report = report_of(rows);
  report.configured_length_ms = 25;
  EXPECT_THAT(advice(report), HasSubstr("recommended at 20 ms"));
  report.configured_length_ms = 200;
  EXPECT_THAT(advice(report), HasSubstr("recommended at 50 ms"));
}

// What 0.29 s of recording have: four frames of 50 ms, without a neighbour on either side.
TEST(TradeoffAdvice, SaysHowManyFramesThereAreAndHowManyItTakes) {
  Row few = row(Effort::balanced, 50, 62);
  few.frames = 4;
  few.compared = 0;
  few.no_value = 0;
  Report report = report_of({&few, 1});
  report.reference = ErrorsAgainst::neighbours;
  const auto says_what_it_takes =
      AllOf(HasSubstr("0 of 4 frames"), HasSubstr("20 are needed"),
            HasSubstr("a recording of 1.2 s with --frames 23 has them"));
  EXPECT_THAT(advice(report), says_what_it_takes);
  EXPECT_THAT(knee_line(report, 50), says_what_it_takes);
  report.budget_ms = 100;
  EXPECT_THAT(no_choice_reason(report), says_what_it_takes);
  report.reference = ErrorsAgainst::scene;
  EXPECT_THAT(no_choice_reason(report), HasSubstr("--frames 20 has them"));
  few.frames = 200;
  few.compared = 12;
  few.wrong_peaks = 2;
  EXPECT_THAT(no_choice_reason(report), HasSubstr("--frames 400 has them"));
}

TEST(TradeoffAdvice, IsNoneWhereAStopCameFirst) {
  Report report = report_of(rows);
  report.stopped_in_ms = 50;
  EXPECT_THAT(advice(report), AllOf(HasSubstr("no setting is recommended"),
                                    HasSubstr("not all settings of 50 ms")));
}

TEST(TradeoffTitle, NamesTheScene) {
  const Config config = scene_config(1);
  EXPECT_EQ(
      title_of(config, find_origin(config, "")),
      "interleaved, 40 pulses in 3780 ns; S 0.00135, b 175000 /s; 284.5 m \u00b1 4 m in 20 s");
}

}  // namespace
}  // namespace splid::tradeoff
