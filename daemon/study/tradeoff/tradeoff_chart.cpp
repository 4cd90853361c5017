#include "daemon/study/tradeoff/tradeoff_chart.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace splid {
namespace {

// Colours that colour-blind readers can tell apart (Okabe and Ito).
const char* color_of(Effort effort) {
  switch (effort) {
    case Effort::fast:
      return "#d55e00";
    case Effort::balanced:
      return "#0072b2";
    case Effort::exhaustive:
      break;
  }
  return "#009e73";
}

Marker marker_of(Effort effort) {
  switch (effort) {
    case Effort::fast:
      return Marker::triangle;
    case Effort::balanced:
      return Marker::circle;
    case Effort::exhaustive:
      break;
  }
  return Marker::square;
}

// Markers of different sizes, so that markers at the same place can all be seen: they are drawn in
// the order from the largest to the smallest.
double marker_size_of(Effort effort) {
  switch (effort) {
    case Effort::fast:
      return 0.7;
    case Effort::balanced:
      return 1.1;
    case Effort::exhaustive:
      break;
  }
  return 1.5;
}

ChartSeries& series_of(std::vector<ChartSeries>& all, const TradeoffSetting& setting) {
  const std::string name = setting_name(setting.estimator);
  for (ChartSeries& series : all) {
    if (series.label == name) return series;
  }
  ChartSeries series;
  series.label = name;
  const bool paper = setting.estimator.method == Method::paper;
  series.color = paper ? "#555" : color_of(setting.estimator.effort);
  series.marker = paper ? Marker::diamond : marker_of(setting.estimator.effort);
  series.marker_size = paper ? 1 : marker_size_of(setting.estimator.effort);
  series.hollow = setting.estimator.tracked;
  if (series.hollow) series.line = LineStyle::dashed;
  all.push_back(series);
  return all.back();
}

using Value = std::function<std::optional<double>(const TradeoffRow&)>;
using Spread = std::function<std::optional<ChartRange>(double value, const TradeoffRow&)>;

std::string chosen_name(const TradeoffSetting& setting) {
  return fmt::format("chosen: {}, frames of {:g} ms", setting_name(setting.estimator),
                     setting.length_ms);
}

// chosen: the row that gets its name written beside it, if any.
ChartPanel panel_of(const TradeoffReport& report, const std::string& title, ChartAxis y,
                    const Value& value, const Spread& spread, std::optional<std::size_t> chosen) {
  ChartPanel panel{title, {"processor time a frame, ms", true}, std::move(y), {}};
  for (std::size_t i = 0; i < report.rows.size(); ++i) {
    const TradeoffRow& row = report.rows[i];
    const auto at = value(row);
    if (!at) continue;
    ChartPoint point{row.p50_ms, *at};
    point.y_range = spread(*at, row);
    point.label = fmt::format("{:g} ms", row.setting.length_ms);
    if (chosen == i) point.callout = chosen_name(row.setting);
    series_of(panel.series, row.setting).points.push_back(point);
  }
  return panel;
}

// The root mean square of n errors has a relative uncertainty of 1 / sqrt(2 n).
std::optional<ChartRange> rms_spread(double value, const TradeoffRow& row) {
  const auto errors = static_cast<double>(row.compared - row.wrong_peaks);
  const double part = 1 / std::sqrt(2 * std::max(1.0, errors));
  return ChartRange{value * (1 - part), value * (1 + part)};
}

std::optional<ChartRange> no_spread(double /*value*/, const TradeoffRow& /*row*/) {
  return std::nullopt;
}

// Adds the bound of each length whose errors are known, as a level line from the length's fastest
// setting to its slowest.
void add_bounds(const TradeoffReport& report, ChartPanel& panel, const Value& rmse,
                const Value& bound) {
  std::map<double, std::pair<double, ChartRange>> by_length;
  for (const TradeoffRow& row : report.rows) {
    const auto value = bound(row);
    if (!value || !rmse(row)) continue;
    const auto [at, added] =
        by_length.try_emplace(row.setting.length_ms, *value, ChartRange{row.p50_ms, row.p50_ms});
    ChartRange& range = at->second.second;
    range = {std::min(range.low, row.p50_ms), std::max(range.high, row.p50_ms)};
  }
  for (const auto& [length_ms, line] : by_length) {
    const auto& [value, range] = line;
    panel.series.push_back({"Cramer-Rao bound",
                            "#333",
                            Marker::none,
                            false,
                            LineStyle::dashed,
                            {{range.low, value}, {range.high, value}}});
  }
}

void add_rmse_panel(const TradeoffReport& report, Chart& chart, const std::string& title,
                    const std::string& unit, const Value& rmse, const Value& bound) {
  ChartPanel panel =
      panel_of(report, title, {"RMSE, " + unit, true}, rmse, rms_spread, chosen_row(report));
  if (panel.series.empty()) return;
  panel.height = 250;
  add_bounds(report, panel, rmse, bound);
  chart.panels.push_back(std::move(panel));
}

void add_lost_panel(const TradeoffReport& report, Chart& chart, const std::string& title,
                    const std::function<std::size_t(const TradeoffRow&)>& lost) {
  double most = 0;
  const auto percent = [&](const TradeoffRow& row) -> std::optional<double> {
    const double share = static_cast<double>(lost(row)) / static_cast<double>(row.frames);
    most = std::max(most, 100 * share);
    return 100 * share;
  };
  ChartPanel panel = panel_of(report, title, {"% of frames"}, percent, no_spread, std::nullopt);
  if (most == 0) return;
  panel.y.range = ChartRange{-0.08 * most, 1.15 * most};
  chart.panels.push_back(std::move(panel));
}

std::optional<double> times(const std::optional<double>& value, double factor) {
  return value ? std::optional(*value * factor) : std::nullopt;
}

}  // namespace

Chart tradeoff_chart(const TradeoffReport& report) {
  Chart chart{"What a frame costs and what it is worth, for frames of the lengths named",
              report.title + "; errors against " + short_name(report.reference),
              {}};
  add_rmse_panel(
      report, chart, "Distance at mid-frame", "mm",
      [](const TradeoffRow& row) { return times(row.distance_rmse_m, 1e3); },
      [](const TradeoffRow& row) { return times(row.distance_bound_m, 1e3); });
  add_rmse_panel(
      report, chart, "Velocity", "cm/s",
      [](const TradeoffRow& row) { return times(row.velocity_rmse_mps, 1e2); },
      [](const TradeoffRow& row) { return times(row.velocity_bound_mps, 1e2); });
  add_lost_panel(report, chart, "Wrong frames: on another peak",
                 [](const TradeoffRow& row) { return row.wrong_peaks; });
  add_lost_panel(report, chart, "Missing frames: no target found, or its range not sure",
                 [](const TradeoffRow& row) { return row.no_value; });
  return chart;
}

}  // namespace splid
