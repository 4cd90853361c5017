#include "daemon/tradeoff/tradeoff_report.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "daemon/format.hpp"
#include "daemon/tradeoff/tradeoff_choice.hpp"
#include "protocol/json_writer.hpp"

namespace splid {
namespace {

struct Member {
  const char* name;
  std::string json;  // empty: not known
  // Without quotes: none of the texts holds any.
  [[nodiscard]] std::string plain() const {
    return json.size() > 1 && json.front() == '"' ? json.substr(1, json.size() - 2) : json;
  }
};

std::string number_or_nothing(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? number_text(*value) : std::string();
}

const char* name_of(ErrorsAgainst reference) {
  switch (reference) {
    case ErrorsAgainst::scene:
      return "scene";
    case ErrorsAgainst::truth_file:
      return "truth";
    case ErrorsAgainst::neighbours:
      break;
  }
  return "neighbours";
}

const char* short_of(ErrorsAgainst reference) {
  switch (reference) {
    case ErrorsAgainst::scene:
      return "the simulated target";
    case ErrorsAgainst::truth_file:
      return "the truth file";
    case ErrorsAgainst::neighbours:
      break;
  }
  return "neighbouring frames";
}

struct Marks {
  bool knee = false;
  bool budget = false;
};

Marks marks_of(const TradeoffReport& report, std::size_t row) {
  const auto knee = find_knee(report.rows, report.rows[row].setting.length_ms, report.configured);
  const auto budget =
      report.budget_ms ? find_within_budget(report.rows, *report.budget_ms) : std::nullopt;
  return {knee == row, budget == row};
}

std::vector<Member> members_of(const TradeoffReport& report, std::size_t index) {
  const TradeoffRow& row = report.rows[index];
  const Marks marks = marks_of(report, index);
  const EstimatorOptions& estimator = row.setting.estimator;
  return {{"method", estimator.method == Method::paper ? "\"paper\"" : "\"search\""},
          {"tracked", estimator.tracked ? "true" : "false"},
          {"effort", json_string(to_string(estimator.effort))},
          {"length_ms", number_text(row.setting.length_ms)},
          {"frames", std::to_string(row.frames)},
          {"photons", number_text(row.photons)},
          {"compute_ms_p50", number_text(row.p50_ms)},
          {"compute_ms_p99", number_text(row.p99_ms)},
          {"reference", json_string(name_of(report.reference))},
          {"compared", std::to_string(row.compared)},
          {"distance_rmse_m", number_or_nothing(row.distance_rmse_m)},
          {"distance_bound_m", number_or_nothing(row.distance_bound_m)},
          {"distance_rmse_over_bound", number_or_nothing(row.distance_ratio())},
          {"velocity_rmse_mps", number_or_nothing(row.velocity_rmse_mps)},
          {"velocity_bound_mps", number_or_nothing(row.velocity_bound_mps)},
          {"velocity_rmse_over_bound", number_or_nothing(row.velocity_ratio())},
          {"wrong_peaks", std::to_string(row.wrong_peaks)},
          {"no_value", std::to_string(row.no_value)},
          {"knee", marks.knee ? "true" : "false"},
          {"within_budget", report.budget_ms ? (marks.budget ? "true" : "false") : ""}};
}

std::string column(const char* pattern, const std::optional<double>& value, double factor,
                   int width) {
  return value ? format(pattern, *value * factor) : format("%*s", width, "-");
}

constexpr const char* headings =
    "  frame  setting               one core, ms     distance RMSE     velocity RMSE    wrong    "
    "no\n"
    "     ms                        p50      p99       mm  /bound      cm/s  /bound    peaks  "
    "value  "
    "frames\n";

// Colours that keep apart for the colour-blind (Okabe and Ito).
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
  series.hollow = setting.estimator.tracked;
  if (series.hollow) series.line = LineStyle::dashed;
  all.push_back(series);
  return all.back();
}

using Value = std::function<std::optional<double>(const TradeoffRow&)>;

using Spread = ChartRange (*)(double value, const TradeoffRow&);

ChartPanel panel_of(const TradeoffReport& report, const std::string& title, const ChartAxis& y,
                    const Value& value, Spread spread) {
  ChartPanel panel{title, {"processor time a frame, ms", true}, y, {}};
  for (const TradeoffRow& row : report.rows) {
    const auto at = value(row);
    if (!at) continue;
    ChartPoint point{row.p50_ms, *at};
    point.x_range = ChartRange{row.p50_ms, std::max(row.p50_ms, row.p99_ms)};
    point.y_range = spread(*at, row);
    point.label = format("%g", row.setting.length_ms);
    series_of(panel.series, row.setting).points.push_back(point);
  }
  return panel;
}

// The bound: a dashed line at 1, as wide as the data.
void add_bound(ChartPanel& panel) {
  double first = 0;
  double last = 0;
  for (const ChartSeries& series : panel.series) {
    for (const ChartPoint& point : series.points) {
      first = first == 0 ? point.x : std::min(first, point.x);
      last = std::max(last, point.x_range->high);
    }
  }
  if (last == 0) return;
  panel.series.push_back({"Cramer-Rao bound",
                          "#777",
                          Marker::none,
                          false,
                          LineStyle::dashed,
                          {{first, 1}, {last, 1}}});
}

// A root mean square of n errors is known to one part in sqrt(2 n).
ChartRange rms_spread(double value, const TradeoffRow& row) {
  const auto errors = static_cast<double>(row.compared - row.wrong_peaks);
  const double part = 1 / std::sqrt(2 * std::max(1.0, errors));
  return {value * (1 - part), value * (1 + part)};
}

ChartRange no_spread(double value, const TradeoffRow& /*row*/) { return {value, value}; }

ChartPanel ratio_panel(const TradeoffReport& report, const std::string& title, const Value& value) {
  ChartPanel panel = panel_of(report, title, {"RMSE / bound", true}, value, rms_spread);
  // Wide enough that noise does not look like a difference.
  ChartRange range{0.5, 2};
  for (const ChartSeries& series : panel.series) {
    for (const ChartPoint& point : series.points) {
      range = {std::min(range.low, point.y / 1.1), std::max(range.high, point.y * 1.1)};
    }
  }
  panel.y.range = range;
  add_bound(panel);
  return panel;
}

ChartPanel lost_panel(const TradeoffReport& report) {
  double most = 0;
  const auto percent = [&](const TradeoffRow& row) -> std::optional<double> {
    const auto lost = static_cast<double>(row.wrong_peaks + row.no_value);
    most = std::max(most, 100 * lost / static_cast<double>(row.frames));
    return 100 * lost / static_cast<double>(row.frames);
  };
  ChartPanel panel = panel_of(report, "Frames on a wrong peak or without a value", {"% of frames"},
                              percent, no_spread);
  panel.y.range = ChartRange{0, std::max(1.0, 1.1 * most)};
  return panel;
}

std::string describe_target(const simulator::TargetOptions& target) {
  switch (target.motion) {
    case simulator::MotionKind::linear:
      return format("%g m, %+g m/s", target.distance_m, target.velocity_mps);
    case simulator::MotionKind::sinusoid:
      return format("%g m \u00b1 %g m in %g s", target.distance_m, target.amplitude_m,
                    target.period_s);
    case simulator::MotionKind::points:
      break;
  }
  return "a target between points";
}

}  // namespace

