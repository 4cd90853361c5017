#include "estimator/fit/near_several.hpp"

#include <bit>

namespace splid {

NearSeveral::NearSeveral(std::size_t max_photons, std::size_t max_entries) {
  for (auto* values : {&residual_ns, &position, &amplitude}) values->reserve(max_entries);
  target.reserve(max_entries);
  who_.reserve(max_photons);
  index_.reserve(max_photons);
  crowded_.reserve(max_photons + 1);
  groups_.reserve(is_crowded);
}

void NearSeveral::sort(std::span<const NearSet* const> near, std::size_t photons) {
  note_who(near, photons);
  groups_.clear();
  index_.clear();
  crowded_.clear();
  std::size_t entries = 0;
  for (const NearSet* of_one : near) entries += of_one->entries();
  for (auto* values : {&residual_ns, &position, &amplitude}) values->resize(entries);
  target.resize(entries);
  entries_ = 0;
  const unsigned all = 1U << near.size();
  for (unsigned targets = 1; targets < all; ++targets) {
    if (photons_[targets] > 0) take_group(near, targets, photons_[targets]);
  }
  for (unsigned targets = 1; targets < all; ++targets) {
    if (photons_[targets | is_crowded] > 0) take_crowded(near, targets);
  }
  crowded_.push_back(static_cast<std::uint32_t>(entries_));
}

void NearSeveral::note_who(std::span<const NearSet* const> near, std::size_t photons) {
  who_.assign(photons, 0);
  for (std::size_t k = 0; k < near.size(); ++k) {
    const std::vector<std::uint32_t>& index = near[k]->index;
    for (std::size_t n = 0; n < index.size(); ++n) {
      const bool is_one = near[k]->first[n + 1] == near[k]->first[n] + 1;
      who_[index[n]] |= static_cast<std::uint8_t>(1U << k | (is_one ? 0 : is_crowded));
    }
  }
  photons_ = {};
  for (std::size_t k = 0; k < near.size(); ++k) {
    for (const std::uint32_t photon : near[k]->index) {
      const unsigned who = who_[photon];
      photons_[who] += static_cast<std::size_t>(std::countr_zero(who)) == k ? 1 : 0;
    }
  }
}

// Visits the photons with this number, ascending: take(photon, at), where `at` has the photon's
// place in the set of each of its targets.
template <class Take>
void NearSeveral::visit(std::span<const NearSet* const> near, unsigned who,
                        const Take& take) const {
  const auto one = static_cast<std::size_t>(std::countr_zero(who));
  const std::vector<std::uint32_t>& index = near[one]->index;
  std::array<std::size_t, most_targets> at{};
  for (std::size_t n = 0; n < index.size(); ++n) {
    if (who_[index[n]] != who) continue;
    at[one] = n;
    for (std::size_t k = one + 1; k < near.size(); ++k) {
      if ((who >> k & 1U) == 0) continue;
      while (near[k]->index[at[k]] < index[n]) ++at[k];
    }
    take(index[n], at);
  }
}

void NearSeveral::take_group(std::span<const NearSet* const> near, unsigned targets,
                             std::size_t photons) {
  Group group;
  group.first = index_.size();
  group.last = group.first + photons;
  group.entries = entries_;
  for (std::size_t k = 0; k < near.size(); ++k) {
    if ((targets >> k & 1U) != 0) {
      group.targets.at(group.target_count++) = static_cast<std::uint8_t>(k);
    }
  }
  visit(near, targets, [&](std::uint32_t photon, const auto& at) {
    std::size_t entry = group.entries + index_.size() - group.first;
    index_.push_back(photon);
    for (std::size_t t = 0; t < group.target_count; ++t, entry += photons) {
      const std::size_t k = group.targets[t];
      const std::size_t j = near[k]->first[at[k]];
      residual_ns[entry] = near[k]->residual_ns[j];
      position[entry] = near[k]->position[j];
      amplitude[entry] = near[k]->amplitude[j];
    }
  });
  entries_ += photons * group.target_count;
  groups_.push_back(group);
}

void NearSeveral::take_crowded(std::span<const NearSet* const> near, unsigned targets) {
  visit(near, targets | is_crowded, [&](std::uint32_t photon, const auto& at) {
    crowded_.push_back(static_cast<std::uint32_t>(entries_));
    index_.push_back(photon);
    for (std::size_t k = 0; k < near.size(); ++k) {
      if ((targets >> k & 1U) == 0) continue;
      for (std::size_t j = near[k]->first[at[k]]; j < near[k]->first[at[k] + 1]; ++j, ++entries_) {
        residual_ns[entries_] = near[k]->residual_ns[j];
        position[entries_] = near[k]->position[j];
        amplitude[entries_] = near[k]->amplitude[j];
        target[entries_] = static_cast<std::uint8_t>(k);
      }
    }
  });
}

}  // namespace splid
