#include "daemon/study/tradeoff/tradeoff_table.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "tests/support/error_text.hpp"

namespace splid::tradeoff {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<Row> some_rows() {
  std::vector<Row> rows;
  for (const double length_ms : {20.0, 50.0}) {
    for (const Effort effort : {Effort::balanced, Effort::fast}) {
      Row row;
      row.setting.estimator.effort = effort;
      row.setting.estimator.tracked = effort == Effort::balanced && length_ms == 50;
      row.setting.length_ms = length_ms;
      row.frames = 200;
      row.compared = 199;
      row.photons = 9470.25;
      row.p50_ms = (effort == Effort::fast ? 0.05 : 0.2) * length_ms;
      row.p99_ms = 1.5 * row.p50_ms;
      row.wrong_peaks = 2;
      row.no_value = 1;
      row.distance_rmse_m = 0.62e-3;
      row.distance_bound_m = 1.0 / 3;
      row.velocity_rmse_mps = 0.043;
      row.velocity_bound_mps = 0.04;
      row.distance_interval_m = {0.6e-3, 0.7e-3};
      rows.push_back(row);
    }
  }
  return rows;
}

Report report_with(const std::vector<Row>& rows) {
  return {rows, ErrorsAgainst::scene, {}, 50, std::nullopt, std::nullopt};
}

std::vector<std::string> table_lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

TEST(TradeoffTable, HasTheMembersOfTheJsonAsColumns) {
  const std::vector<Row> rows = some_rows();
  Report report = report_with(rows);
  report.budget_ms = 100;
  const auto lines = table_lines(to_csv(report));
  ASSERT_EQ(lines.size(), 1 + rows.size());
  for (const std::string& line : lines) {
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), 25) << line;
  }
  EXPECT_THAT(lines[0], AllOf(HasSubstr("method,tracked,effort,findings,length_ms"),
                              HasSubstr("knee,within_budget"), EndsWith(",chosen")));
  EXPECT_THAT(lines[2], HasSubstr("fast,on,20,200,9470.25,1,1.5,scene,"));
  const auto chosen = chosen_row(report);
  ASSERT_TRUE(chosen);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_THAT(lines[1 + i], EndsWith(i == *chosen ? ",true" : ",false"));
  }
}

TEST(TradeoffTable, IsReadAsItWasWritten) {
  std::vector<Row> rows = some_rows();
  rows[1].distance_rmse_m.reset();
  rows[1].velocity_bound_mps.reset();
  rows[2].setting.estimator.findings = FindingsWanted::off;
  rows[3].setting.estimator.method = Method::paper;
  const Report report = report_with(rows);
  const std::string text = to_csv(report);
  const std::vector<Row> read = rows_of_csv(text, "t.csv", report);
  ASSERT_EQ(read.size(), rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(setting_name(read[i].setting.estimator), setting_name(rows[i].setting.estimator));
  }
  EXPECT_EQ(to_csv(report_with(read)), text) << "to the last digit";
}

TEST(TradeoffTable, OfNoRowsIsEmpty) {
  EXPECT_THAT(to_csv(report_with({})), IsEmpty());
  EXPECT_THAT(rows_of_csv("", "t.csv", report_with({})), IsEmpty());
}

TEST(TradeoffTable, WhatIsNoTableIsNamedWithItsLine) {
  const std::vector<Row> rows = some_rows();
  const Report report = report_with(rows);
  const std::string text = to_csv(report);
  const auto error_of = [&](const std::string& broken, const Report& expected) {
    return test::error_text([&] { rows_of_csv(broken, "t.csv", expected); });
  };
  const auto with = [&](const std::string& part, const std::string& other) {
    std::string broken = text;
    return broken.replace(broken.find(part), part.size(), other);
  };
  EXPECT_THAT(error_of("a,b\n1,2\n", report),
              AllOf(HasSubstr("t.csv, line 2: there is no column "),
                    HasSubstr("a table of splid tradeoff is expected")));
  EXPECT_THAT(error_of(text + "search,false\n", report),
              HasSubstr("line 6: has 2 fields below 26 names"));
  EXPECT_THAT(error_of(with("9470.25", "many"), report), HasSubstr("photons is 'many', no number"));
  EXPECT_THAT(error_of(with("9470.25", ""), report), HasSubstr("photons is empty"));
  EXPECT_THAT(error_of(with(",fast,", ",quick,"), report), HasSubstr("effort is 'quick'"));
  EXPECT_THAT(error_of(with(",200,", ",-1,"), report), HasSubstr("frames is no number of frames"));
  Report other = report;
  other.reference = ErrorsAgainst::neighbours;
  EXPECT_THAT(error_of(text, other), HasSubstr("measured against 'scene' and not 'neighbours'"));
}

}  // namespace
}  // namespace splid::tradeoff
