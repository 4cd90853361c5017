#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "bench/studies/report.hpp"

namespace splid::studies {
namespace {

// Told apart by eyes that see fewer colours, too (Okabe and Ito).
const char* color_of(Mode mode) {
  switch (mode) {
    case Mode::baseline:
      return "#555555";
    case Mode::ambiguous:
      return "#e69f00";
    case Mode::mrr:
      return "#cc3f8e";
    case Mode::random:
      return "#0072b2";
    case Mode::interleaved:
      return "#009e73";
  }
  return "";
}

struct Look {
  Estimator estimator;
  const char* label;
  Marker marker;
  bool hollow;
  double shift;  // of the axis, so that markers on one another can be seen
};

constexpr std::array looks = {
    Look{Estimator::search, "search", Marker::circle, false, -0.004},
    Look{Estimator::paper, "[P]'s method", Marker::square, true, 0.004},
    Look{Estimator::wang, "[P]'s method with Wang's CRT", Marker::triangle, true, 0.012},
};

double x_of(const Cell& cell) {
  switch (info(cell.study).axis) {
    case Axis::background:
      return cell.background_per_ns;
    case Axis::length:
      return cell.length_ms;
    case Axis::velocity:
      return cell.velocity_mps.value_or(0);
    case Axis::signal:
      return cell.signal_per_pulse;
  }
  return 0;
}

ChartAxis x_axis(Study study) {
  switch (info(study).axis) {
    case Axis::background:
      return {"background, counts/ns", true, ChartRange{7e-6, 1.4e-2}};
    case Axis::length:
      return {"acquisition time, ms", true,
              study == Study::fig9 ? ChartRange{8, 250} : ChartRange{0.075, 67}};
    case Axis::velocity:
      return {"velocity, m/s", false, ChartRange{-160, 160}};
    case Axis::signal:
      return {"signal, counts/pulse", true, ChartRange{1.2e-4, 1.7e-3}};
  }
  return {};
}

// One of the four values as the figures show it.
struct Quantity {
  Value value;
  const char* title;
  const char* axis;
  double scale;  // from the unit of Score::rmse
  double Bound::*bound;
};

constexpr std::array quantities = {
    Quantity{delay, "Delay at mid-frame", "RMSE, ps", 1e3, &Bound::delay_ns},
    Quantity{velocity, "Velocity", "RMSE, m/s", 1, &Bound::velocity_mps},
    Quantity{signal, "Signal", "RMSE, counts/pulse", 1, &Bound::signal_per_pulse},
    Quantity{background, "Background", "RMSE, counts/ns", 1, &Bound::background_per_ns},
};

// A study's results of one mode and estimator, in the order of its axis.
std::vector<const Result*> line_of(const Results& results, Study study, Mode mode,
                                   Estimator estimator) {
  std::vector<const Result*> line;
  for (const Job& job : full_jobs(0)) {
    const auto found = results.find(key(job));
    if (job.cell.study != study || job.cell.mode != mode || job.estimator != estimator) continue;
    if (found != results.end()) line.push_back(&found->second);
  }
  return line;
}

double shifted(const Result& result, const Look& look, int mode_shift) {
  const double x = x_of(result.job.cell);
  const double shift = look.shift + 0.012 * mode_shift;
  if (info(result.job.cell.study).axis == Axis::velocity) return x + 300 * shift;
  return x * std::pow(10, 3 * shift);
}

ChartSeries series(const Look& look, Mode mode) {
  ChartSeries made;
  made.color = color_of(mode);
  made.marker = look.marker;
  made.hollow = look.hollow;
  made.line = LineStyle::none;
  return made;
}

// Entries of the legend alone: the estimators' markers.
void add_legend(const Results& results, Study study, ChartPanel& panel) {
  for (const Look& look : looks) {
    ChartSeries entry = series(look, Mode::baseline);
    entry.label = look.label;
    bool any = false;
    for (const auto& [name, result] : results) {
      any = any || (result.job.cell.study == study && result.job.estimator == look.estimator);
    }
    if (any) panel.series.push_back(entry);
  }
}

ChartPanel rmse_panel(const Results& results, Study study, const Quantity& quantity) {
  ChartPanel panel{quantity.title, x_axis(study), {quantity.axis, true, {}}, {}};
  for (int m = 0; m < 5; ++m) {
    const Mode mode = static_cast<Mode>(m);
    ChartSeries bound{.label = std::string(splid::to_string(mode)) + ", bound",
                      .color = color_of(mode),
                      .marker = Marker::none,
                      .points = {}};
    for (const Look& look : looks) {
      ChartSeries measured = series(look, mode);
      for (const Result* result : line_of(results, study, mode, look.estimator)) {
        if (look.estimator == Estimator::search) {
          const double y = quantity.scale * result->expectation.bound.*quantity.bound;
          bound.points.push_back({.x = x_of(result->job.cell), .y = y, .label = {}});
        }
        if (!photons_decide(result->expectation) || result->score.right() < 2) continue;
        const double y = quantity.scale * result->score.rmse[quantity.value];
        const double half = y * result->score.relative_error();
        measured.points.push_back({.x = shifted(*result, look, m - 2),
                                   .y = y,
                                   .y_range = ChartRange{y - half, y + half},
                                   .label = {}});
      }
      if (!measured.points.empty()) panel.series.push_back(measured);
    }
    if (!bound.points.empty()) panel.series.push_back(bound);
  }
  add_legend(results, study, panel);
  return panel;
}

ChartPanel failures_panel(const Results& results, Study study) {
  ChartPanel panel{"Frames on a wrong peak or without a value",
                   x_axis(study),
                   {"share, %", false, ChartRange{0, 100}},
                   {}};
  for (int m = 0; m < 5; ++m) {
    for (const Look& look : looks) {
      ChartSeries measured = series(look, static_cast<Mode>(m));
      measured.line = look.estimator == Estimator::search ? LineStyle::solid : LineStyle::dashed;
      for (const Result* result : line_of(results, study, static_cast<Mode>(m), look.estimator)) {
        const Score& s = result->score;
        const Share share = wilson_95(s.wrong + s.no_value, s.trials);
        measured.points.push_back({.x = shifted(*result, look, m - 2),
                                   .y = 100.0 * (s.wrong + s.no_value) / s.trials,
                                   .y_range = ChartRange{100 * share.low, 100 * share.high},
                                   .label = {}});
      }
      if (!measured.points.empty()) panel.series.push_back(measured);
    }
  }
  return panel;
}

}  // namespace

Chart figure(const Results& results, Study study) {
  Chart chart;
  chart.title = info(study).title;
  chart.subtitle =
      "Lines: Cramer-Rao bound. Markers: measured, where the photons decide; a little "
      "aside of their place, so that all can be seen.";
  bool any = false;
  for (const auto& [name, result] : results) any = any || result.job.cell.study == study;
  if (!any) return chart;
  for (const Quantity& quantity : quantities) {
    chart.panels.push_back(rmse_panel(results, study, quantity));
  }
  chart.panels.push_back(failures_panel(results, study));
  return chart;
}

}  // namespace splid::studies
