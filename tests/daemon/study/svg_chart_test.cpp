#include "daemon/study/svg_chart.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace splid {
namespace {

using ::testing::DoubleNear;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::Pointwise;

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

// Every element that is opened is closed, in order, and every attribute has its quotes.
bool is_well_formed(const std::string& text) {
  std::vector<std::string> open;
  for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at)) {
    const std::size_t end = text.find('>', at);
    if (end == std::string::npos) return false;
    const std::string tag = text.substr(at + 1, end - at - 1);
    if (tag.find('<') != std::string::npos || count_of(tag, "\"") % 2 != 0) return false;
    const std::string name = tag.substr(0, tag.find_first_of(" /", 1));
    if (tag.front() == '/') {
      if (open.empty() || tag.substr(1) != open.back()) return false;
      open.pop_back();
    } else if (tag.back() != '/') {
      open.push_back(name);
    }
    at = end;
  }
  return open.empty();
}

ChartSeries series(const std::string& label, std::vector<ChartPoint> points) {
  ChartSeries made;
  made.label = label;
  made.points = std::move(points);
  return made;
}

// One panel whose axes run from 1 to 100, logarithmic, and 0 to 10.
Chart chart_of(std::vector<ChartSeries> all) {
  ChartPanel panel;
  panel.title = "Panel";
  panel.x = {"x, ms", true, ChartRange{1, 100}};
  panel.y = {"y, mm", false, ChartRange{0, 10}};
  panel.series = std::move(all);
  return {"Title", "", {panel}};
}

TEST(AxisTicks, AreRoundAndWithinTheRange) {
  EXPECT_THAT(axis_ticks({0, 10}, false, 5),
              Pointwise(testing::DoubleEq(), {0., 2., 4., 6., 8., 10.}));
  EXPECT_THAT(axis_ticks({-0.31, 0.29}, false, 3), Pointwise(DoubleNear(1e-12), {-0.2, 0., 0.2}));
  EXPECT_THAT(axis_ticks({0.9, 60}, true, 8),
              Pointwise(DoubleNear(1e-9), {1., 2., 5., 10., 20., 50.}));
  EXPECT_THAT(axis_ticks({1e-4, 1e3}, true, 8),
              Pointwise(testing::DoubleNear(1e-9), {1e-4, 1e-3, 1e-2, 0.1, 1., 10., 100., 1000.}));
  EXPECT_THAT(axis_ticks({0.98, 1.13}, true, 4), Pointwise(DoubleNear(1e-9), {1., 1.05, 1.1}));
}

// Whatever a measurement makes of an axis: a few marks, all within it, and each above the last.
TEST(AxisTicks, AreFewWhateverTheRange) {
  const double nan = std::nan("");
  const double infinite = std::numeric_limits<double>::infinity();
  const double most = std::numeric_limits<double>::max();
  const double least = std::numeric_limits<double>::denorm_min();
  const std::vector<double> ends = {-infinite, -most, -1,   -least, 0,    least,    1e-300,
                                    1e-9,      1,     1e17, 1e300,  most, infinite, nan};
  for (const double low : ends) {
    for (const double high : ends) {
      for (const bool logarithmic : {false, true}) {
        SCOPED_TRACE(std::to_string(low) + " to " + std::to_string(high));
        const std::vector<double> ticks = axis_ticks({low, high}, logarithmic, 8);
        EXPECT_LE(ticks.size(), 26u);
        for (std::size_t k = 0; k < ticks.size(); ++k) {
          EXPECT_TRUE(std::isfinite(ticks[k]) && (k == 0 || ticks[k] > ticks[k - 1])) << ticks[k];
        }
      }
    }
  }
  EXPECT_LE(axis_ticks({1e17, 1e17 + 64}, false, 8).size(), 26u);
  EXPECT_THAT(axis_ticks({0, 10}, true, 5), testing::IsEmpty()) << "no place on such an axis";
}

