#include "daemon/study/svg_chart.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace splid {
namespace {

constexpr double width = 860;
constexpr double left = 86;
constexpr double right = 20;
constexpr double panel_head = 34;  // above a panel's frame: its title
constexpr double panel_foot = 46;  // below: ticks and the axis' title
constexpr double marker_radius = 4.5;
constexpr double callout_radius = 9;
constexpr double line_dots_apart = 6;

// The width of a character of a 12-unit sans-serif font. The reader's font is not known, so this is
// wide enough for the common fonts.
constexpr double character_width = 6.7;
constexpr double callout_character_width = 8.2;  // bold
constexpr double label_character_width = 6.4;

constexpr const char* style =
    "<style>.title{font-size:15px;font-weight:bold;fill:#222}.panel{font-size:14px;fill:#222}"
    ".text{font-size:12px;fill:#444}.tick{font-size:12px;fill:#555}.label{font-size:10px;"
    "fill:#444;paint-order:stroke;stroke:#fff;stroke-width:3px}.callout{font-size:12px;font-weight:"
    "bold;fill:#222;paint-order:stroke;stroke:#fff;"
    "stroke-width:3px}.grid{stroke:#e6e6e6}.frame{fill:none;stroke:#999}</style>\n";

std::string escaped(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    if (c == '&') {
      safe += "&amp;";
    } else if (c == '<') {
      safe += "&lt;";
    } else if (c == '>') {
      safe += "&gt;";
    } else if (c == '"') {
      safe += "&quot;";
    } else {
      safe += c;
    }
  }
  return safe;
}

std::string text_at(double x, double y, const char* kind, const char* anchor,
                    const std::string& text) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" class=\"{}\" text-anchor=\"{}\">", x, y, kind,
                     anchor) +
         escaped(text) + "</text>\n";
}

std::string line_between(double x1, double y1, double x2, double y2,
                         const std::string& attributes) {
  return fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" ", x1, y1, x2,
                     y2) +
         attributes + "/>\n";
}

// Values beyond these have no place on an axis, since arithmetic with them would overflow.
constexpr double largest_magnitude = 1e200;
constexpr double smallest_logarithmic = 1e-200;

// The smallest number that is 1, 2 or 5 times a power of ten and at least `raw`.
double round_step(double raw) {
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= raw * (1 - 1e-9)) return factor * power;
  }
  return 10 * power;
}

// count: above 0, here and for decade_ticks().
std::vector<double> even_ticks(ChartRange range, int count) {
  const double step = round_step((range.high - range.low) / count);
  const double spare = step * 1e-6;
  std::vector<double> ticks;
  const double first = std::ceil((range.low - spare) / step);
  // A step is at least the range over the count, so there are no more than count + 1 ticks.
  for (int n = 0; n <= count; ++n) {
    const double tick = (first + n) * step;
    const bool ascends = ticks.empty() || tick > ticks.back();
    if (tick <= range.high + spare && ascends) ticks.push_back(tick);
  }
  return ticks;
}

std::vector<double> decade_ticks(ChartRange range, int count) {
  const double first = std::floor(std::log10(range.low));
  const double last = std::floor(std::log10(range.high) + 1e-9);
  const double decades = std::log10(range.high) - std::log10(range.low);
  const bool between = decades * 3 <= count + 2;
  const double every = std::max(1.0, std::ceil(decades / count));
  const auto powers = static_cast<int>((last - first) / every);
  std::vector<double> ticks;
  for (int k = 0; k <= powers; ++k) {
    const double power = first + k * every;
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double tick = factor * std::pow(10.0, power);
      const bool inside = tick >= range.low * (1 - 1e-9) && tick <= range.high * (1 + 1e-9);
      if (inside && (between || factor == 1)) ticks.push_back(tick);
    }
  }
  return ticks;
}

bool has_place(double value, bool logarithmic) {
  return std::abs(value) <= largest_magnitude && (!logarithmic || value >= smallest_logarithmic);
}

// Whether an axis can be drawn over the range.
bool is_axis(ChartRange range, bool logarithmic) {
  return has_place(range.low, logarithmic) && has_place(range.high, logarithmic) &&
         range.low < range.high;
}

// A value's place on an axis, 0 at its low end and 1 at its high end.
struct Scale {
  ChartRange range;
  bool logarithmic = false;

  [[nodiscard]] bool holds(double value) const { return has_place(value, logarithmic); }
  [[nodiscard]] double at(double value) const {
    if (!logarithmic) return (value - range.low) / (range.high - range.low);
    return (std::log(value) - std::log(range.low)) / (std::log(range.high) - std::log(range.low));
  }
};

