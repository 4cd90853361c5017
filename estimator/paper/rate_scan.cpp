#include "estimator/paper/rate_scan.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/fold/kernel_choice.hpp"
#include "estimator/search/taylor_tree.hpp"

namespace splid::paper {
namespace {

constexpr std::size_t slices = 32;
// The coarse power of fewer rates is not worth the tree.
constexpr std::size_t few_rates = 2 * slices;
// With few photons the power is that of a few pairs that lie in one bin, and its spread is no
// measure of what the coarse power errs by. So many photons are enough where their square is so
// many times the number of bins.
constexpr double enough_pairs = 128;
constexpr double near_deviations = 1.5;
constexpr double near_share = 0.25;

// The coarse powers of 32 rates at a time.
class CoarsePower {
 public:
  CoarsePower(const HarmonicPower& power, double step)
      : photons_(power.photons()),
        step_(step),
        kernels_(best_search_kernels()),
        grid_{.bins = static_cast<std::uint32_t>(power.bins()), .slices = slices},
        roomy_{.bins = grid_.bins + 2, .slices = slices},
        tree_(kernels_, {&roomy_, 1}),
        folded_(photons_.size()),
        rows_(photons_.size()),
        phases_(photons_.size()),
        cells_(photons_.size()) {
    lay_out();
  }

  // The powers of the rates (first + j) * step, j below 32.
  void add_to(std::vector<double>& powers, double first) {
    fold((first + middle) * step_);
    const std::size_t at = powers.size();
    powers.resize(at + slices, 0.0);
    const std::span<double> to = std::span(powers).subspan(at);
    if (!add_as(bytes_, to) && !add_as(words_, to)) add_as(longs_, to);
  }

 private:
  // The photons are folded at the rate of this line.
  static constexpr double middle = 0.5 * slices;

  // A line that walks j bins is j k / 31 bins further on in slice k. So the slices' middles are
  // 31 intervals apart from end to end, and the first and the last slice are half as long. A
  // photon's phase at the first rate is the one at the middle rate, except for what the slice as a
  // whole moves by between these.
  void lay_out() {
    const auto [first, last] =
        std::minmax_element(photons_.time_ns.begin(), photons_.time_ns.end());
    begin_ns_ = *first;
    const double slices_per_ns = (slices - 1) / (*last - *first);
    const double units_per_ns = 0x1p32 / photons_.period_ns;
    for (std::size_t i = 0; i < photons_.size(); ++i) {
      const double slice = std::round((photons_.time_ns[i] - begin_ns_) * slices_per_ns);
      const double moved_ns = middle * step_ * slice / slices_per_ns;
      rows_[i] = static_cast<std::uint32_t>(slice) * grid_.bins;
      folded_[i] = static_cast<std::uint32_t>(
          std::llround((photons_.phase_ns[i] + moved_ns) * units_per_ns));
    }
  }

  void fold(double rate) {
    const double units_per_ns = 0x1p32 / photons_.period_ns;
    kernels_.line_phases(phases_.data(), folded_.data(), photons_.time_ns.data(),
                         -rate * begin_ns_ * units_per_ns, rate * units_per_ns, photons_.size());
    kernels_.delay_cells(cells_.data(), rows_.data(), phases_.data(), 0, photons_.size(),
                         grid_.bins);
  }

  // False, with nothing added, where a cell holds more photons than its type.
  template <class Count>
  bool add_as(std::vector<Count>& counts, std::span<double> powers) {
    counts.assign(grid_.cells(), Count{0});
    bool fits = true;
    for (const std::uint32_t cell : cells_) fits &= ++counts[cell] != 0;
    if (!fits) return false;
    const std::size_t most = slices - 1;
    // Each block has a bin more on either side, for the smoothing.
    const std::size_t inside = TaylorTree::block_bins(roomy_, most) - 2;
    for (std::size_t bin = 0; bin < grid_.bins; bin += inside) {
      const std::size_t here = std::min<std::size_t>(inside, grid_.bins - bin);
      tree_.add_up(counts.data(), grid_, {(bin + grid_.bins - 1) % grid_.bins, here + 2, most, 1});
      for (std::size_t j = 0; j <= most; ++j) powers[j] += tree_.smooth_power(j);
    }
    return true;
  }

  const TrainPhotons& photons_;
  double step_;
  double begin_ns_ = 0;
  const SearchKernels& kernels_;
  SearchGrid grid_, roomy_;
  TaylorTree tree_;
  // The photons in each bin of each slice, in the smallest type that holds them.
  std::vector<std::uint8_t> bytes_;
  std::vector<std::uint16_t> words_;
  std::vector<std::uint32_t> longs_;
  std::vector<std::uint32_t> folded_, rows_;   // of each photon: phase in 2^-32 periods, first cell
  std::vector<std::uint32_t> phases_, cells_;  // at the rate of the last fold()
};

std::size_t count_of(int steps) { return 2 * static_cast<std::size_t>(steps) + 1; }

// The coarse powers of all rates; none where these are few, or few photons lie together.
std::vector<double> coarse_powers(const HarmonicPower& power, double step, int steps) {
  std::vector<double> powers;
  const std::size_t rates = count_of(steps);
  const auto photons = static_cast<double>(power.photons().size());
  const bool has_pairs = photons * photons > enough_pairs * static_cast<double>(power.bins());
  if (rates <= few_rates || !has_pairs) return powers;
  CoarsePower coarse(power, step);
  while (powers.size() < rates) coarse.add_to(powers, static_cast<double>(powers.size()) - steps);
  powers.resize(rates);
  return powers;
}

// The least coarse power of a rate that may be the best.
double least_to_try(const std::vector<double>& powers) {
  if (powers.empty()) return 0;
  const auto count = static_cast<double>(powers.size());
  const double most = *std::max_element(powers.begin(), powers.end());
  double below = 0;
  double squares = 0;
  for (const double power : powers) {
    below += (most - power) / count;
    squares += (most - power) * (most - power) / count;
  }
  const double deviation = std::sqrt(std::max(0.0, squares - below * below));
  return most - std::max(near_deviations * deviation, near_share * below);
}

}  // namespace

double best_rate(HarmonicPower& power, double step, int steps) {
  const std::vector<double> coarse = coarse_powers(power, step, steps);
  const double least = least_to_try(coarse);
  double best = 0;
  double largest = 0;
  for (std::size_t n = 0; n < count_of(steps); ++n) {
    if (!coarse.empty() && coarse[n] < least) continue;
    const double rate = (static_cast<double>(n) - steps) * step;
    const double here = power(rate);
    if (here <= largest) continue;
    largest = here;
    best = rate;
  }
  return best;
}

}  // namespace splid::paper