TEST(SvgChart, IsWellFormedWhateverTheTextsHold) {
  ChartSeries hostile =
      series("S < 2 & \"b\" > 1", {{2, 5, ChartRange{1.5, 3}, ChartRange{4, 6}, "a<b"}});
  Chart chart = chart_of({hostile});
  chart.title = "<script>";
  chart.subtitle = "a & b";
  const std::string svg = to_svg(chart);
  EXPECT_TRUE(is_well_formed(svg)) << svg;
  EXPECT_THAT(svg, Not(HasSubstr("<script>")));
  EXPECT_THAT(svg, HasSubstr("S &lt; 2 &amp; &quot;b&quot; &gt; 1"));
  EXPECT_THAT(svg, HasSubstr("a&lt;b"));
}

// 86 and 840 are the panel's left and right, x = 10 is half way between 1 and 100.
TEST(SvgChart, PointsLieWhereTheAxesSay) {
  const std::string svg = to_svg(chart_of({series("s", {{1, 0}, {10, 5}, {100, 10}})}));
  EXPECT_THAT(svg, HasSubstr("cx=\"86.0\""));
  EXPECT_THAT(svg, HasSubstr("cx=\"463.0\""));
  EXPECT_THAT(svg, HasSubstr("cx=\"840.0\""));
  const std::string line = svg.substr(svg.find("<polyline points=\"") + 18);
  double x[3] = {}, y[3] = {};
  ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf %lf,%lf %lf,%lf\"", &x[0], &y[0], &x[1], &y[1],
                        &x[2], &y[2]),
            6);
  EXPECT_NEAR(y[0] - y[1], y[1] - y[2], 0.11);
  EXPECT_GT(y[0], y[2]);
}

TEST(SvgChart, LeavesOutWhatHasNoPlaceOnAnAxis) {
  const double nan = std::nan("");
  const double infinite = std::numeric_limits<double>::infinity();
  const std::string svg = to_svg(
      chart_of({series("s", {{-1, 5}, {0, 5}, {10, nan}, {infinite, 5}, {500, 5}, {10, 5}})}));
  EXPECT_EQ(count_of(svg, "<circle"), 2u) << "the point and the legend's";
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
}

TEST(SvgChart, AnAxisWithoutARangeTakesTheDatas) {
  Chart chart = chart_of({series("s", {{3, 2, {}, ChartRange{1, 7}, ""}, {40, 4, {}, {}, ""}})});
  chart.panels.front().x.range.reset();
  chart.panels.front().y.range.reset();
  const std::string svg = to_svg(chart);
  EXPECT_EQ(count_of(svg, "<circle"), 3u);
  for (const char* tick : {">5<", ">10<", ">20<", ">2<", ">4<", ">6<"}) {
    EXPECT_THAT(svg, HasSubstr(tick));
  }
  Chart empty = chart_of({series("s", {})});
  empty.panels.front().x.range.reset();
  empty.panels.front().y.range.reset();
  EXPECT_TRUE(is_well_formed(to_svg(empty)));
  EXPECT_THAT(to_svg(empty), Not(HasSubstr("nan")));
}