struct Extent {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void take(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

using Range = std::optional<ChartRange> ChartPoint::*;

Scale scale_of(const ChartPanel& panel, const ChartAxis& axis, double ChartPoint::*value,
               Range range) {
  Scale scale{{0, 1}, axis.logarithmic};
  if (axis.range && is_axis(*axis.range, axis.logarithmic)) return {*axis.range, axis.logarithmic};
  Extent extent;
  const auto take = [&](double number) {
    if (scale.holds(number)) extent.take(number);
  };
  for (const ChartSeries& series : panel.series) {
    for (const ChartPoint& point : series.points) {
      take(point.*value);
      if (point.*range) take((point.*range)->low);
      if (point.*range) take((point.*range)->high);
    }
  }
  if (extent.low > extent.high) extent = {1, 1};
  constexpr double margin = 0.07;
  if (axis.logarithmic) {
    const double decades = std::log10(extent.high) - std::log10(extent.low);
    const double factor = std::max(1.02, std::pow(10.0, margin * decades));
    scale.range = {extent.low / factor, extent.high * factor};
  } else {
    const double span = extent.high - extent.low;
    const double magnitude = std::max(1.0, std::abs(extent.low));
    const double more = span > 1e-12 * magnitude ? margin * span : magnitude / 2;
    scale.range = {extent.low - more, extent.high + more};
  }
  return scale;
}

// "0.5", "20", "2e+06".
std::string tick_text(double value) {
  return fmt::format("{:g}", std::abs(value) < 1e-12 ? 0 : value);
}

std::string marker_at(const ChartSeries& series, double x, double y) {
  const double r = series.marker_size * marker_radius;
  const std::string paint = "fill=\"" + (series.hollow ? "#fff" : escaped(series.color)) +
                            "\" stroke=\"" + escaped(series.color) + "\" stroke-width=\"1.5\"/>\n";
  switch (series.marker) {
    case Marker::none:
      return {};
    case Marker::circle:
      return fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" ", x, y, r) + paint;
    case Marker::square:
      return fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" ",
                         x - 0.9 * r, y - 0.9 * r, 1.8 * r, 1.8 * r) +
             paint;
    case Marker::triangle:
      return fmt::format("<polygon points=\"{:.1f},{:.1f} {:.1f},{:.1f} {:.1f},{:.1f}\" ", x,
                         y - 1.2 * r, x + 1.1 * r, y + 0.8 * r, x - 1.1 * r, y + 0.8 * r) +
             paint;
    case Marker::diamond:
      break;
  }
  return fmt::format("<polygon points=\"{:.1f},{:.1f} {:.1f},{:.1f} {:.1f},{:.1f} {:.1f},{:.1f}\" ",
                     x, y - 1.25 * r, x + 1.25 * r, y, x, y + 1.25 * r, x - 1.25 * r, y) +
         paint;
}

std::string stroke_of(const ChartSeries& series) {
  return "stroke=\"" + escaped(series.color) + "\" stroke-width=\"1.4\"" +
         (series.line == LineStyle::dashed ? " stroke-dasharray=\"5 4\"" : "");
}

struct Box {
  double x0, y0, x1, y1;

  [[nodiscard]] bool overlaps(const Box& other) const {
    return x0 < other.x1 && other.x0 < x1 && y0 < other.y1 && other.y0 < y1;
  }
};

struct Label {
  double x, y;  // of the marker
  std::string text;
};

class PanelWriter {
 public:
  PanelWriter(const ChartPanel& panel, double top)
      : panel_(panel),
        top_(top),
        x_(scale_of(panel, panel.x, &ChartPoint::x, &ChartPoint::x_range)),
        y_(scale_of(panel, panel.y, &ChartPoint::y, &ChartPoint::y_range)) {}

  std::string write() {
    write_axes();
    for (const ChartSeries& series : panel_.series) write_line(series);
    for (const ChartSeries& series : panel_.series) write_points(series);
    for (const ChartSeries& series : panel_.series) write_callouts(series);
    for (const ChartSeries& series : panel_.series) write_labels(series);
    return std::move(out_);
  }

 private:
  [[nodiscard]] double x_at(double value) const {
    return left + x_.at(value) * (width - left - right);
  }
  [[nodiscard]] double y_at(double value) const {
    return top_ + (1 - y_.at(value)) * panel_.height;
  }
  [[nodiscard]] bool shows(const ChartPoint& point) const {
    if (!x_.holds(point.x) || !y_.holds(point.y)) return false;
    const double x = x_.at(point.x);
    const double y = y_.at(point.y);
    return x >= 0 && x <= 1 && y >= 0 && y <= 1;
  }

