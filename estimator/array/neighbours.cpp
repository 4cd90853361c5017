#include "estimator/array/neighbours.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/sync/in_quadrature.hpp"

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

Neighbours::Neighbours(std::span<const PixelDirection> directions, std::size_t rings)
    : rings_(rings) {
  const double pitch = pitch_deg(directions);
  for (std::size_t k = 0; k < directions.size(); ++k) {
    const auto from = static_cast<std::ptrdiff_t>(near_.size());
    begins_.push_back(near_.size());
    const auto ring_of = [&](std::size_t other) {
      return pitch > 0 ? apart_deg(directions[k], directions[other]) / pitch : 0;
    };
    const auto straight_deg = [&](std::size_t other) {
      return in_quadrature(directions[k].azimuth_deg - directions[other].azimuth_deg,
                           directions[k].elevation_deg - directions[other].elevation_deg);
    };
    near_.push_back(k);
    ends_.push_back(near_.size());
    for (std::size_t ring = 1; ring <= rings; ++ring) {
      const auto begin = static_cast<std::ptrdiff_t>(near_.size());
      for (std::size_t other = 0; other < directions.size(); ++other) {
        const bool is_new = std::find(near_.begin() + from, near_.end(), other) == near_.end();
        if (is_new && ring_of(other) < static_cast<double>(ring) + 0.5) near_.push_back(other);
      }
      std::stable_sort(near_.begin() + begin, near_.end(), [&](std::size_t a, std::size_t b) {
        return straight_deg(a) < straight_deg(b);
      });
      ends_.push_back(near_.size());
    }
  }
}

std::span<const std::size_t> Neighbours::around(std::size_t pixel, std::size_t ring) const {
  const std::size_t begin = begins_[pixel];
  return std::span(near_).subspan(begin, ends_[pixel * (rings_ + 1) + ring] - begin);
}

}  // namespace splid::array