ErrorsAgainst errors_against(const FrameOrigin& origin) {
  if (origin.scene) return ErrorsAgainst::scene;
  return origin.truth ? ErrorsAgainst::truth_file : ErrorsAgainst::neighbours;
}

std::string describe(ErrorsAgainst reference) {
  switch (reference) {
    case ErrorsAgainst::scene:
      return "errors against the simulated target";
    case ErrorsAgainst::truth_file:
      return "errors against the recording's truth file";
    case ErrorsAgainst::neighbours:
      break;
  }
  return "no truth: errors are each frame's deviation from the cubic through its four neighbours "
         "(effort exhaustive), freed of their own noise; a constant error does not show";
}

std::string tradeoff_table(const TradeoffReport& report) {
  std::string text = describe(report.reference) + "\n" + headings;
  for (std::size_t i = 0; i < report.rows.size(); ++i) {
    const TradeoffRow& row = report.rows[i];
    const Marks marks = marks_of(report, i);
    text +=
        format("%7g  %-19s", row.setting.length_ms, setting_name(row.setting.estimator).c_str()) +
        format("%7.3g  %7.3g", row.p50_ms, row.p99_ms) + "  " +
        column("%7.3g", row.distance_rmse_m, 1e3, 7) + column("%8.3f", row.distance_ratio(), 1, 8) +
        "   " + column("%7.3g", row.velocity_rmse_mps, 1e2, 7) +
        column("%8.3f", row.velocity_ratio(), 1, 8) +
        format("%9zu%7zu%8zu", row.wrong_peaks, row.no_value, row.frames) +
        (marks.knee ? " *" : "") + (marks.budget ? " <" : "") + "\n";
  }
  return text;
}

