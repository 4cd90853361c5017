#include "daemon/view/page_scene.hpp"

#include <fmt/core.h>

#include <cmath>
#include <numeric>
#include <utility>

#include "daemon/view/pixel_grid.hpp"
#include "protocol/json_writer.hpp"

namespace splid::view {
namespace {

// The text of each pixel as a JSON array.
template <class Items, class Text>
std::string array_of(const Items& items, const Text& text) {
  std::string list = "[";
  for (const auto& item : items) {
    if (list.size() > 1) list += ',';
    list += text(item);
  }
  return list + "]";
}

// Rows of about as many pixels as there are rows.
PixelGrid in_order(std::size_t count) {
  const auto columns = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(count))));
  PixelGrid grid{columns, columns == 0 ? 0 : (count + columns - 1) / columns, {}};
  grid.cells.resize(count);
  std::iota(grid.cells.begin(), grid.cells.end(), 0);
  return grid;
}

}  // namespace

std::string layout_json(const std::vector<SceneMessage::Pixel>& pixels) {
  const auto by_direction = pixel_grid(pixels);
  const PixelGrid grid = by_direction ? *by_direction : in_order(pixels.size());
  return JsonWriter{}
      .flag("is_grid", by_direction.has_value())
      .integer("columns", grid.columns)
      .integer("rows", grid.rows)
      .raw("pixel", array_of(pixels, [](const auto& pixel) { return json_string(pixel.name); }))
      .raw("cell", array_of(grid.cells, [](std::size_t cell) { return std::to_string(cell); }))
      .finish();
}

std::string picture_json(const SceneMessage& scene) {
  JsonWriter json;
  json.number("timestamp", scene.whole.timestamp_s)
      .integer("sequence", scene.whole.sequence)
      .raw("status", array_of(scene.pixels, [](const auto& pixel) {
             return std::to_string(static_cast<int>(pixel.frame.status));
           }));
  for (const auto& [name, value] : {std::pair{"distance_m", &FrameMessage::distance_m},
                                    {"velocity_mps", &FrameMessage::velocity_mps},
                                    {"signal_per_pulse", &FrameMessage::signal_per_pulse}}) {
    json.raw(name, array_of(scene.pixels, [member = value](const auto& pixel) -> std::string {
               const auto& number = pixel.frame.*member;
               const bool is_shown = pixel.frame.valid() && number && std::isfinite(*number);
               return is_shown ? fmt::format("{:.9g}", *number) : "null";
             }));
  }
  return json.finish();
}

}  // namespace splid::view
