#include "estimator/calibration/shape_stack.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "estimator/model/chance.hpp"
#include "estimator/model/pulse_shape.hpp"

namespace splid::calibration {
namespace {

using Window = FoldModel::Window;

constexpr double reach_after_widths = 200;  // of a tail: 20 ns for a pulse of 100 ps
constexpr std::size_t longest_run = 64;
constexpr int sharpening_rounds = 15;

std::size_t bin_of(const FoldModel& model, const Window& window, std::size_t i) {
  return model.fold().wrapped(window.first + static_cast<std::ptrdiff_t>(i));
}

double step_ps(const FoldModel& model) {
  const double widths = 0.5 * std::pow(1e4 / std::max(model.total_counts(), 1.0), 1.0 / 7);
  const double fold_step_ps = 2 * model.bin_ps();
  return std::max(model.width_ps() * std::clamp(widths, 0.125, 0.5), fold_step_ps);
}

// An empty stack that goes as far to either side as a pulse may reach.
StackedPhotons wide_stack(const FoldModel& model) {
  const double width_ps = model.width_ps();
  const double gap_ps = model.period_ps() / static_cast<double>(model.pulses());
  const double after_ps =
      std::max(pulse_reach_widths * width_ps,
               std::min(gap_ps - pulse_reach_widths * width_ps, reach_after_widths * width_ps));
  StackedPhotons stack;
  stack.step_ps = step_ps(model);
  const double before = std::ceil(pulse_reach_widths * width_ps / stack.step_ps);
  stack.first_ps = -before * stack.step_ps;
  stack.net.resize(static_cast<std::size_t>(before + std::ceil(after_ps / stack.step_ps)) + 1);
  stack.variance.resize(stack.net.size());
  return stack;
}

// The values [begin, end) that a pulse reaches: as far as photons stand out in single values, and
// beyond these in any run of 2, 4, and so on, since a tail fades out over ever longer runs.
struct Extent {
  std::size_t begin, end;
};

Extent significant_extent(const FoldModel& model, const StackedPhotons& stack) {
  const std::size_t size = stack.net.size();
  // The deviation holds the noise of the background too, which is known from the gaps between the
  // pulses alone. Of some 10^4 runs noise lets one pass in one of 300 calibrations; the table is
  // then a little longer, which does no harm.
  const auto pulses = static_cast<double>(model.pulses());
  const double covered_ps = pulses * static_cast<double>(size) * stack.step_ps;
  const double free_ps = std::max(model.period_ps() - covered_ps, 0.1 * model.period_ps());
  const double in_a_step = pulses * stack.step_ps;
  const double shared = in_a_step * in_a_step * model.background_per_ps / free_ps;
  const auto stands_out = [&](std::size_t begin, std::size_t end) {
    double sum = 0, variance = 1;
    for (std::size_t j = begin; j < end; ++j) {
      sum += stack.net[j];
      variance += stack.variance[j];
    }
    const auto steps = static_cast<double>(end - begin);
    return sum > sure_deviations * std::sqrt(variance + shared * steps * steps);
  };
  const auto peak = static_cast<std::size_t>(std::max_element(stack.net.begin(), stack.net.end()) -
                                             stack.net.begin());
  // At least two values on either side of the peak, which a spline needs to fall off.
  Extent extent{peak < 2 ? 0 : peak - 2, std::min(peak + 3, size)};
  for (std::size_t length = 1; length <= longest_run; length *= 2) {
    for (std::size_t j = size - std::min(size, length); j >= extent.end; --j) {
      if (!stands_out(j, j + length)) continue;
      extent.end = std::max(extent.end, j + length);
      break;
    }
    for (std::size_t j = 0; j + length <= extent.begin; ++j) {
      if (!stands_out(j, j + length)) continue;
      extent.begin = std::min(extent.begin, j);
      break;
    }
  }
  return extent;
}

// Scales the table so that its sum times the step is 1.
void normalise(TabulatedPulse& table) {
  const double sum = std::accumulate(table.density.begin(), table.density.end(), 0.0);
  for (double& value : table.density) value /= sum * table.step_ps;
}

// A photon's place in a table: the value that the photon is nearest to, and the photon's weights
// for that value and its two neighbours.
struct Place {
  std::ptrdiff_t nearest;
  SplineWeights weights;