std::string tradeoff_json(const TradeoffReport& report) {
  std::string text;
  for (std::size_t i = 0; i < report.rows.size(); ++i) {
    JsonWriter line;
    line.text("schema", "splid.tradeoff").raw("v", "[1,0]");
    for (const Member& member : members_of(report, i)) {
      if (!member.json.empty()) line.raw(member.name, member.json);
    }
    text += line.finish() + "\n";
  }
  return text;
}

std::string tradeoff_csv(const TradeoffReport& report) {
  std::string names;
  std::string lines;
  for (std::size_t i = 0; i < report.rows.size(); ++i) {
    for (const Member& member : members_of(report, i)) {
      if (i == 0) names += std::string(member.name) + ",";
      lines += member.plain() + ",";
    }
    lines.back() = '\n';
  }
  if (!names.empty()) names.back() = '\n';
  return names + lines;
}

Chart tradeoff_chart(const TradeoffReport& report) {
  Chart chart{"Speed against accuracy, for frames of the lengths given in ms",
              report.title + "; errors against " + short_of(report.reference),
              {}};
  chart.panels.push_back(ratio_panel(report, "Distance at mid-frame",
                                     [](const TradeoffRow& row) { return row.distance_ratio(); }));
  chart.panels.push_back(
      ratio_panel(report, "Velocity", [](const TradeoffRow& row) { return row.velocity_ratio(); }));
  chart.panels.push_back(lost_panel(report));
  return chart;
}

std::string tradeoff_advice(const TradeoffReport& report, double length_ms) {
  const auto knee = find_knee(report.rows, length_ms, report.configured);
  std::string text;
  if (knee) {
    const TradeoffSetting& setting = report.rows[*knee].setting;
    text = format("the knee at %g ms (*): %s, %.3g ms a frame\n", length_ms,
                  setting_name(setting.estimator).c_str(), report.rows[*knee].p50_ms);
    if (!report.budget_ms) text += configuration_lines(setting) + "\n";
  }
  if (!report.budget_ms) return text;
  const auto within = find_within_budget(report.rows, *report.budget_ms);
  if (!within) return text;
  const TradeoffRow& row = report.rows[*within];
  return text +
         format("within %g ms a frame (<): %s, frames of %g ms, p99 %.3g ms\n", *report.budget_ms,
                setting_name(row.setting.estimator).c_str(), row.setting.length_ms, row.p99_ms) +
         configuration_lines(row.setting) + "\n";
}

std::string tradeoff_title(const Config& config, const FrameOrigin& origin) {
  const std::string pattern =
      format("%s, %zu pulses in %g ns", to_string(config.pattern.mode),
             pulses_per_period(config.pattern), pattern_period_ps(config.pattern) / 1000);
  if (!origin.scene) return origin.recording + ": " + pattern;
  return pattern +
         format("; S %g, b %g /s; ", origin.scene->detection.signal_per_pulse,
                origin.scene->background_per_s()) +
         describe_target(origin.scene->target);
}

}  // namespace splid
