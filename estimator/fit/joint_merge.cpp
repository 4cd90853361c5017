#include <algorithm>
#include <bit>
#include <limits>

#include "estimator/fit/joint_likelihood.hpp"

// How JointLikelihood sorts the photons that are near its targets.

namespace splid {
namespace {

// How many targets the bits of a number stand for. Without a processor's own instruction,
// std::popcount is a call into the library for each photon.
constexpr auto targets_of = [] {
  std::array<std::uint8_t, 1U << most_targets> counts{};
  for (unsigned bits = 0; bits < counts.size(); ++bits) {
    counts.at(bits) = static_cast<std::uint8_t>(std::popcount(bits));
  }
  return counts;
}();

}  // namespace

// Photons near one target stand first, target by target, then those near two of them, pair by pair,
// and those near several of them last.
//
// Design note: in the order in which they came, no processor foresees which targets a photon is
// near, and the sums over them take three times as long.
void JointLikelihood::merge(std::size_t targets) {
  index_.clear();
  first_.clear();
  loaded_.count = 0;
  who_.assign(photons_, 0);
  std::size_t entries = 0;
  for (std::size_t k = 0; k < targets; ++k) {
    const auto one = static_cast<std::uint8_t>(1U << k);
    for (const std::uint32_t photon : near_[k].index) who_[photon] |= one;
    entries += near_[k].entries();
  }
  for (auto* values : {&residual_, &position_, &amplitude_}) values->resize(entries);
  target_.resize(entries);
  entries_ = 0;
  alone_end_ = {};
  for (std::size_t k = 0; k < targets; ++k) {
    const std::vector<std::uint32_t>& index = near_[k].index;
    for (std::size_t n = 0; n < index.size(); ++n) {
      if (who_[index[n]] != 1U << k) continue;
      take_photon(index[n]);
      take_entries(k, n);
    }
    alone_end_.at(k) = index_.size();
  }
  pairs_ = 0;
  for (std::size_t k = 0; k < targets; ++k) {
    for (std::size_t m = k + 1; m < targets; ++m) merge_two(k, m);
  }
  merge_more(targets);
  first_.push_back(static_cast<std::uint32_t>(entries_));
}

// The photons that these two targets alone are near.
void JointLikelihood::merge_two(std::size_t one, std::size_t other) {
  const std::size_t before = index_.size();
  const std::vector<std::uint32_t>& index = near_[one].index;
  const std::uint32_t* found = near_[other].index.data();
  for (std::size_t n = 0; n < index.size(); ++n) {
    if (who_[index[n]] != (1U << one | 1U << other)) continue;
    while (*found < index[n]) ++found;
    take_photon(index[n]);
    take_entries(one, n);
    take_entries(other, static_cast<std::size_t>(found - near_[other].index.data()));
  }
  if (index_.size() > before) shared_.at(pairs_++) = {before, index_.size(), {one, other}};
}

// The photons that more than two targets are near. Each target's photons ascend, so that merging
// their rows gives each photon once.
void JointLikelihood::merge_more(std::size_t targets) {
  if (targets < 3) return;
  std::array<std::size_t, most_targets> next{};
  constexpr auto none = std::numeric_limits<std::uint32_t>::max();
  while (true) {
    std::uint32_t photon = none;
    for (std::size_t k = 0; k < targets; ++k) {
      const std::vector<std::uint32_t>& index = near_[k].index;
      std::size_t& n = next.at(k);
      while (n < index.size() && targets_of[who_[index[n]]] < 3) ++n;
      if (n < index.size()) photon = std::min(photon, index[n]);
    }
    if (photon == none) return;
    take_photon(photon);
    for (std::size_t k = 0; k < targets; ++k) {
      std::size_t& n = next.at(k);
      if (n < near_[k].index.size() && near_[k].index[n] == photon) take_entries(k, n++);
    }
  }
}

void JointLikelihood::take_photon(std::uint32_t photon) {
  first_.push_back(static_cast<std::uint32_t>(entries_));
  index_.push_back(photon);
}

void JointLikelihood::take_entries(std::size_t target, std::size_t photon) {
  const NearSet& near = near_[target];
  for (std::size_t j = near.first[photon]; j < near.first[photon + 1]; ++j) {
    target_[entries_] = static_cast<std::uint8_t>(target);
    residual_[entries_] = near.residual_ns[j];
    position_[entries_] = near.position[j];
    amplitude_[entries_++] = near.amplitude[j];
  }
}

}  // namespace splid
