#include "estimator/several/near_several.hpp"

#include <bit>

namespace splid {

NearSeveral::NearSeveral(std::size_t max_photons, std::size_t max_entries) {
  for (auto* values : {&residual_ns, &position, &amplitude}) values->reserve(max_entries);
  target.reserve(max_entries);
  who_.reserve(max_photons);
  for (auto& places : place_) places.reserve(max_photons);
  index_.reserve(max_photons + 1);
  crowded_.reserve(max_photons + 1);
  groups_.reserve(is_crowded);
}

void NearSeveral::sort(std::span<const NearSet* const> near, std::size_t photons) {
  note_who(near, photons);
  crowded_.clear();
  std::size_t entries = 0;
  for (const NearSet* of_one : near) entries += of_one->entries();
  for (auto* values : {&residual_ns, &position, &amplitude}) values->resize(entries);
  target.resize(entries);
  const unsigned all = 1U << near.size();
  lay_out_groups(all);
  fill_groups(near);
  for (unsigned targets = 1; targets < all; ++targets) {
    if (photons_[targets | is_crowded] > 0) take_crowded(near, targets);
  }
  crowded_.push_back(static_cast<std::uint32_t>(entries_));
}

void NearSeveral::note_who(std::span<const NearSet* const> near, std::size_t photons) {
  who_.assign(photons, 0);
  for (std::size_t k = 0; k < near.size(); ++k) {
    if (place_[k].size() < photons) place_[k].resize(photons);
    const std::vector<std::uint32_t>& index = near[k]->index;
    for (std::size_t n = 0; n < index.size(); ++n) {
      const bool is_one = near[k]->first[n + 1] == near[k]->first[n] + 1;
      who_[index[n]] |= static_cast<std::uint8_t>(1U << k | (is_one ? 0 : is_crowded));
      place_[k][index[n]] = static_cast<std::uint32_t>(n);
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

void NearSeveral::lay_out_groups(unsigned all) {
  groups_.clear();
  entries_ = 0;
  std::size_t photons = 0;
  for (unsigned targets = 1; targets < all; ++targets) {
    if (photons_[targets] == 0) continue;
    Group group;
    for (unsigned left = targets; left != 0; left &= left - 1) {
      group.targets.at(group.target_count++) = static_cast<std::uint8_t>(std::countr_zero(left));
    }
    next_[targets] = group.first = photons;
    group.last = photons += photons_[targets];
    group.entries = entries_;
    entries_ += group.photons() * group.target_count;
    groups_.push_back(group);
  }
  index_.resize(photons);
}

// Design note: which group a photon belongs to is not foreseen by any processor, and a choice that
// is foreseen wrongly costs more than a copy. So those that are taken with another target, or are
// crowded, are written too, behind all others.
void NearSeveral::fill_groups(std::span<const NearSet* const> near) {
  const std::size_t photons = index_.size();
  index_.resize(photons + 1);
  next_[0] = photons;
  for (std::size_t k = 0; k < near.size(); ++k) {
    const unsigned before = is_crowded | ((1U << k) - 1);
    for (const std::uint32_t photon : near[k]->index) {
      const unsigned who = who_[photon];
      const unsigned group = (who & before) == 0 ? who : 0;
      index_[next_[group]] = photon;
      next_[group] += group == 0 ? 0 : 1;
    }
  }
  index_.resize(photons);
  for (const Group& group : groups_) {
    for (std::size_t t = 0; t < group.target_count; ++t) {
      const NearSet& of_one = *near[group.targets[t]];
      const std::vector<std::uint32_t>& place = place_[group.targets[t]];
      for (std::size_t i = 0; i < group.photons(); ++i) {
        const std::size_t entry = group.entries_of(t) + i;
        const std::size_t j = of_one.first[place[index_[group.first + i]]];
        residual_ns[entry] = of_one.residual_ns[j];
        position[entry] = of_one.position[j];
        amplitude[entry] = of_one.amplitude[j];
      }
    }
  }
}

void NearSeveral::take_crowded(std::span<const NearSet* const> near, unsigned targets) {
  for (const std::uint32_t photon :
       near[static_cast<std::size_t>(std::countr_zero(targets))]->index) {
    if (who_[photon] != (targets | is_crowded)) continue;
    crowded_.push_back(static_cast<std::uint32_t>(entries_));
    index_.push_back(photon);
    for (std::size_t k = 0; k < near.size(); ++k) {
      if ((targets >> k & 1U) == 0) continue;
      const std::size_t place = place_[k][photon];
      for (std::size_t j = near[k]->first[place]; j < near[k]->first[place + 1]; ++j, ++entries_) {
        residual_ns[entries_] = near[k]->residual_ns[j];
        position[entries_] = near[k]->position[j];
        amplitude[entries_] = near[k]->amplitude[j];
        target[entries_] = static_cast<std::uint8_t>(k);
      }
    }
  }
}

}  // namespace splid