  void write_axes() {
    const double bottom = top_ + panel_.height;
    out_ += text_at(left, top_ - 10, "panel", "start", panel_.title);
    for (const double tick : axis_ticks(x_.range, x_.logarithmic, 8)) {
      out_ += line_between(x_at(tick), top_, x_at(tick), bottom, "class=\"grid\"");
      out_ += text_at(x_at(tick), bottom + 16, "tick", "middle", tick_text(tick));
    }
    for (const double tick : axis_ticks(y_.range, y_.logarithmic, 5)) {
      out_ += line_between(left, y_at(tick), width - right, y_at(tick), "class=\"grid\"");
      out_ += text_at(left - 7, y_at(tick) + 4, "tick", "end", tick_text(tick));
    }
    out_ += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" class=\"frame\"/>\n",
        left, top_, width - left - right, panel_.height);
    out_ += text_at((left + width - right) / 2, bottom + 34, "text", "middle", panel_.x.title);
    const double y = top_ + panel_.height / 2;
    out_ += fmt::format("<g transform=\"rotate(-90 22 {:.1f})\">", y) +
            text_at(22, y, "text", "middle", panel_.y.title) + "</g>\n";
  }

  void write_line(const ChartSeries& series) {
    if (series.line == LineStyle::none) return;
    std::string places;
    const ChartPoint* before = nullptr;
    for (const ChartPoint& point : series.points) {
      if (!shows(point)) continue;
      places += fmt::format("{:.1f},{:.1f} ", x_at(point.x), y_at(point.y));
      if (before != nullptr) take_line(*before, point);
      before = &point;
    }
    if (!places.empty()) places.pop_back();
    out_ += "<polyline points=\"" + places + "\" fill=\"none\" " + stroke_of(series) + "/>\n";
  }

  // Keeps texts off a line: the line is entered as a row of dots, closer together than a text is
  // high.
  void take_line(const ChartPoint& from, const ChartPoint& to) {
    const double dx = x_at(to.x) - x_at(from.x);
    const double dy = y_at(to.y) - y_at(from.y);
    const int dots = static_cast<int>(std::hypot(dx, dy) / line_dots_apart);
    for (int k = 1; k < dots; ++k) {
      const double x = x_at(from.x) + dx * k / dots;
      const double y = y_at(from.y) + dy * k / dots;
      taken_.push_back({x - 1, y - 1, x + 1, y + 1});
    }
  }

  void write_points(const ChartSeries& series) {
    const std::string thin = "stroke=\"" + escaped(series.color) + "\" stroke-opacity=\"0.6\"";
    for (const ChartPoint& point : series.points) {
      if (!shows(point)) continue;
      const double x = x_at(point.x);
      const double y = y_at(point.y);
      if (point.x_range) {
        const auto [low, high] = clipped(*point.x_range, x_);
        out_ += line_between(x_at(low), y, x_at(high), y, thin);
        out_ += line_between(x_at(high), y - 3, x_at(high), y + 3, thin);
        taken_.push_back({x_at(low), y - 3, x_at(high), y + 3});
      }
      if (point.y_range) {
        const auto [low, high] = clipped(*point.y_range, y_);
        out_ += line_between(x, y_at(low), x, y_at(high), thin);
        taken_.push_back({x - 1, y_at(high), x + 1, y_at(low)});
      }
      out_ += marker_at(series, x, y);
      if (series.marker == Marker::none) continue;
      const double r = series.marker_size * marker_radius;
      taken_.push_back({x - r, y - r, x + r, y + r});
    }
  }

  [[nodiscard]] bool is_free(const Box& box) const {
    return box.x0 > left && box.x1 < width - right && box.y0 > top_ &&
           box.y1 < top_ + panel_.height &&
           std::none_of(taken_.begin(), taken_.end(),
                        [&](const Box& other) { return box.overlaps(other); });
  }

  void write_callouts(const ChartSeries& series) {
    for (const ChartPoint& point : series.points) {
      if (!point.callout.empty() && shows(point)) place_callout(point);
    }
  }

  // Puts a callout as near to its marker as there is room, above the marker rather than below it.
  void place_callout(const ChartPoint& point) {
    const double x = x_at(point.x);
    const double y = y_at(point.y);
    out_ += fmt::format(
        "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"none\" stroke=\"#222\" "
        "stroke-width=\"1.5\"/>\n",
        x, y, callout_radius);
    const double half = static_cast<double>(point.callout.size()) * callout_character_width / 2;
    constexpr int nearest = 24;
    constexpr int farthest = 136;
    constexpr int step = 8;
    for (int pixels = nearest; pixels <= farthest; pixels += step) {
      const double away = pixels;
      for (const double dx : {0.0, half, -half, half + away, -half - away}) {
        for (const double dy : {-away, away}) {
          const Box box{x + dx - half, y + dy - 8, x + dx + half, y + dy + 8};
          if (!is_free(box)) continue;
          taken_.push_back(box);
          const double end_y = y + dy + (dy < 0 ? 7 : -9);
          const double end_x = std::clamp(x, box.x0, box.x1);
          const double share = callout_radius / std::hypot(end_x - x, end_y - y);
          out_ += line_between(x + share * (end_x - x), y + share * (end_y - y), end_x, end_y,
                               "stroke=\"#222\"");
          out_ += text_at(x + dx, y + dy + 4, "callout", "middle", point.callout);
          return;
        }
      }
    }
  }

  // The range cut to the axis; an end that is NaN becomes the axis' end.
  static ChartRange clipped(ChartRange range, const Scale& scale) {
    const auto [low, high] = scale.range;
    return {std::isnan(range.low) ? low : std::clamp(range.low, low, high),
            std::isnan(range.high) ? high : std::clamp(range.high, low, high)};
  }

  void write_labels(const ChartSeries& series) {
    for (const ChartPoint& point : series.points) {
      if (!point.label.empty() && shows(point)) place_label(point);
    }
  }

  // Puts a label above or below its marker where there is room; leaves it out where the same text
  // already stands close by.
  void place_label(const ChartPoint& point) {
    constexpr double same_place = 30;
    for (const Label& other : labels_) {
      const double away = std::hypot(other.x - x_at(point.x), other.y - y_at(point.y));
      if (other.text == point.label && away < same_place) return;
    }
    const double half = static_cast<double>(point.label.size()) * label_character_width / 2;
    const double x = x_at(point.x);
    const double y = y_at(point.y);
    // Labels are placed diagonally, since error bars go straight up, down and sideways.
    const double aside = half + 4;
    for (const auto& [dx, dy] : {std::pair{aside, -11.0},
                                 {aside, 11.0},
                                 {-aside, -11.0},
                                 {-aside, 11.0},
                                 {aside, -19.0},
                                 {aside, 19.0},
                                 {-aside, -19.0},
                                 {-aside, 19.0}}) {
      const Box box{x + dx - half, y + dy - 5, x + dx + half, y + dy + 5};
      if (!is_free(box)) continue;
      taken_.push_back(box);
      labels_.push_back({x, y, point.label});
      out_ += text_at(x + dx, y + dy + 3.5, "label", "middle", point.label);
      return;
    }
  }

  const ChartPanel& panel_;
  double top_;
  Scale x_;
  Scale y_;
  std::string out_;
  std::vector<Box> taken_;
  std::vector<Label> labels_;
};

