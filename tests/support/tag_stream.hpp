#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "protocol/tag.hpp"

namespace splid::test {

// Makes a sorted stream of photons (input 1), syncs, encoder markers and photons of another input
// (7), one second is 1e12 ps.
struct TagStream {
  double period_ps = 100'000'000;  // of the syncs
  double jitter_ps = 10;
  double photons_per_ms = 100;
  double others_per_ms = 0;
  double markers_per_ms = 1;
  bool syncs = true;
  double sync_missing = 0;
  std::int64_t begin_ps = 0;
  double length_ms = 100;
  std::uint64_t seed = 1;

  [[nodiscard]] std::vector<Tag> make() const {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> jitter(0, jitter_ps);
    std::uniform_real_distribution<double> chance(0, 1);
    const double length_ps = length_ms * 1e9;
    std::vector<Tag> tags;
    const auto at = [&](double x_ps) { return begin_ps + std::llround(x_ps); };
    const auto scatter = [&](double per_ms, Tag tag) {
      for (double n = per_ms * length_ms; n >= 1; --n) {
        tag.time_ps = at(chance(random) * length_ps);
        tags.push_back(tag);
      }
    };
    scatter(photons_per_ms, photon_tag(0, 1));
    scatter(others_per_ms, photon_tag(0, 7));
    scatter(markers_per_ms, marker_tag(0, 1));
    for (double x_ps = 0; syncs && x_ps < length_ps; x_ps += period_ps) {
      if (chance(random) < sync_missing) continue;
      tags.push_back(sync_tag(at(std::max(0.0, x_ps + jitter(random)))));
    }
    std::stable_sort(tags.begin(), tags.end(),
                     [](const Tag& a, const Tag& b) { return a.time_ps < b.time_ps; });
    return tags;
  }
};

}  // namespace splid::test
