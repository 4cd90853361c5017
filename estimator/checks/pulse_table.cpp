#include "estimator/checks/pulse_table.hpp"

#include <algorithm>
#include <cmath>

namespace splid::checks {
namespace {

constexpr int steps_a_width = 16;
// Pulses that are three times as wide as configured still end in the table.
constexpr int least_reach_widths = 40;

struct Cubic {
  double at_first, slope_first, at_last, slope_last;
  explicit Cubic(double t)
      : at_first((1 + 2 * t) * (1 - t) * (1 - t)),
        slope_first(t * (1 - t) * (1 - t)),
        at_last(t * t * (3 - 2 * t)),
        slope_last(t * t * (t - 1)) {}
};

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
  const Cubic by(t);
  const double step = 1 / per_ns_;
  return {by.at_first * a.light + by.at_last * b.light +
              step * (by.slope_first * a.density + by.slope_last * b.density),
          by.at_first * a.density + by.at_last * b.density +
              step * (by.slope_first * a.slope + by.slope_last * b.slope),
          a.slope + t * (b.slope - a.slope), a.tail + t * (b.tail - a.tail)};
}

}  // namespace splid::checks