  Place(const TabulatedPulse& table, double offset_ps)
      : Place((offset_ps - table.first_ps) / table.step_ps) {}
  explicit Place(double position)
      : nearest(static_cast<std::ptrdiff_t>(std::floor(position + 0.5))),
        weights(position - std::floor(position + 0.5)) {}
};

// Adds `amount` at a place to the values of a table.
void share_out(std::vector<double>& values, const Place& place, double amount) {
  const double parts[] = {place.weights.before, place.weights.at, place.weights.after};
  for (std::ptrdiff_t d = -1; d <= 1; ++d) {
    const std::ptrdiff_t j = place.nearest + d;
    if (j < 0 || j >= static_cast<std::ptrdiff_t>(values.size())) continue;
    values[static_cast<std::size_t>(j)] += parts[d + 1] * amount;
  }
}

// One round of expectation maximisation: each value grows by the ratio of the photons seen to the
// photons expected, weighted as the value counts for them.
void sharpen(FoldModel& model) {
  TabulatedPulse table = model.table();
  const std::vector<double>& rates = model.rates();
  std::vector<double> seen(table.density.size());
  std::vector<double> expected(table.density.size());
  model.each_reached([&](std::size_t p, const Window& window, std::size_t i, std::size_t bin) {
    const Place place(table, window.offset_ps[i]);
    share_out(seen, place, model.counts[p] * model.fold().counts()[bin] / rates[bin]);
    share_out(expected, place, model.counts[p]);
  });
  for (std::size_t j = 0; j < seen.size(); ++j) {
    if (expected[j] > 0) table.density[j] *= seen[j] / expected[j];
  }
  normalise(table);
  model.set_table(table);
}

}  // namespace

StackedPhotons stack_photons(FoldModel& model) {
  StackedPhotons stack = wide_stack(model);
  const std::vector<double>& rates = model.rates();
  const double low_ps = stack.first_ps - stack.step_ps / 2;
  const double high_ps = stack.offset_ps(stack.net.size() - 1) + stack.step_ps / 2;
  for (std::size_t p = 0; p < model.pulses(); ++p) {
    // The photons that are left to this pulse: all photons, less those expected of everything, plus
    // those expected of this pulse.
    const auto add = [&](const Window& window, bool own) {
      for (std::size_t i = 0; i < window.offset_ps.size(); ++i) {
        const double at_ps = window.offset_ps[i];
        if (at_ps < low_ps || at_ps >= high_ps) continue;
        const auto j = static_cast<std::size_t>((at_ps - low_ps) / stack.step_ps);
        const std::size_t k = bin_of(model, window, i);
        const double photons = model.fold().counts()[k];
        stack.net[j] += own ? model.counts[p] * window.h[i] * model.bin_ps() : photons - rates[k];
        if (!own) stack.variance[j] += photons;
      }
    };
    add(model.window(p, low_ps, high_ps), false);
    add(model.window(p), true);
  }
  return stack;
}

void improve_shape(FoldModel& model) {
  for (int round = 0; round < sharpening_rounds; ++round) sharpen(model);
}

void stack_shape(FoldModel& model) {
  const StackedPhotons stack = stack_photons(model);
  const Extent extent = significant_extent(model, stack);
  TabulatedPulse table{stack.offset_ps(extent.begin), stack.step_ps, {}};
  const double peak = *std::max_element(stack.net.begin(), stack.net.end());
  for (std::size_t j = extent.begin; j < extent.end; ++j) {
    // Expectation maximisation would keep a value of zero at zero.
    table.density.push_back(std::max(stack.net[j], 1e-6 * peak));
  }
  normalise(table);
  model.set_table(table);
  improve_shape(model);
}

double pulse_point_ps(const FoldModel& model) {
  double sum = 0, moment = 0;
  const Window window = model.window(0);
  for (std::size_t i = 0; i < window.h.size(); ++i) {
    sum += window.h[i] * window.h[i];
    moment += window.h[i] * window.h[i] * window.offset_ps[i];
  }
  return moment / sum;
}

double std_pulse_point_ps(FoldModel& model) {
  const double point_ps = pulse_point_ps(model);
  const std::vector<double>& rates = model.rates();
  double variance = 0;
  for (std::size_t p = 0; p < model.pulses(); ++p) {
    const Window window = model.window(p);
    double squares = 0;
    for (const double h : window.h) squares += h * h * model.bin_ps();
    for (std::size_t i = 0; i < window.h.size(); ++i) {
      const double moved_ps = 2 * (window.offset_ps[i] - point_ps) * window.h[i] / squares;
      variance += moved_ps * moved_ps * rates[bin_of(model, window, i)];
    }
  }
  return std::sqrt(variance) / model.total_counts();
}

std::vector<double> std_density(FoldModel& model) {
  const TabulatedPulse& table = model.table();
  const std::vector<double>& rates = model.rates();
  std::vector<double> photons(table.density.size());
  model.each_reached([&](std::size_t, const Window& window, std::size_t i, std::size_t bin) {
    share_out(photons, Place(table, window.offset_ps[i]), rates[bin]);
  });
  for (double& value : photons) value = std::sqrt(value) / (model.total_counts() * table.step_ps);
  return photons;
}

}  // namespace splid::calibration
