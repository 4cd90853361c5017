#pragma once

#include <optional>
#include <string>
#include <vector>

namespace splid {

// Charts as SVG text: panels one below the other, each with its axes and series. A chart shows
// measured data unchanged: nothing is smoothed, and no point is left out except where it has no
// place on an axis, because it is not finite, is beyond 1e200, or is below 1e-200 on a logarithmic
// axis.

enum class Marker { none, circle, square, triangle, diamond };
enum class LineStyle { none, solid, dashed };

struct ChartRange {
  double low = 0;
  double high = 0;  // >= low
};

struct ChartPoint {
  double x = 0;
  double y = 0;
  std::optional<ChartRange> x_range = std::nullopt;  // ends of the error bar, not its lengths
  std::optional<ChartRange> y_range = std::nullopt;
  std::string label = {};  // written beside the marker if there is room; empty: none
  // A text with a line to a ring around the marker; gets its place before all labels; empty: none.
  std::string callout = {};
};

struct ChartSeries {
  std::string label;  // in the legend; series with the same label share an entry; empty: none
  std::string color = "#1f5fa8";
  Marker marker = Marker::circle;
  bool hollow = false;  // the marker is only an outline
  LineStyle line = LineStyle::solid;
  std::vector<ChartPoint> points = {};  // joined in this order
  double marker_size = 1;               // relative to the usual size
};

struct ChartAxis {
  std::string title;  // with its unit
  bool logarithmic = false;
  // Where absent, or not low < high with both on the axis, the range of the data with a margin.
  std::optional<ChartRange> range = std::nullopt;
};

struct ChartPanel {
  std::string title;
  ChartAxis x;
  ChartAxis y;
  std::vector<ChartSeries> series;
  double height = 190;  // of the frame that the axes make
};

struct Chart {
  std::string title;
  std::string subtitle = {};  // smaller, below; empty: none
  std::vector<ChartPanel> panels;
};

// The values at which an axis has its marks: round, ascending and within the range; about `count`
// values and never more than 3 * count + 2. On a logarithmic axis they are 1, 2 and 5 of each
// decade, or only powers of ten where there are many decades, or even steps where there is less
// than one decade. Empty for a range that no axis can have.
std::vector<double> axis_ticks(ChartRange range, bool logarithmic, int count);

// A whole SVG document, 860 units wide.
//
// Threads: any. Errors: none.
std::string to_svg(const Chart& chart);

}  // namespace splid
