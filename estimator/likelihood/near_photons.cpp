#include "estimator/likelihood/near_photons.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

namespace splid::likelihood {
namespace {

// How far a track may move before its photons are collected anew.
constexpr double margin_widths = 4;

std::size_t rounded_up(std::size_t photons) {
  constexpr std::size_t lanes = NearPhotons::lanes;
  return (photons + lanes - 1) / lanes * lanes;
}

// How far from a pulse's time its light is looked for, where the pulse may become wider.
double reach_ns(double configured_ns, double width_ns, double most_width) {
  if (most_width == 1) return configured_ns;
  const double gaussian_ns = pulse_reach_widths * width_ns * most_width;
  return std::copysign(std::max(std::abs(configured_ns), gaussian_ns), configured_ns);
}

// How far apart two tracks are at most, to within the sum of their parts.
double apart_ns(const DelayTrack& a, const DelayTrack& b) {
  const DelayTrack apart = a - b;
  return std::abs(apart.delay_ns) + std::abs(apart.walk_ns) / 2 + std::abs(apart.quadratic_ns);
}

}  // namespace

NearPhotons::NearPhotons(const PulseTrain& train, const PulseShape& shape, std::size_t max_photons,
                         std::size_t targets, double most_width)
    : train_(train),
      width_ns_(shape.width_ns()),
      peak_ns_(shape.peak_offset_ns()),
      margin_ns_(margin_widths * shape.width_ns()),
      windows_(comb_windows(train, reach_ns(shape.first_ns(), width_ns_, most_width) - margin_ns_,
                            reach_ns(shape.last_ns(), width_ns_, most_width) + margin_ns_)) {
  const std::size_t pulses = widest_overlap(windows_);
  const std::size_t padding = kinds * lanes;
  most_entries_ = targets * pulses * (max_photons + padding);
  near_.reserve(targets);
  for (std::size_t k = 0; k < targets; ++k) {
    near_.emplace_back(max_photons, pulses * max_photons, targets > 1);
    place_[k].reserve(targets > 1 ? max_photons : 0);
  }
  kind_.reserve(max_photons);
  numbers_.reserve(max_photons);
  groups_.reserve(kinds);
  for (auto* values : {&share_, &weight_, &root_}) values->reserve(max_photons + padding);
  for (auto* values : {&residual_, &amplitude_}) values->reserve(most_entries_);
}

bool NearPhotons::serves(const Model& at) const {
  if (collected_ != at.count) return false;
  for (std::size_t k = 0; k < at.count; ++k) {
    if (apart_ns(near_[k].track, at.targets[k].track) > margin_ns_) return false;
  }
  return true;
}

void NearPhotons::collect(const FoldedFrame& frame, const Model& about, std::size_t gather_from) {
  const std::size_t before = collected_;
  collected_ = about.count;
  bool is_new = before != about.count;
  for (std::size_t k = 0; k < about.count; ++k) {
    NearSet& near = near_[k];
    const DelayTrack& track = about.targets[k].track;
    const bool is_held = k < before && apart_ns(near.track, track) <= margin_ns_ &&
                         (about.count == 1) == (before == 1);
    if (is_held && about.count > 1) continue;
    near.collect(frame, windows_, train_, track, about.count == 1 ? width_ns_ : 0, gather_from);
    is_new = true;
  }
  if (is_new) sort(frame.size());
}

double NearPhotons::count_within(std::size_t target, const DelayTrack& track,
                                 double reach_ns) const {
  const NearSet& near = near_[target];
  DelayTrack moved = track - near.track;
  moved.delay_ns += peak_ns_;
  double count = 0;
  for (std::size_t n = 0; n < near.photons(); ++n) {
    for (std::size_t j = near.first[n]; j < near.first[n + 1]; ++j) {
      const bool is_within = std::abs(near.residual_ns[j] - moved.at(near.position[j])) < reach_ns;
      count += is_within ? near.weight[n] : 0;
    }
  }
  return count;
}

void NearPhotons::sort(std::size_t photons) {
  note_kinds(photons);
  lay_out();
  std::array<std::size_t, kinds> next{};
  std::exclusive_scan(count_.begin(), count_.end(), next.begin(), std::size_t{0});
  numbers_.resize(next.back() + count_.back());
  near_count_ = 0;
  for (std::size_t k = 0; k < collected_; ++k) {
    for (std::size_t n = 0; n < near_[k].photons(); ++n) {
      const std::size_t number = number_of(k, n);
      const unsigned kind = kind_[number];
      if (static_cast<std::size_t>(std::countr_zero(kind)) != k) continue;
      numbers_[next[kind]++] = static_cast<std::uint32_t>(number);
      near_count_ += near_[k].weight[n];
    }
  }
  auto group = groups_.begin();
  for (unsigned kind = 1; kind < kinds; ++kind) {
    if (count_[kind] == 0) continue;
    fill(*group++, std::span(numbers_).subspan(next[kind] - count_[kind], count_[kind]));
  }
}

// Notes of each photon which targets it is near, and of each kind how many photons and pulses.
void NearPhotons::note_kinds(std::size_t photons) {
  const std::size_t numbers = collected_ == 1 ? near_.front().photons() : photons;
  kind_.assign(numbers, 0);
  for (std::size_t k = 0; k < collected_; ++k) {
    const NearSet& near = near_[k];
    if (collected_ > 1) place_[k].resize(photons);
    for (std::size_t n = 0; n < near.photons(); ++n) {
      const std::size_t number = number_of(k, n);
      const bool is_one = near.first[n + 1] == near.first[n] + 1;
      kind_[number] |= static_cast<std::uint8_t>(1U << k | (is_one ? 0 : is_crowded));
      if (collected_ > 1) place_[k][number] = static_cast<std::uint32_t>(n);
    }
  }
  count_ = {};
  pulses_ = {};
  for (std::size_t k = 0; k < collected_; ++k) {
    const NearSet& near = near_[k];
    for (std::size_t n = 0; n < near.photons(); ++n) {
      const unsigned kind = kind_[number_of(k, n)];
      count_[kind] += static_cast<std::size_t>(std::countr_zero(kind)) == k ? 1 : 0;
      pulses_[kind] = std::max<std::size_t>(pulses_[kind], near.first[n + 1] - near.first[n]);
    }
  }
}

void NearPhotons::lay_out() {
  groups_.clear();
  std::size_t photons = 0, entries = 0;
  for (unsigned kind = 1; kind < kinds; ++kind) {
    if (count_[kind] == 0) continue;
    Group group;
    for (unsigned left = kind & (is_crowded - 1); left != 0; left &= left - 1) {
      group.targets.at(group.target_count++) = static_cast<std::uint8_t>(std::countr_zero(left));
    }
    group.pulses = pulses_[kind];
    group.photons = rounded_up(count_[kind]);
    group.first = photons;
    group.first_entry = entries;
    photons += group.photons;
    entries += group.target_count * group.pulses * group.photons;
    groups_.push_back(group);
  }
  for (auto* values : {&share_, &weight_, &root_}) values->assign(photons, 0);
  for (auto* values : {&residual_, &amplitude_}) values->assign(entries, 0);
}

void NearPhotons::fill(const Group& group, std::span<const std::uint32_t> numbers) {
  for (std::size_t t = 0; t < group.target_count; ++t) {
    const std::size_t k = group.targets[t];
    const NearSet& near = near_[k];
    const std::size_t entries = group.entries_of(t);
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const std::size_t n = collected_ == 1 ? numbers[i] : place_[k][numbers[i]];
      const std::size_t begin = near.first[n], end = near.first[n + 1];
      share_[group.first + i] = near.position[begin];
      weight_[group.first + i] = near.weight[n];
      for (std::size_t j = begin; j < end; ++j) {
        const std::size_t entry = entries + (j - begin) * group.photons + i;
        residual_[entry] = near.residual_ns[j];
        amplitude_[entry] = near.amplitude[j];
      }
    }
  }
  for (std::size_t i = 0; i < group.photons; ++i) {
    root_[group.first + i] = std::sqrt(weight_[group.first + i]);
  }
}

}  // namespace splid::likelihood
