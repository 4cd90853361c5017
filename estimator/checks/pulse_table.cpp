#include "estimator/checks/pulse_table.hpp"

#include <algorithm>
#include <cmath>

namespace splid::checks {
namespace {

constexpr int steps_a_width = 16;
// Pulses that are three times as wide as configured still end in the table.
constexpr int least_reach_widths = 40;

// The cubic between two nodes a step apart, at the part t of it, from values and slopes there.
double cubic(double t, double step, double first, double first_slope, double last,
             double last_slope) {
  const double left = 1 - t;
  return (1 + 2 * t) * left * left * first + t * t * (3 - 2 * t) * last +
         step * (t * left * left * first_slope - t * t * left * last_slope);
}

}  // namespace

// The tail follows from tail' = (light - tail) / length, with a light that is linear over a step.
PulseTable::PulseTable(const PulseShape& shape)
    : width_ns_(shape.width_ns()),
      peak_ns_(shape.peak_offset_ns()),
      first_ns_(std::min(shape.first_ns(), peak_ns_ - least_reach_widths * width_ns_)),
      per_ns_(steps_a_width / width_ns_) {
  const double last_ns = std::max(shape.last_ns(), peak_ns_ + least_reach_widths * width_ns_);
  const auto count = static_cast<std::size_t>((last_ns - first_ns_) * per_ns_) + 2;
  std::vector<double> offset(count), light(count), h(count), d1(count), d2(count);
  for (std::size_t i = 0; i < count; ++i) {
    offset[i] = first_ns_ + static_cast<double>(i) / per_ns_;
  }
  shape.integrate(offset, light);
  shape.evaluate(offset, {h, d1, d2});
  const double steps = 1 / (tail_widths * steps_a_width);  // of the table, in tail lengths
  const double stays = std::exp(-steps);
  double tail = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0) {
      const double grows = (light[i] - light[i - 1]) / steps;
      tail = light[i] - grows + (tail - light[i - 1] + grows) * stays;
    }
    nodes_.push_back({light[i], h[i], d1[i], tail});
  }
}

PulseTable::Values PulseTable::at(double offset_ns) const {
  const double last = static_cast<double>(nodes_.size() - 1);
  const double place = std::clamp((offset_ns - first_ns_) * per_ns_, 0.0, last - 1e-9);
  const auto k = static_cast<std::size_t>(place);
  const double t = place - static_cast<double>(k);
  const Values &a = nodes_[k], &b = nodes_[k + 1];
  const double step = 1 / per_ns_;
  return {cubic(t, step, a.light, a.density, b.light, b.density),
          cubic(t, step, a.density, a.slope, b.density, b.slope), a.slope + t * (b.slope - a.slope),
          a.tail + t * (b.tail - a.tail)};
}

}  // namespace splid::checks
