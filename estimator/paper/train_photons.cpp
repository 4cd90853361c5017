#include "estimator/paper/train_photons.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "estimator/model/units.hpp"

namespace splid::paper {
namespace {

// A train is folded on so many bins at most.
constexpr double most_fold_bins = 0x1p18;

}  // namespace

std::vector<double> smoothed_fold(const TrainPhotons& photons, std::size_t bins, double rate) {
  std::vector<double> counts(bins);
  for (std::size_t i = 0; i < photons.size(); ++i) {
    const double turns = (photons.phase_ns[i] - rate * photons.time_ns[i]) / photons.period_ns;
    const double place = (turns - std::floor(turns)) * static_cast<double>(bins);
    const auto bin = std::min(static_cast<std::size_t>(place), bins - 1);
    const double rest = place - static_cast<double>(bin);
    counts[bin] += 1 - rest;
    counts[bin + 1 < bins ? bin + 1 : 0] += rest;
  }
  std::vector<double> smooth(bins);
  for (std::size_t k = 0; k < bins; ++k) {
    smooth[k] = counts[k > 0 ? k - 1 : bins - 1] + 2 * counts[k] + counts[k + 1 < bins ? k + 1 : 0];
  }
  return smooth;
}

Cluster find_largest_cluster(const std::vector<double>& points_ns,
                             const std::vector<double>& weights, double period_ns,
                             double width_ns) {
  const std::size_t count = points_ns.size();
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return points_ns[a] < points_ns[b]; });
  // The places go once around the circle, and on to where the last window ends.
  const auto at_ns = [&](std::size_t place) {
    return points_ns[order[place % count]] + (place < count ? 0 : period_ns);
  };
  Cluster best;
  double weight = 0, moment = 0;
  std::size_t end = 0;
  for (std::size_t begin = 0; begin < count; ++begin) {
    while (end < begin + count && at_ns(end) - at_ns(begin) <= width_ns) {
      weight += weights[order[end % count]];
      moment += weights[order[end % count]] * at_ns(end);
      ++end;
    }
    if (weight > best.weight) best = {at_ns(begin), weight, fold_on(moment / weight, period_ns)};
    weight -= weights[order[begin]];
    moment -= weights[order[begin]] * at_ns(begin);
  }
  return best;
}

void keep_largest_cluster(TrainPhotons& photons, double width_ns) {
  if (width_ns >= photons.period_ns) return;
  const std::vector<double> alike(photons.size(), 1.0);
  const Cluster cluster =
      find_largest_cluster(photons.phase_ns, alike, photons.period_ns, width_ns);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < photons.size(); ++i) {
    if (fold_on(photons.phase_ns[i] - cluster.begin_ns, photons.period_ns) > width_ns) continue;
    photons.phase_ns[kept] = photons.phase_ns[i];
    photons.time_ns[kept] = photons.time_ns[i];
    ++kept;
  }
  photons.phase_ns.resize(kept);
  photons.time_ns.resize(kept);
}

double fourier_velocity_mps(const TrainPhotons& photons, double width_ns, double max_speed_mps) {
  if (photons.size() < 2 || !(max_speed_mps > 0)) return 0;
  const auto [first, last] = std::minmax_element(photons.time_ns.begin(), photons.time_ns.end());
  const double span_ns = *last - *first;
  const double max_beta = max_speed_mps / speed_of_light_mps;
  const double max_rate = 2 * max_beta / (1 - max_beta);
  const double bin_ns = std::max(width_ns, photons.period_ns / most_fold_bins);
  if (!(span_ns > 0) || bin_ns >= photons.period_ns / 4) return 0;

  const auto bins = static_cast<std::size_t>(std::ceil(photons.period_ns / bin_ns));
  const auto power = [&](double rate) {
    const std::vector<double> fold = smoothed_fold(photons, bins, rate);
    return std::inner_product(fold.begin(), fold.end(), fold.begin(), 0.0);
  };
  const double step = bin_ns / span_ns;
  const auto steps = static_cast<int>(std::ceil(max_rate / step));
  double best = 0, largest = 0;
  for (int n = -steps; n <= steps; ++n) {
    const double here = power(n * step);
    if (here > largest) largest = here, best = n * step;
  }
  // The top of the parabola through the best rate and its neighbours.
  const double before = power(best - step), after = power(best + step);
  const double fall = 2 * largest - before - after;
  const double rate = best + (fall > 0 ? step / 2 * (after - before) / fall : 0);
  // This is c (f - f') / (f + f') with f' = (1 - g) f. Computed with f' itself it would lose the
  // digits of g.
  const double velocity_mps = speed_of_light_mps * rate / (2 - rate);
  return std::clamp(velocity_mps, -max_speed_mps, max_speed_mps);
}

std::optional<FoldedPeak> find_folded_peak(const TrainPhotons& photons, double velocity_mps,
                                           const PulseShape& shape) {
  const double period_ns = photons.period_ns;
  const double bin_ns = std::max(shape.width_ns(), period_ns / most_fold_bins);
  const double half_ns = 4 * bin_ns;  // of the window, which holds 99.99 % of a gaussian pulse
  if (photons.size() == 0 || period_ns <= 4 * half_ns) return std::nullopt;
  const double rate = walk_ns_at(velocity_mps, 1);
  std::vector<double> phases_ns(photons.size());
  for (std::size_t i = 0; i < photons.size(); ++i) {
    phases_ns[i] = fold_on(photons.phase_ns[i] - rate * photons.time_ns[i], period_ns);
  }

  // Background pulls the mean towards the window's middle, so the window is laid about the mean
  // again and again, until it settles on the peak.
  const auto fold =
      smoothed_fold(photons, static_cast<std::size_t>(std::ceil(period_ns / bin_ns)), rate);
  const auto highest = std::max_element(fold.begin(), fold.end()) - fold.begin();
  double centre_ns = period_ns * static_cast<double>(highest) / static_cast<double>(fold.size());
  double inside = 0;
  for (int round = 0; round < 5; ++round) {
    double offsets_ns = 0;
    inside = 0;
    for (const double phase_ns : phases_ns) {
      double off_ns = phase_ns - centre_ns;
      if (std::abs(off_ns) > period_ns / 2) off_ns -= std::copysign(period_ns, off_ns);
      if (std::abs(off_ns) > half_ns) continue;
      inside += 1;
      offsets_ns += off_ns;
    }
    if (inside > 0) centre_ns += offsets_ns / inside;
  }
  const double window_ns = 2 * half_ns / period_ns * photons.seen_ns;
  FoldedPeak peak;
  peak.delay_ns = fold_on(centre_ns - shape.peak_offset_ns(), period_ns);
  peak.background_per_ns =
      std::max(0.0, (photons.counted - inside) / (photons.seen_ns - window_ns));
  peak.signal_per_pulse =
      std::max(0.0, (inside - peak.background_per_ns * window_ns) / photons.amplitude);
  return peak;
}

}  // namespace splid::paper
