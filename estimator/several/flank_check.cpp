#include "estimator/several/flank_check.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

namespace splid {
namespace {

constexpr double widened[] = {0.8, 1, 1.25, 1.6, 2, 2.5, 3};
constexpr std::size_t configured = 1;  // of these
constexpr double tails_in_widths[] = {0.7, 1, 1.4, 2, 2.8, 4, 5.6, 8};
// Tails are added up in steps of a fifth of a bin, from so far before the first bin on.
constexpr std::size_t steps_a_bin = 5;
constexpr double step_widths = FlankCheck::bin_widths / steps_a_bin;
constexpr std::size_t bins_before = 40;

// The light of a pulse `wide` times as wide in each step.
std::vector<double> steps_of(const PulseShape& shape, double side, double wide) {
  const std::size_t steps = (bins_before + FlankCheck::bins) * steps_a_bin;
  const double unit_ns = side * shape.width_ns() / wide;
  const double first =
      FlankCheck::first_widths - static_cast<double>(bins_before) * FlankCheck::bin_widths;
  std::vector<double> edges(steps + 1), integrals(steps + 1), light(steps);
  for (std::size_t i = 0; i <= steps; ++i) {
    edges[i] = shape.peak_offset_ns() + (first + static_cast<double>(i) * step_widths) * unit_ns;
  }
  shape.integrate(edges, integrals);
  for (std::size_t i = 0; i < steps; ++i) light[i] = std::abs(integrals[i + 1] - integrals[i]);
  return light;
}

FlankCheck::Bins binned(const std::vector<double>& steps) {
  FlankCheck::Bins sums{};
  for (std::size_t i = 0; i < FlankCheck::bins * steps_a_bin; ++i) {
    sums.at(i / steps_a_bin) += steps[bins_before * steps_a_bin + i];
  }
  return sums;
}

// The sum of the products.
double sum_of(const FlankCheck::Bins& a, const FlankCheck::Bins& b) {
  using Vector = Eigen::Map<const Eigen::Matrix<double, FlankCheck::bins, 1>>;
  return Vector(a.data()).dot(Vector(b.data()));
}

}  // namespace

FlankCheck::FlankCheck(const PulseShape& shape)
    : shapes_{shapes_of(shape, -1), shapes_of(shape, 1)} {
  parts_.reserve(most_parts);
}

FlankCheck::Shapes FlankCheck::shapes_of(const PulseShape& shape, double side) const {
  Shapes shapes;
  for (const double wide : widened) shapes.pulses.push_back(binned(steps_of(shape, side, wide)));
  if (side < 0) return shapes;
  for (const double tail : tails_in_widths) {
    std::vector<double> light = steps_of(shape, side, 1);
    const double kept = std::exp(-step_widths / tail);
    double sum = 0;
    for (double& value : light) value = sum = kept * sum + (1 - kept) * value;
    shapes.tails.push_back(binned(light));
  }
  return shapes;
}

double FlankCheck::nats_for_target(const Bins& counts, double side, const Bins& target,
                                   std::span<const Bins> others) {
  const Shapes& shapes = shapes_.at(side > 0 ? 1 : 0);
  Bins flat;
  flat.fill(1);
  parts_.assign(1, flat);
  take(others);
  const std::size_t common = parts_.size();
  parts_.push_back(shapes.pulses.at(configured));
  parts_.push_back(target);
  const double with_target = best_nats(counts);
  double with_another = -std::numeric_limits<double>::infinity();
  for (std::size_t wider = 1; wider < shapes.pulses.size(); ++wider) {
    parts_.resize(common);
    take(std::span(shapes.pulses).subspan(wider - 1, 2));
    take(shapes.tails);
    with_another = std::max(with_another, best_nats(counts));
  }
  return with_target - with_another;
}

// Newton's method: each round goes to the top of the parabola at the shares, as far as no share is
// below 0, which is found share by share. Expectation maximisation is the way there from afar; near
// the top it would take a thousand rounds, as pulses of two widths are much alike.
double FlankCheck::best_nats(const Bins& counts) {
  constexpr int rounds = 12;
  constexpr double settled_nats = 0.02;
  double all = 0;
  for (const double count : counts) all += count;
  for (Bins& part : parts_) {
    double sum = 1e-300;
    for (const double light : part) sum += light;
    for (double& light : part) light /= sum;
  }
  Shares at{};
  std::fill_n(at.begin(), parts_.size(), all / static_cast<double>(parts_.size()));
  for (int round = 0; round < 5; ++round) at = maximised(counts, at);
  Slopes slopes = derive(counts, at);
  for (int round = 0; round < rounds; ++round) {
    Shares to = top_of(slopes, at);
    Slopes there = derive(counts, to);
    for (int halving = 0; halving < 8 && there.nats < slopes.nats; ++halving) {
      for (std::size_t p = 0; p < parts_.size(); ++p) to[p] = (to[p] + at[p]) / 2;
      there = derive(counts, to);
    }
    const double gained = there.nats - slopes.nats;
    if (!(gained > 0)) break;
    at = to;
    slopes = there;
    if (gained < settled_nats) break;
  }
  return slopes.nats;
}

FlankCheck::Bins FlankCheck::light_of(const Shares& at) const {
  Bins light{};
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    for (std::size_t i = 0; i < bins; ++i) light[i] += at[p] * parts_[p][i];
  }
  for (double& all : light) all = std::max(all, 1e-100);
  return light;
}

FlankCheck::Shares FlankCheck::maximised(const Bins& counts, const Shares& at) const {
  Bins ratio = light_of(at);
  for (std::size_t i = 0; i < bins; ++i) ratio[i] = counts[i] / ratio[i];
  Shares next{};
  for (std::size_t p = 0; p < parts_.size(); ++p) next[p] = at[p] * sum_of(ratio, parts_[p]);
  return next;
}

FlankCheck::Slopes FlankCheck::derive(const Bins& counts, const Shares& at) const {
  Slopes slopes;
  Bins ratio, weight, weighted;
  const Bins light = light_of(at);
  for (std::size_t i = 0; i < bins; ++i) {
    ratio[i] = counts[i] / light[i];
    weight[i] = ratio[i] / light[i];
    slopes.nats += (counts[i] > 0 ? counts[i] * std::log(light[i]) : 0) - light[i];
  }
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    slopes.gradient[p] = sum_of(ratio, parts_[p]) - 1;
    for (std::size_t i = 0; i < bins; ++i) weighted[i] = weight[i] * parts_[p][i];
    for (std::size_t q = 0; q <= p; ++q) {
      slopes.curvature[p][q] = slopes.curvature[q][p] = sum_of(weighted, parts_[q]);
    }
  }
  return slopes;
}

FlankCheck::Shares FlankCheck::top_of(const Slopes& slopes, const Shares& at) const {
  constexpr int sweeps = 100;
  constexpr double little_nats = 1e-3;
  Shares to = at;
  Shares slope = slopes.gradient;
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    double gained = 0;
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      if (!(slopes.curvature[p][p] > 0)) continue;
      const double moved = std::max(-to[p], slope[p] / slopes.curvature[p][p]);
      gained += moved * (slope[p] - moved * slopes.curvature[p][p] / 2);
      to[p] += moved;
      for (std::size_t q = 0; q < parts_.size(); ++q) slope[q] -= moved * slopes.curvature[p][q];
    }
    if (gained < little_nats) break;
  }
  return to;
}

}  // namespace splid