// The legend's rows, from `y` downwards; moves `y` below them.
std::string legend(const Chart& chart, double& y) {
  constexpr double sample = 26;
  constexpr double row = 19;
  std::string out;
  std::vector<std::string> shown;
  double x = left;
  for (const ChartPanel& panel : chart.panels) {
    for (const ChartSeries& series : panel.series) {
      const bool again = std::find(shown.begin(), shown.end(), series.label) != shown.end();
      if (series.label.empty() || again) continue;
      const double entry =
          sample + 6 + static_cast<double>(series.label.size()) * character_width + 18;
      if (x > left && x + entry > width - right) {
        x = left;
        y += row;
      }
      if (series.line != LineStyle::none) {
        out += line_between(x, y - 4, x + sample, y - 4, stroke_of(series));
      }
      out += marker_at(series, x + sample / 2, y - 4);
      out += text_at(x + sample + 6, y, "text", "start", series.label);
      x += entry;
      shown.push_back(series.label);
    }
  }
  if (!shown.empty()) y += row;
  return out;
}

}  // namespace

std::vector<double> axis_ticks(ChartRange range, bool logarithmic, int count) {
  if (count < 1 || !is_axis(range, logarithmic)) return {};
  if (!logarithmic || range.high < 10 * range.low) return even_ticks(range, count);
  return decade_ticks(range, count);
}

std::string to_svg(const Chart& chart) {
  std::string body;
  double y = 27;
  body += text_at(left, y, "title", "start", chart.title);
  if (!chart.subtitle.empty()) {
    y += 19;
    body += text_at(left, y, "text", "start", chart.subtitle);
  }
  y += 24;
  body += legend(chart, y);
  for (const ChartPanel& panel : chart.panels) {
    body += PanelWriter(panel, y + panel_head - 10).write();
    y += panel_head + panel.height + panel_foot;
  }
  return fmt::format(
             "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:.0f} {:.0f}\" "
             "font-family=\"sans-serif\">\n",
             width, y) +
         style +
         fmt::format("<rect width=\"{:.0f}\" height=\"{:.0f}\" fill=\"#fff\"/>\n", width, y) +
         body + "</svg>\n";
}

}  // namespace splid
