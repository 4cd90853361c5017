#pragma once

#include <optional>
#include <string>
#include <vector>

namespace splid {

// Charts as SVG text: panels one below the other, each with its axes and series. What is drawn of
// a measurement is data to whoever reads the file, so nothing is smoothed and nothing left out but
// points that have no place on an axis: not finite, beyond 1e200, or on a logarithmic one below
// 1e-200.

enum class Marker { none, circle, square, triangle, diamond };
enum class LineStyle { none, solid, dashed };

struct ChartRange {
  double low = 0;
  double high = 0;  // >= low
};

struct ChartPoint {
  double x = 0;
  double y = 0;
  std::optional<ChartRange> x_range = std::nullopt;  // error bars: absolute ends, not lengths
  std::optional<ChartRange> y_range = std::nullopt;
  std::string label = {};  // beside the marker, where there is room for it; empty: none
  // With a ring around the marker and a line to it; has its place before all labels; empty: none.
  std::string callout = {};
};

struct ChartSeries {
  std::string label;  // in the legend, where series of the same label share an entry; empty: none
  std::string color = "#1f5fa8";
  Marker marker = Marker::circle;
  bool hollow = false;  // marker: an outline
  LineStyle line = LineStyle::solid;
  std::vector<ChartPoint> points = {};  // joined in this order
  double marker_size = 1;               // of the common one
};

struct ChartAxis {
  std::string title;  // with its unit
  bool logarithmic = false;
  // Absent, or no range with a place on the axis and low < high: the data's, with a margin.
  std::optional<ChartRange> range = std::nullopt;
};

struct ChartPanel {
  std::string title;
  ChartAxis x;
  ChartAxis y;
  std::vector<ChartSeries> series;
  double height = 190;  // of the axes' frame
};

struct Chart {
  std::string title;
  std::string subtitle = {};  // smaller, below; empty: none
  std::vector<ChartPanel> panels;
};

// Values at which an axis has its marks: round, ascending, within the range, about `count` of them
// and never more than 3 * count + 2. On a logarithmic axis 1, 2 and 5 of each decade, powers of ten
// where it has many and even steps where it has less than one. None for a range that no axis has.
std::vector<double> axis_ticks(ChartRange range, bool logarithmic, int count);

// A whole SVG document, 860 units wide.
//
// Threads: any. Errors: none.
std::string to_svg(const Chart& chart);

}  // namespace splid
