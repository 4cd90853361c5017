#include "estimator/sync/sync_curvature.hpp"

#include <cmath>

namespace splid::sync {
namespace {

constexpr std::size_t least_in_block = 4;
constexpr std::size_t most_in_block = 32;
constexpr std::size_t least_blocks = BlockMedians::most / 2;

constexpr double curved_deviations = 6;
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

// off = a + b x + c x^2, with x from the medians' mean time, over scale_ps.
struct Curvature {
  double mean_ps = 0, scale_ps = 0;
  double a = 0, b = 0, c = 0;
  bool sure = false;
};

Curvature curvature_of(const BlockMedians& m) {
  const auto n = static_cast<double>(m.count);
  Curvature curvature;
  for (std::size_t i = 0; i < m.count; ++i) curvature.mean_ps += m.at_ps[i] / n;
  for (std::size_t i = 0; i < m.count; ++i) {
    curvature.scale_ps = std::max(curvature.scale_ps, std::abs(m.at_ps[i] - curvature.mean_ps));
  }
  // Sums of the powers of x, whose own sum is 0, and of the medians times these.
  double square = 0, cube = 0, fourth = 0, off = 0, x_off = 0, square_off = 0;
  for (std::size_t i = 0; i < m.count; ++i) {
    const double x = (m.at_ps[i] - curvature.mean_ps) / curvature.scale_ps;
    square += x * x;
    cube += x * x * x;
    fourth += x * x * x * x;
    off += m.off_ps[i];
    x_off += x * m.off_ps[i];
    square_off += x * x * m.off_ps[i];
  }
  const double spread = fourth - square * square / n - cube * cube / square;
  const double c = (square_off - square * off / n - cube / square * x_off) / spread;
  curvature.sure = std::abs(c) * std::sqrt(spread) > curved_deviations * m.std_ps;
  if (curvature.sure) curvature.c = c;
  curvature.b = (x_off - curvature.c * cube) / square;
  curvature.a = (off - curvature.c * square) / n;
  return curvature;
}

}  // namespace

double BlockMedians::farthest_ps() const {
  double sum_ps = 0;
  for (std::size_t i = 0; i < count; ++i) sum_ps += off_ps[i];
  const double mean_ps = sum_ps / static_cast<double>(count);
  double farthest = 0;
  for (std::size_t i = 0; i < count; ++i) {
    farthest = std::max(farthest, std::abs(off_ps[i] - mean_ps));
  }
  return farthest > curved_deviations * std_ps ? farthest : 0;
}

std::optional<BlockMedians> block_medians(std::span<const double> syncs, const Line& line) {
  constexpr std::size_t blocks = BlockMedians::most;
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
    m.at_ps[m.count] = sample.sum_ps / static_cast<double>(sample.near);
    m.off_ps[m.count++] = median_ps;
    for (const double off_ps : off) deviations[used++] = std::abs(off_ps - median_ps);
  }
  if (2 * near <= taken || m.count < least_blocks) return std::nullopt;
  m.sigma_ps = std::max(sigma_per_mad * median({deviations.data(), used}), least_sigma_ps);
  m.std_ps = std_of_median * m.sigma_ps *
             std::sqrt(static_cast<double>(m.count) / static_cast<double>(used));
  return m;
}

// Twice, as a curvature that is still unknown widens the spread within the blocks.
std::optional<Line> curved_line(std::span<const double> syncs, Line line) {
  for (int round = 0; round < 2; ++round) {
    const auto medians = block_medians(syncs, line);
    if (!medians) return std::nullopt;
    const Curvature curvature = curvature_of(*medians);
    const double slope = curvature.b / curvature.scale_ps;
    const double square = curvature.c / (curvature.scale_ps * curvature.scale_ps);
    line = line.later(curvature.a - slope * curvature.mean_ps +
                          square * curvature.mean_ps * curvature.mean_ps,
                      slope - 2 * square * curvature.mean_ps, square)
               .at_origin();
  }
  return line;
}

double wander_ps(std::span<const double> syncs, const Line& line) {
  const auto medians = block_medians(syncs, line);
  if (!medians) return 0;
  const BlockMedians& m = *medians;
  const Curvature parabola = curvature_of(m);
  double farthest = 0, off = 0, x_off = 0, square = 0;
  for (std::size_t i = 0; i < m.count; ++i) {
    const double x = (m.at_ps[i] - parabola.mean_ps) / parabola.scale_ps;
    const double at = parabola.a + x * (parabola.b + x * parabola.c);
    farthest = std::max(farthest, std::abs(m.off_ps[i] - at));
    off += m.off_ps[i], x_off += x * m.off_ps[i], square += x * x;
  }
  if (farthest <= curved_deviations * m.std_ps) return 0;
  const auto n = static_cast<double>(m.count);
  double first = 0, last = 0;
  for (std::size_t i = 0; i < m.count; ++i) {
    const double x = (m.at_ps[i] - parabola.mean_ps) / parabola.scale_ps;
    const double from_line = m.off_ps[i] - off / n - x * x_off / square;
    first = std::min(first, from_line), last = std::max(last, from_line);
  }
  return last - first;
}

bool is_straight(std::span<const double> syncs, const Line& line) {
  const auto medians = block_medians(syncs, line);
  return medians && medians->farthest_ps() == 0 && !curvature_of(*medians).sure;
}

}  // namespace splid::sync
