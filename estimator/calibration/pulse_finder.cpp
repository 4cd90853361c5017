#include "estimator/calibration/pulse_finder.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "estimator/model/pulse_shape.hpp"

namespace splid::calibration {
namespace {

// Photons stand out of the background by so many deviations. The highest place of the background,
// among the 10^5 places of a long pattern, stays below 5; 8 leaves room for a background that is
// not flat.
constexpr double outstanding_deviations = 8;
// The twentieth of the strongest pulse keeps that pulse's own tail out.
constexpr double least_of_strongest = 0.05;

// A cell of so many standard deviations of a gaussian holds half of the excess of pairs, for each
// length of the cell, that a short cell holds: with a = L / (2 sigma),
// sqrt(pi) erf(a) / a - (1 - exp(-a^2)) / a^2 is 1/2 at a = 2.85.
constexpr double half_cell_sigmas = 5.7;

// Photons come at whole picoseconds. On a pattern period of a whole number of them, cells that are
// shorter show these.
constexpr double shortest_cell_ps = 4;

class Finder {
 public:
  Finder(const PhaseHistogram& fold, double width_ps)
      : fold_(fold),
        width_ps_(width_ps),
        bin_ps_(fold.bin_ps()),
        period_ps_(fold.period().period_ps),
        half_(std::max<std::ptrdiff_t>(1, std::lround(half_pulse_widths * width_ps / bin_ps_))) {}

  std::vector<FoundPulse> find() {
    if (fold_.photons() == 0 || static_cast<std::ptrdiff_t>(fold_.bins()) <= 2 * half_ + 1) {
      return {};
    }
    fill_near();
    // Pulses fill less than half of most periods, so the lower quartile is background.
    std::vector<double> sorted = near_;
    const auto quartile = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 4);
    std::nth_element(sorted.begin(), quartile, sorted.end());
    background_ = *quartile;
    std::vector<FoundPulse> found;
    const auto taken = [&](double time_ps) {
      return std::any_of(found.begin(), found.end(), [&](const FoundPulse& other) {
        return std::abs(std::remainder(other.time_ps - time_ps, period_ps_)) <
               pulse_reach_widths * width_ps_;
      });
    };
    for (const std::size_t k : places()) {
      const double place_ps = (static_cast<double>(k) + 0.5) * bin_ps_;
      if (taken(place_ps)) continue;
      // A place on the tail of a stronger pulse moves onto that pulse, and is then dropped.
      const double time_ps = settle(place_ps);
      if (!taken(time_ps)) found.push_back({time_ps, near_[k] - background_});
    }
    std::sort(found.begin(), found.end(),
              [](const FoundPulse& a, const FoundPulse& b) { return a.time_ps < b.time_ps; });
    return found;
  }

 private:
  [[nodiscard]] double counts_in(std::ptrdiff_t bin) const {
    return fold_.counts()[fold_.wrapped(bin)];
  }

  void fill_near() {
    near_.resize(fold_.bins());
    double sum = 0;
    for (std::ptrdiff_t k = -half_; k <= half_; ++k) sum += counts_in(k);
    for (std::ptrdiff_t k = 0; k < static_cast<std::ptrdiff_t>(near_.size()); ++k) {
      near_[static_cast<std::size_t>(k)] = sum;
      sum += counts_in(k + half_ + 1) - counts_in(k - half_);
    }
  }

  // The places at which photons stand out, those with the most photons first.
  [[nodiscard]] std::vector<std::size_t> places() const {
    const double strongest = *std::max_element(near_.begin(), near_.end()) - background_;
    const double least = background_ + std::max(outstanding_deviations * std::sqrt(background_ + 1),
                                                least_of_strongest * strongest);
    std::vector<std::size_t> order;
    for (std::size_t k = 0; k < near_.size(); ++k) {
      if (near_[k] > least) order.push_back(k);
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return near_[a] > near_[b]; });
    return order;
  }

  // The time of the pulse at a place: the mean of the photons weighted by a gaussian of the pulse's
  // width about that time. There the likelihood of a gaussian pulse has its maximum, and tails of
  // the true pulse move it little.
  [[nodiscard]] double settle(double time_ps) const {
    const double per_bin = background_ / static_cast<double>(2 * half_ + 1);
    const auto reach = static_cast<std::ptrdiff_t>(4 * width_ps_ / bin_ps_);
    for (int round = 0; round < 100; ++round) {
      const auto middle = static_cast<std::ptrdiff_t>(std::floor(time_ps / bin_ps_));
      double sum = 0, moment = 0;
      for (std::ptrdiff_t k = middle - reach; k <= middle + reach; ++k) {
        const double at_ps = (static_cast<double>(k) + 0.5) * bin_ps_;
        const double x = (at_ps - time_ps) / width_ps_;
        const double count = std::exp(-0.5 * x * x) * (counts_in(k) - per_bin);
        sum += count;
        moment += count * at_ps;
      }
      if (!(sum > 0)) break;
      // The weights draw the mean halfway back to the present place, so the step is doubled.
      const double next_ps = time_ps + 2 * (moment / sum - time_ps);
      const double moved_ps = std::abs(next_ps - time_ps);
      time_ps = next_ps;
      if (moved_ps < 1e-3 * width_ps_) break;
    }
    return time_ps - period_ps_ * std::floor(time_ps / period_ps_);
  }

  const PhaseHistogram& fold_;
  double width_ps_, bin_ps_, period_ps_;
  std::ptrdiff_t half_;
  std::vector<double> near_;  // for each bin: the photons within half_ bins of it
  double background_ = 0;     // the background's part of each of these
};

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

std::vector<FoundPulse> find_pulses(const PhaseHistogram& fold, double width_ps) {
  return Finder(fold, width_ps).find();
}

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
      whole = pairs.excess;
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
