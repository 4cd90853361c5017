#include "estimator/calibration/pair_width.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "estimator/calibration/pulse_finder.hpp"

namespace splid::calibration {
namespace {

// A cell of so many standard deviations of a gaussian holds half of the excess of pairs, for each
// length of the cell, that a short cell holds: with a = L / (2 sigma),
// sqrt(pi) erf(a) / a - (1 - exp(-a^2)) / a^2 is 1/2 at a = 2.85.
constexpr double half_cell_sigmas = 5.7;

// Photons come at whole picoseconds. On a pattern period of a whole number of them, cells that are
// shorter show these.
constexpr double shortest_cell_ps = 4;

// Pairs of photons in the same cell, over those of as many photons that are anywhere.
struct Pairs {
  double excess = 0;     // less 1
  double deviation = 0;  // of the excess, by chance
};

Pairs pairs_in(const std::vector<std::uint32_t>& cells, double photons) {
  double pairs = 0;
  for (const std::uint32_t count : cells) pairs += static_cast<double>(count) * (count - 1.0);
  const double by_chance = photons * (photons - 1) / static_cast<double>(cells.size());
  return {pairs / by_chance - 1, std::sqrt(2 * (pairs + 1)) / by_chance};
}

std::vector<std::uint32_t> joined(const std::vector<std::uint32_t>& cells) {
  std::vector<std::uint32_t> twice(cells.size() / 2);
  for (std::size_t i = 0; i < twice.size(); ++i) twice[i] = cells[2 * i] + cells[2 * i + 1];
  return twice;
}

}  // namespace

std::optional<double> width_by_pairs_ps(const PhaseHistogram& fold) {
  const auto photons = static_cast<double>(fold.photons());
  if (photons < 2) return std::nullopt;
  std::vector<std::uint32_t> cells = fold.counts();
  double cell_ps = fold.bin_ps();
  double whole = 0;   // excess of the shortest cells that show it
  double before = 0;  // excess of cells half as long
  for (; cells.size() >= 4; cells = joined(cells), cell_ps *= 2) {
    if (cell_ps < shortest_cell_ps) continue;
    const Pairs pairs = pairs_in(cells, photons);
    if (!(whole > 0)) {
      if (pairs.excess < outstanding_deviations * pairs.deviation) continue;
      whole = before = pairs.excess;
      continue;
    }
    if (pairs.excess > whole / 2) {
      before = pairs.excess;
      continue;
    }
    // Between this length of a cell and half of it, on logarithmic axes.
    const double step = std::log(before / (whole / 2)) / std::log(before / pairs.excess);
    return cell_ps / 2 * std::pow(2, step) / half_cell_sigmas;
  }
  return std::nullopt;
}

}  // namespace splid::calibration
