#include "daemon/view/pixel_grid.hpp"

#include <cmath>
#include <iterator>
#include <set>

namespace splid::view {
namespace {

// Directions that differ by less are the same column or row.
long microdegrees(double direction_deg) { return std::lround(direction_deg * 1e6); }

std::size_t index_of(const std::set<long>& all, long one) {
  return static_cast<std::size_t>(std::distance(all.begin(), all.find(one)));
}

}  // namespace

std::optional<PixelGrid> pixel_grid(const std::vector<SceneMessage::Pixel>& pixels) {
  std::set<long> columns;
  std::set<long> rows;  // from the top
  for (const SceneMessage::Pixel& pixel : pixels) {
    if (!pixel.azimuth_deg || !pixel.elevation_deg) return std::nullopt;
    columns.insert(microdegrees(*pixel.azimuth_deg));
    rows.insert(-microdegrees(*pixel.elevation_deg));
  }
  if (columns.size() * rows.size() > 2 * pixels.size()) return std::nullopt;
  PixelGrid grid{columns.size(), rows.size(), {}};
  std::set<std::size_t> taken;
  for (const SceneMessage::Pixel& pixel : pixels) {
    const std::size_t cell = index_of(rows, -microdegrees(*pixel.elevation_deg)) * grid.columns +
                             index_of(columns, microdegrees(*pixel.azimuth_deg));
    if (!taken.insert(cell).second) return std::nullopt;
    grid.cells.push_back(cell);
  }
  return grid;
}

}  // namespace splid::view
