#include "daemon/view/field_picture.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>

#include "daemon/base/text.hpp"
#include "daemon/view/pixel_grid.hpp"
#include "protocol/shown_text.hpp"

namespace splid::view {
namespace {

using Pixel = SceneMessage::Pixel;
using Value = std::optional<double> FrameMessage::*;

constexpr std::size_t most_columns = 64;
constexpr std::array<const char*, 8> field_blocks{"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
constexpr std::array<const char*, 8> field_letters{"_", ".", "-", "~", "=", "+", "*", "#"};

// The pixels by row, from the top, and column, from the left; null where there is none.
using Rows = std::vector<std::vector<const Pixel*>>;

Rows rows_of(const std::vector<Pixel>& pixels, const PixelGrid& grid) {
  Rows rows(grid.rows, std::vector<const Pixel*>(grid.columns));
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    rows[grid.cells[i] / grid.columns][grid.cells[i] % grid.columns] = &pixels[i];
  }
  return rows;
}

struct Scale {
  double low = 0, high = 0;
  bool is_known = false;
};

Scale scale_of(const std::vector<Pixel>& pixels, Value value) {
  Scale scale;
  for (const Pixel& pixel : pixels) {
    const std::optional<double>& one = pixel.frame.*value;
    if (!one) continue;
    scale.low = scale.is_known ? std::min(scale.low, *one) : *one;
    scale.high = scale.is_known ? std::max(scale.high, *one) : *one;
    scale.is_known = true;
  }
  return scale;
}

// One character.
std::string cell_of(const Pixel* pixel, Value value, const Scale& scale, Characters characters) {
  if (pixel == nullptr) return " ";
  const bool is_utf8 = characters == Characters::utf8;
  const std::optional<double>& one = pixel->frame.*value;
  if (!one) return is_utf8 ? "·" : ".";
  const auto& levels = is_utf8 ? field_blocks : field_letters;
  const double share = scale.high > scale.low ? (*one - scale.low) / (scale.high - scale.low) : 0.5;
  const auto last = levels.size() - 1;
  const auto level = static_cast<std::size_t>(std::lround(share * static_cast<double>(last)));
  return levels.at(std::min(level, last));
}

// A row of a picture, one or two characters a pixel; of these two a dot takes the first.
std::string row_of(const std::vector<const Pixel*>& row, Value value, const Scale& scale,
                   Characters characters, bool is_wide) {
  std::string line;
  for (const Pixel* pixel : row) {
    const std::string cell = cell_of(pixel, value, scale, characters);
    line += cell;
    if (is_wide) line += pixel != nullptr && pixel->frame.*value ? cell : " ";
  }
  return line;
}

std::string scale_words(const char* name, const Scale& scale, const char* format_unit,
                        Characters characters) {
  if (!scale.is_known) return fmt::format("no {}", name);
  const auto& levels = characters == Characters::utf8 ? field_blocks : field_letters;
  return fmt::format("{} {:.4f} {} to {:.4f} {} {}", name, scale.low, levels.front(), scale.high,
                     levels.back(), format_unit);
}

std::string counts_of(const std::vector<Pixel>& pixels) {
  std::map<FrameStatus, std::size_t> counts;
  for (const Pixel& pixel : pixels) ++counts[pixel.frame.status];
  std::string text;
  for (const auto& [status, count] : counts) {
    text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + to_string(status);
  }
  return text;
}

// columns: of the terminal. Pixels are narrow where the pictures would be wider.
std::vector<std::string> picture_lines(const SceneMessage& scene, const PixelGrid& grid,
                                       Characters characters, std::size_t columns) {
  const Scale range = scale_of(scene.pixels, &FrameMessage::distance_m);
  const Scale velocity = scale_of(scene.pixels, &FrameMessage::velocity_mps);
  std::vector<std::string> lines{clock_time(scene.whole.timestamp_s) + "  " +
                                 counts_of(scene.pixels) + "; " +
                                 scale_words("range", range, "m", characters) + "; " +
                                 scale_words("velocity", velocity, "m/s", characters)};
  constexpr std::size_t blanks = 6;
  const bool is_wide = 4 * grid.columns + blanks <= columns;
  for (const auto& row : rows_of(scene.pixels, grid)) {
    lines.push_back("  " + row_of(row, &FrameMessage::distance_m, range, characters, is_wide) +
                    "    " +
                    row_of(row, &FrameMessage::velocity_mps, velocity, characters, is_wide));
  }
  return lines;
}

std::string value_text(fmt::format_string<double> pattern, const std::optional<double>& value,
                       double factor, std::size_t width) {
  return value ? fmt::format(pattern, *value * factor) : fmt::format("{:>{}}", "-", width);
}

std::vector<std::string> table_lines(const SceneMessage& scene) {
  std::vector<std::string> lines{
      clock_time(scene.whole.timestamp_s) + "  " + counts_of(scene.pixels),
      "pixel       distance m  +- mm   velocity m/s +- cm/s   S/pulse  status"};
  for (const Pixel& pixel : scene.pixels) {
    const FrameMessage& frame = pixel.frame;
    lines.push_back(fmt::format("{:<9} ", shown_text(pixel.name, most_quoted)) +
                    value_text("{:>12.5f}", frame.distance_m, 1, 12) + " " +
                    value_text("{:>6.2f}", frame.std_distance_m, 1e3, 6) + " " +
                    value_text("{:>14.4f}", frame.velocity_mps, 1, 14) + " " +
                    value_text("{:>7.2f}", frame.std_velocity_mps, 1e2, 7) + " " +
                    value_text("{:>9.3g}", frame.signal_per_pulse, 1, 9) + "  " +
                    to_string(frame.status));
  }
  return lines;
}

}  // namespace

std::vector<std::string> field_lines(const SceneMessage& scene, Characters characters,
                                     std::size_t columns) {
  const std::optional<PixelGrid> grid = pixel_grid(scene.pixels);
  return grid && grid->columns <= most_columns ? picture_lines(scene, *grid, characters, columns)
                                               : table_lines(scene);
}

}  // namespace splid::view