// A root mean square of nothing is 0: neither an axis nor a bar of an error may take it for a
// value.
TEST(SvgChart, NoValueMakesAnAxisOfItsOwn) {
  const double nan = std::nan("");
  const double infinite = std::numeric_limits<double>::infinity();
  for (const double odd : {0.0, -1.0, nan, infinite, -infinite, 1e-320, 1e308}) {
    for (const bool logarithmic : {false, true}) {
      SCOPED_TRACE(odd);
      Chart chart = chart_of({series("s", {{3, 2, ChartRange{odd, odd}, ChartRange{odd, 7}, ""},
                                           {odd, odd, {}, {}, "odd"},
                                           {40, 4, {}, {}, ""}})});
      chart.panels.front().x = {"x", logarithmic, ChartRange{odd, 10}};
      chart.panels.front().y = {"y", logarithmic, {}};
      const std::string svg = to_svg(chart);
      EXPECT_TRUE(is_well_formed(svg));
      EXPECT_LT(svg.size(), 12'000u);
      EXPECT_THAT(svg, Not(HasSubstr("nan")));
      EXPECT_THAT(svg, Not(HasSubstr("inf")));
    }
  }
}

TEST(SvgChart, SeriesOfOneLabelShareAnEntryOfTheLegend) {
  Chart chart = chart_of({series("fast", {{2, 3}}), series("balanced", {{3, 3}})});
  chart.panels.push_back(chart.panels.front());
  const std::string svg = to_svg(chart);
  EXPECT_EQ(count_of(svg, ">fast<"), 1u);
  EXPECT_EQ(count_of(svg, ">balanced<"), 1u);
  EXPECT_EQ(count_of(svg, "<polyline"), 4u);
}

TEST(SvgChart, EachMarkerAndLineHasItsOwnForm) {
  ChartSeries made = series("s", {{10, 5}});
  const auto drawn = [&](Marker marker, LineStyle line) {
    made.marker = marker;
    made.line = line;
    return to_svg(chart_of({made}));
  };
  EXPECT_EQ(count_of(drawn(Marker::circle, LineStyle::none), "<circle"), 2u);
  EXPECT_EQ(count_of(drawn(Marker::square, LineStyle::none), "<rect"), 4u);
  EXPECT_EQ(count_of(drawn(Marker::triangle, LineStyle::none), "<polygon"), 2u);
  EXPECT_EQ(count_of(drawn(Marker::diamond, LineStyle::none), "<polygon"), 2u);
  const std::string dashed = drawn(Marker::none, LineStyle::dashed);
  EXPECT_EQ(count_of(dashed, "stroke-dasharray"), 2u);
  EXPECT_EQ(count_of(dashed, "<circle") + count_of(dashed, "<polygon"), 0u);
}

TEST(SvgChart, ALabelGivesWayToWhatIsThere) {
  const std::string apart =
      to_svg(chart_of({series("s", {{2, 5, {}, {}, "20"}, {50, 5, {}, {}, "21"}})}));
  EXPECT_EQ(count_of(apart, "class=\"label\""), 2u);
  const auto labels_at_one_place = [](const std::vector<std::string>& texts) {
    std::vector<ChartPoint> crowd;
    for (const std::string& text : texts) crowd.push_back({10, 5, {}, {}, text});
    return count_of(to_svg(chart_of({series("s", crowd)})), "class=\"label\"");
  };
  EXPECT_EQ(labels_at_one_place({"1", "2", "3", "4", "5", "6"}), 4u);
  EXPECT_EQ(labels_at_one_place({"1", "1", "2"}), 2u);
}

TEST(SvgChart, ALabelKeepsOffALine) {
  // Steep enough to pass where the label of its middle would stand first.
  ChartSeries line = series("s", {{1, 0}, {10, 5, {}, {}, "12345"}, {100, 10}});
  const auto label = [](const std::string& svg) {
    const std::size_t end = svg.find(">12345<");
    return svg.substr(svg.rfind("<text", end), end - svg.rfind("<text", end));
  };
  const std::string beside = label(to_svg(chart_of({line})));
  line.line = LineStyle::none;
  EXPECT_NE(beside, label(to_svg(chart_of({line}))));
}

TEST(SvgChart, ACalloutNamesItsPointBeforeAllLabels) {
  ChartSeries chosen = series("s", {{10, 5}});
  chosen.points.front().callout = "chosen <b>";
  std::vector<ChartPoint> crowd;
  for (const char* text : {"1", "2", "3", "4"}) crowd.push_back({10, 5, {}, {}, text});
  const std::string svg = to_svg(chart_of({series("crowd", crowd), chosen}));
  EXPECT_TRUE(is_well_formed(svg));
  EXPECT_THAT(svg, HasSubstr(">chosen &lt;b&gt;<"));
  EXPECT_EQ(count_of(svg, "class=\"callout\""), 1u);
  EXPECT_EQ(count_of(svg, "fill=\"none\" stroke=\"#222\""), 1u) << "its ring";
  EXPECT_LT(svg.find("class=\"callout\""), svg.find("class=\"label\""));
}

}  // namespace
}  // namespace splid
