#include "estimator/array/neighbours.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/sync/deviations.hpp"

namespace splid::array {
namespace {

// The distance in azimuth or in elevation, whichever is larger.
double apart_deg(const PixelDirection& a, const PixelDirection& b) {
  return std::max(std::abs(a.azimuth_deg - b.azimuth_deg),
                  std::abs(a.elevation_deg - b.elevation_deg));
}

double pitch_deg(std::span<const PixelDirection> directions) {
  std::vector<double> nearest;
  for (const PixelDirection& pixel : directions) {
    double least = std::numeric_limits<double>::infinity();
    for (const PixelDirection& other : directions) {
      const double apart = apart_deg(pixel, other);
      if (apart > 0) least = std::min(least, apart);
    }
    if (std::isfinite(least)) nearest.push_back(least);
  }
  if (nearest.empty()) return 0;
  const auto middle = nearest.begin() + static_cast<std::ptrdiff_t>(nearest.size() / 2);
  std::nth_element(nearest.begin(), middle, nearest.end());
  return *middle;
}

}  // namespace

Neighbours::Neighbours(std::span<const PixelDirection> directions, std::size_t rings) {
  const double pitch = pitch_deg(directions);
  for (const PixelDirection& pixel : directions) {
    const auto straight_deg = [&](std::size_t other) {
      return in_quadrature(pixel.azimuth_deg - directions[other].azimuth_deg,
                           pixel.elevation_deg - directions[other].elevation_deg);
    };
    Around& around = around_.emplace_back();
    around.near.push_back(around_.size() - 1);
    around.ends.push_back(1);
    for (std::size_t ring = 1; ring <= rings; ++ring) {
      const double reach_deg = (static_cast<double>(ring) + 0.5) * pitch;
      for (std::size_t other = 0; other < directions.size(); ++other) {
        const bool is_known =
            std::find(around.near.begin(), around.near.end(), other) != around.near.end();
        const bool is_within = pitch == 0 || apart_deg(pixel, directions[other]) < reach_deg;
        if (!is_known && is_within) around.near.push_back(other);
      }
      std::stable_sort(
          around.near.begin() + static_cast<std::ptrdiff_t>(around.ends.back()), around.near.end(),
          [&](std::size_t a, std::size_t b) { return straight_deg(a) < straight_deg(b); });
      around.ends.push_back(around.near.size());
    }
  }
}

std::span<const std::size_t> Neighbours::around(std::size_t pixel, std::size_t ring) const {
  return std::span(around_[pixel].near).first(around_[pixel].ends[ring]);
}

}  // namespace splid::array
