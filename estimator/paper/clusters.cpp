#include "estimator/paper/clusters.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>

namespace splid::paper {

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
  double weight = 0;
  double moment = 0;
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

}  // namespace splid::paper
