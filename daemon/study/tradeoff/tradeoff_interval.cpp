#include "daemon/study/tradeoff/tradeoff_interval.hpp"

#include <cmath>
#include <numeric>

namespace splid::tradeoff {
namespace {

// The quantile of 97.5 % of Student's t, by the expansion of Cornish and Fisher; to 1.5 % from two
// degrees of freedom on.
double student_quantile(double degrees) {
  constexpr double z = 1.959964;
  const double z2 = z * z;
  const double first = z * (z2 + 1) / 4;
  const double second = z * ((5 * z2 + 16) * z2 + 3) / 96;
  const double third = z * (((3 * z2 + 19) * z2 + 17) * z2 - 15) / 384;
  return z + (first + (second + third / degrees) / degrees) / degrees;
}

}  // namespace

std::optional<Interval> interval_of_rms(double mean_square, std::span<const double> without,
                                        double shared) {
  constexpr std::size_t fewest_blocks = 3;
  if (without.size() < fewest_blocks) return std::nullopt;
  const auto count = static_cast<double>(without.size());
  const double mean = std::accumulate(without.begin(), without.end(), 0.0) / count;
  double squares = 0;
  for (const double value : without) squares += (value - mean) * (value - mean);
  const double deviation = std::sqrt((count - 1) / count * squares / (1 - shared)) / mean_square;
  const double middle = 1 - deviation * deviation / 9;
  const double half = student_quantile(count - 1) * deviation / 3;
  if (!(middle > half)) return std::nullopt;
  return Interval{std::pow(middle + half, -1.5), std::pow(middle - half, -1.5)};
}

}  // namespace splid::tradeoff
