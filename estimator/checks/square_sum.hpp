#pragma once

#include <cmath>

namespace splid::checks {

// Whether counts differ from what is expected by more than chance: the sum of (n - m)^2 - n, which
// is zero on average for counts of Poisson. Its tail is that of a gamma distribution of its own
// variance and skewness; chi squared of cells of less than a count has one that no factor mends.
struct SquareSum {
  double excess = 0;    // of squared deviations, less the part of chance
  double variance = 0;  // of it, by chance
  double third = 0;     // cumulant
  double scale = 0;     // squares of the light that is expected

  void add(double count, double expected, double light = 0) {
    excess += (count - expected) * (count - expected) - count;
    variance += 2 * expected * expected;
    third += expected * expected * (8 * expected + 4);
    scale += light * light;
  }
  // The same for so many counts of one expected value, by their sum and the sum of their squares.
  void add_alike(double cells, double expected, double sum, double squares) {
    excess += squares - 2 * expected * sum + cells * expected * expected - sum;
    variance += cells * 2 * expected * expected;
    third += cells * expected * expected * (8 * expected + 4);
  }
  // Chance exceeds a gain of g in about as many frames as a normal number exceeds sqrt(2 g).
  [[nodiscard]] double gain_nats() const {
    if (!(excess > 0) || !(variance > 0)) return 0;
    const double shape = 4 * variance * variance * variance / (third * third);
    const double more = excess / std::sqrt(variance * shape);
    return shape * (more - std::log1p(more));
  }
  // The relative rms deviation from the light that is expected.
  [[nodiscard]] double relative() const {
    return scale > 0 ? std::sqrt(std::fmax(excess, 0) / scale) : 0;
  }
};

}  // namespace splid::checks
