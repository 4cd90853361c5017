#pragma once

#include <limits>
#include <vector>

#include "daemon/cloud/encoding.hpp"
#include "daemon/cloud/point.hpp"

namespace splid::test {

// Points whose values all differ; the second has no deviation of its velocity.
inline std::vector<cloud::Point> some_points() {
  return {{284.5, -12.25, 3.5, -1.5, 0.0625, 0.0005, 0.0125, 62500, 800.5, 1767225600.125, 0},
          {-2.75, 0.5, 0.125, 150, std::numeric_limits<double>::quiet_NaN(), 0.25, 2, 0, 12,
           1767225600.175, 4'000'000'000U}};
}

// A whole file of these points, as cloud::File writes it.
inline std::string encoded(const cloud::Encoding& encoding,
                           const std::vector<cloud::Point>& points) {
  cloud::Summary summary;
  std::string body;
  for (const cloud::Point& point : points) {
    summary.add(point);
    encoding.append(point, summary, body);
  }
  return encoding.head(summary) + body;
}

}  // namespace splid::test
