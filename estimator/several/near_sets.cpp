#include "estimator/several/near_sets.hpp"

#include <algorithm>
#include <cmath>

namespace splid {

NearSets::NearSets(std::size_t sets, std::size_t max_photons, std::size_t max_entries) {
  for (std::size_t n = 0; n < sets; ++n) sets_.push_back({{max_photons, max_entries, true}});
}

void NearSets::forget() {
  for (Kept& set : sets_) set.asked = 0;
}

const NearSet& NearSets::about(const FoldedFrame& frame, std::span<const CombWindow> windows,
                               const PulseTrain& train, DelayLine line, double margin_ns) {
  Kept* nearest = nullptr;
  double nearest_ns = margin_ns;
  for (Kept& set : sets_) {
    const double apart_ns = ends_apart_ns(set.near.line, line);
    if (set.asked == 0 || apart_ns > nearest_ns) continue;
    nearest = &set;
    nearest_ns = apart_ns;
  }
  if (nearest == nullptr) {
    nearest = &*std::min_element(sets_.begin(), sets_.end(),
                                 [](const Kept& a, const Kept& b) { return a.asked < b.asked; });
    nearest->near.collect(frame, windows, train, line);
  }
  nearest->asked = ++calls_;
  return nearest->near;
}

double NearSets::ends_apart_ns(DelayLine a, DelayLine b) {
  return std::abs(a.delay_ns - b.delay_ns) + std::abs(a.travel_ns - b.travel_ns) / 2;
}

}  // namespace splid
