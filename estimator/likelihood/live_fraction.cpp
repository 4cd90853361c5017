#include "estimator/likelihood/live_fraction.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/model/units.hpp"

namespace splid {
namespace {

constexpr double shape_cells_a_width = 8;
constexpr double most_live_periods = 2000;
// A longer dead time averages over so many periods that its phase does not matter.
constexpr double most_cells_dead = 1 << 22;
constexpr double live_settled = 1e-7;

}  // namespace

LiveFraction::LiveFraction(const PulseShape& shape, const Comb& comb,
                           std::span<const CombLight> lights, double b,
                           const DeadDetector& detector) {
  const double dilation = lights.front().dilation;
  const double cells =
      std::ceil(comb.period_ns * dilation * shape_cells_a_width / shape.width_ns());
  cells_per_ns_ = cells / comb.period_ns;
  live_.assign(static_cast<std::size_t>(cells), 1.0);
  const double cells_dead = detector.dead_time_ns / dilation * cells_per_ns_;
  if (cells_dead < 1) return;
  if (cells_dead > most_cells_dead) {
    double light = b;
    for (const CombLight& of : lights) {
      light += of.signal_per_pulse * comb.total_amplitude / (comb.period_ns * dilation);
    }
    mean_ = 1 / (1 + light / detector.inputs * detector.dead_time_ns);
    std::fill(live_.begin(), live_.end(), mean_);
    return;
  }
  settle(chances(shape, comb, lights, b * dilation, detector.inputs), cells_dead);
}

// The chance of a detection in each cell, for a detector that is live at its begin. b: by the
// comb's clock.
std::vector<double> LiveFraction::chances(const PulseShape& shape, const Comb& comb,
                                          std::span<const CombLight> lights, double b,
                                          double inputs) const {
  const auto cells = static_cast<double>(live_.size());
  std::vector<double> light(live_.size(), b / inputs / cells_per_ns_);
  for (const CombLight& of : lights) {
    const auto width_cells = static_cast<std::size_t>(
        (shape.last_ns() - shape.first_ns()) / of.dilation * cells_per_ns_ + 3);
    for (std::size_t p = 0; p < comb.times_ns.size(); ++p) {
      const double time_ns = comb.times_ns[p] + of.shift_ns;
      const double first = std::floor((time_ns + shape.first_ns() / of.dilation) * cells_per_ns_);
      double before = 0;
      for (std::size_t step = 0; step < width_cells; ++step) {
        const double k = first + static_cast<double>(step);
        double offset = ((k + 1) / cells_per_ns_ - time_ns) * of.dilation;
        double up_to = 0;
        shape.integrate({&offset, 1}, {&up_to, 1});
        light[static_cast<std::size_t>(fold_on(k, cells))] +=
            of.signal_per_pulse / inputs * comb.amplitudes[p] * (up_to - before);
        before = up_to;
      }
    }
  }
  for (double& cell : light) cell = -std::expm1(-cell);
  return light;
}

void LiveFraction::settle(const std::vector<double>& chances, double cells_dead) {
  const std::size_t cells = live_.size();
  // Detections of the last dead time, in a ring, and how far between two cells the dead time ends.
  const auto whole = static_cast<std::size_t>(cells_dead);
  const double part = cells_dead - static_cast<double>(whole);
  std::vector<double> detected(whole + 2, 0.0);
  std::size_t now = 0;
  double live = 1;
  const double dead_periods = cells_dead / static_cast<double>(cells);
  const auto most = static_cast<std::size_t>(most_live_periods + 50 * dead_periods);
  for (std::size_t period = 0; period < most; ++period) {
    double change = 0;
    double sum = 0;
    for (std::size_t k = 0; k < cells; ++k) {
      change = std::max(change, std::abs(live - live_[k]));
      live_[k] = live;
      sum += live;
      const double detection = live * chances[k];
      detected[now] = detection;
      now = now + 1 == detected.size() ? 0 : now + 1;
      // detected[now] is now the oldest: of whole + 1 cells ago.
      const std::size_t next = now + 1 == detected.size() ? 0 : now + 1;
      live += part * detected[now] + (1 - part) * detected[next] - detection;
      live = std::clamp(live, 0.0, 1.0);
    }
    mean_ = sum / static_cast<double>(cells);
    if (static_cast<double>(period) > 2 * dead_periods + 1 && change < live_settled) return;
  }
}

double LiveFraction::at(double phase_ns) const {
  const double place = phase_ns * cells_per_ns_;
  const auto k = std::min(static_cast<std::size_t>(place), live_.size() - 1);
  const double part = std::clamp(place - static_cast<double>(k), 0.0, 1.0);
  const double next = live_[k + 1 == live_.size() ? 0 : k + 1];
  return (1 - part) * live_[k] + part * next;
}

}  // namespace splid
