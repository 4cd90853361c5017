#include "estimator/sync/sync_curvature.hpp"

#include <array>
#include <cmath>

#include "estimator/sync/deviations.hpp"
#include "estimator/sync/round_quickly.hpp"

namespace splid::sync {
namespace {

constexpr std::size_t blocks = 16;
constexpr std::size_t least_blocks = blocks / 2;
constexpr std::size_t least_in_block = 4;
constexpr std::size_t most_in_block = 32;

constexpr double std_of_median = 1.2533;  // of gaussian values, over that of their mean

double median(std::span<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// The syncs near the line, of an evenly thinned part of the syncs from `begin` to before `end`.
struct Sample {
  std::size_t taken = 0;
  std::size_t near = 0;
  std::array<double, most_in_block> off_ps;
  double sum_ps = 0;  // of the times of those near

  Sample(std::span<const double> syncs, std::size_t begin, std::size_t end, const Line& line) {
    const std::size_t stride = (end - begin + most_in_block - 1) / most_in_block;
    const double window_ps = first_window_ps(line.period_ps);
    for (std::size_t i = begin; i < end; i += stride) {
      const double x_ps = syncs[is_double(syncs, i, line.period_ps) ? i - 1 : i];
      const double from_phase_ps = line.straight_ps(x_ps) - line.phase_ps;
      const double k = round_quickly(from_phase_ps / line.period_ps);
      const double residual_ps = from_phase_ps - k * line.period_ps;
      ++taken;
      if (std::abs(residual_ps) > window_ps) continue;
      off_ps[near++] = residual_ps;
      sum_ps += x_ps;
    }
  }
};

// How far from a line the syncs of each 16th of them are. Those 16ths in which most syncs are far
// from the line are left out.
struct BlockMedians {
  std::size_t count = 0;
  std::array<Point, blocks> points;  // k: the mean time of a 16th, ps; its median distance
  double sigma_ps = 0;               // robust, of the syncs about their 16th's median
  double std_ps = 0;                 // of a median
};

std::optional<BlockMedians> block_medians(std::span<const double> syncs, const Line& line) {
  if (syncs.size() < blocks * least_in_block) return std::nullopt;
  BlockMedians m;
  std::array<double, blocks * most_in_block> deviations;
  std::size_t near = 0;
  std::size_t taken = 0;
  std::size_t used = 0;
  for (std::size_t block = 0; block < blocks; ++block) {
    Sample sample(syncs, block * syncs.size() / blocks, (block + 1) * syncs.size() / blocks, line);
    taken += sample.taken;
    near += sample.near;
    if (2 * sample.near <= sample.taken) continue;
    const std::span<double> off(sample.off_ps.data(), sample.near);
    const double median_ps = median(off);
    m.points[m.count++] = {sample.sum_ps / static_cast<double>(sample.near), median_ps};
    for (const double off_ps : off) deviations[used++] = std::abs(off_ps - median_ps);
  }
  if (2 * near <= taken || m.count < least_blocks) return std::nullopt;
  m.sigma_ps = robust_sigma_ps({deviations.data(), used});
  m.std_ps = std_of_median * m.sigma_ps *
             std::sqrt(static_cast<double>(m.count) / static_cast<double>(used));
  return m;
}

}  // namespace

double robust_sigma_ps(std::span<double> deviations_ps) {
  constexpr double sigma_per_mad = 1.4826;  // of a gaussian: sigma over median deviation
  return std::max(sigma_per_mad * median(deviations_ps), least_sigma_ps);
}

std::optional<Departure> departure(std::span<const double> syncs, const Line& line) {
  auto medians = block_medians(syncs, line);
  if (!medians) return std::nullopt;
  const std::span<Point> points(medians->points.data(), medians->count);
  // Their times become those from their mean, in units of their reach.
  double mean_ps = 0, reach_ps = 0;
  for (const Point& p : points) mean_ps += p.k / static_cast<double>(points.size());
  for (const Point& p : points) reach_ps = std::max(reach_ps, std::abs(p.k - mean_ps));
  Sums sums;
  for (Point& p : points) {
    p.k = (p.k - mean_ps) / reach_ps;
    sums.add(p);
    sums.add_for_parabola(p);
  }
  const Parabola straight = straight_through(sums), curved = parabola_through(sums);
  const double sure_ps = sure_deviations_of_many * medians->std_ps;
  const bool curves = std::abs(curved.c) * std::sqrt(curved.spread_c) > sure_ps;
  const Parabola& best = curves ? curved : straight;

  double farthest_ps = 0, first_ps = 0, last_ps = 0;
  for (const Point& p : points) {
    farthest_ps = std::max(farthest_ps, std::abs(p.residual_ps - best.at(p.k)));
    first_ps = std::min(first_ps, p.residual_ps - straight.at(p.k));
    last_ps = std::max(last_ps, p.residual_ps - straight.at(p.k));
  }
  const double slope = best.b / reach_ps, square = best.c / (reach_ps * reach_ps);
  const Line later = line.later(best.a - slope * mean_ps + square * mean_ps * mean_ps,
                                slope - 2 * square * mean_ps, square);
  return Departure{later.at_origin(), medians->sigma_ps,
                   farthest_ps > sure_ps ? last_ps - first_ps : 0};
}

}  // namespace splid::sync
