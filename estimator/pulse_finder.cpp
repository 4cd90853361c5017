#include "estimator/pulse_finder.hpp"

#include <algorithm>
#include <cmath>

namespace splid {
namespace {

// Design note: a tenth of sigma; the rounding to bins then widens a pulse by 0.04 %.
constexpr double bins_per_sigma = 10;
constexpr double separation_sigmas = 6;
// A background maximum over the 10^5 places of a long pattern stays below 5 deviations; 8 leaves
// room for a background that is not flat. A twentieth of the strongest pulse keeps its own tail
// out.
constexpr double deviations_above_background = 8;
constexpr double least_of_strongest = 0.05;

}  // namespace

PulseFinder::PulseFinder(double period_ps, double sigma_ps)
    : sigma_ps_(sigma_ps), period_ps_(period_ps) {
  const double bins = std::ceil(period_ps / sigma_ps * bins_per_sigma);
  bins_.resize(static_cast<std::size_t>(std::clamp(bins, 1.0, 1e7)));
  bin_ps_ = period_ps / static_cast<double>(bins_.size());
}

void PulseFinder::add(const FrameView& frame) {
  if (!frame.sync.locked) return;
  const auto bins = static_cast<double>(bins_.size());
  for (const std::int64_t photon_ps : frame.photons_ps) {
    double turns = (static_cast<double>(photon_ps - frame.sync.origin_ps) - frame.sync.phase_ps) /
                   frame.sync.period_ps;
    turns -= std::floor(turns);
    ++bins_[std::min(static_cast<std::size_t>(turns * bins), bins_.size() - 1)];
  }
  photons_ += frame.photons_ps.size();
  period_sum_ps_ += frame.sync.period_ps * static_cast<double>(frame.photons_ps.size());
}

double PulseFinder::mean_period_ps() const {
  return photons_ > 0 ? period_sum_ps_ / static_cast<double>(photons_) : 0;
}

double PulseFinder::count_about(std::ptrdiff_t bin, std::ptrdiff_t half_width) const {
  const auto bins = static_cast<std::ptrdiff_t>(bins_.size());
  double sum = 0;
  for (std::ptrdiff_t k = bin - half_width; k <= bin + half_width; ++k) {
    sum += bins_[static_cast<std::size_t>(((k % bins) + bins) % bins)];
  }
  return sum;
}

// The centre of what a gaussian of the pulse's width holds there: where the likelihood of such a
// pulse has its maximum, tails or no tails.
double PulseFinder::settle(double time_ps, double background_per_bin) const {
  const auto bins = static_cast<std::ptrdiff_t>(bins_.size());
  const auto reach = static_cast<std::ptrdiff_t>(4 * sigma_ps_ / bin_ps_);
  for (int round = 0; round < 100; ++round) {
    const auto middle = static_cast<std::ptrdiff_t>(std::floor(time_ps / bin_ps_));
    double sum = 0, moment = 0;
    for (std::ptrdiff_t k = middle - reach; k <= middle + reach; ++k) {
      const double at_ps = (static_cast<double>(k) + 0.5) * bin_ps_;
      const double x = (at_ps - time_ps) / sigma_ps_;
      const double weight = std::exp(-0.5 * x * x);
      const auto index = static_cast<std::size_t>(((k % bins) + bins) % bins);
      const double count = weight * (bins_[index] - background_per_bin);
      sum += count;
      moment += count * at_ps;
    }
    if (!(sum > 0)) break;
    // The weight itself draws the mean to the middle by half: step twice as far.
    const double next_ps = time_ps + 2 * (moment / sum - time_ps);
    const double moved_ps = std::abs(next_ps - time_ps);
    time_ps = next_ps;
    if (moved_ps < 1e-3) break;
  }
  return time_ps - period_ps_ * std::floor(time_ps / period_ps_);
}

std::vector<FoundPulse> PulseFinder::find() const {
  const auto bins = static_cast<std::ptrdiff_t>(bins_.size());
  const auto half = static_cast<std::ptrdiff_t>(bins_per_sigma * 1.5);
  if (photons_ == 0 || bins <= 2 * half + 1) return {};
  // Photons within 1.5 sigma of each phase, as a running sum.
  std::vector<double> near(bins_.size());
  double sum = count_about(0, half);
  for (std::ptrdiff_t k = 0; k < bins; ++k) {
    near[static_cast<std::size_t>(k)] = sum;
    sum += bins_[static_cast<std::size_t>((k + half + 1) % bins)];
    sum -= bins_[static_cast<std::size_t>((k - half + bins) % bins)];
  }
  // Pulses fill less than half of most periods, so the lower quartile is background.
  std::vector<double> sorted = near;
  const auto quartile = sorted.begin() + bins / 4;
  std::nth_element(sorted.begin(), quartile, sorted.end());
  const double background = *quartile;
  const double strongest = *std::max_element(near.begin(), near.end()) - background;
  const double least =
      background + std::max(deviations_above_background * std::sqrt(background + 1),
                            least_of_strongest * strongest);

  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < near.size(); ++k) {
    if (near[k] > least) order.push_back(k);
  }
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return near[a] != near[b] ? near[a] > near[b] : a < b;
  });
  std::vector<FoundPulse> found;
  const double per_bin = background / static_cast<double>(2 * half + 1);
  double total = 0;
  for (const std::size_t k : order) {
    const auto taken = [&](double time_ps) {
      return std::any_of(found.begin(), found.end(), [&](const FoundPulse& other) {
        return std::abs(std::remainder(other.time_ps - time_ps, period_ps_)) <
               separation_sigmas * sigma_ps_;
      });
    };
    if (taken((static_cast<double>(k) + 0.5) * bin_ps_)) continue;
    // A place on a stronger pulse's tail settles onto that pulse.
    const double time_ps = settle((static_cast<double>(k) + 0.5) * bin_ps_, per_bin);
    if (taken(time_ps)) continue;
    found.push_back({time_ps, near[k] - background});
    total += near[k] - background;
  }
  for (FoundPulse& pulse : found) {
    pulse.amplitude *= static_cast<double>(found.size()) / total;
  }
  std::sort(found.begin(), found.end(),
            [](const FoundPulse& a, const FoundPulse& b) { return a.time_ps < b.time_ps; });
  return found;
}

}  // namespace splid
