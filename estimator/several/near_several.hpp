#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/fold/near_set.hpp"
#include "estimator/model/options.hpp"

namespace splid {

// The photons that are near any of several targets, sorted by which targets these are, so that
// sums over them are loops without a choice.
//
// Design note: in the order in which they came, no processor foresees which targets a photon is
// near, and the sums over them take three times as long.
//
// Threads: one thread for each object. Errors: none. No allocation after construction for frames of
// up to max_photons.
class NearSeveral {
 public:
  // Photons that are near the same targets, and near one pulse of each. Each target has an entry
  // for each photon: the entries of the first target stand one after the other, then those of the
  // next.
  struct Group {
    std::array<std::uint8_t, most_targets> targets{};  // ascending
    std::size_t target_count = 0;
    std::size_t first = 0, last = 0;  // photons, up to before `last`
    std::size_t entries = 0;          // where the entries begin

    [[nodiscard]] std::size_t photons() const { return last - first; }
    // Where the entries of one of its targets begin.
    [[nodiscard]] std::size_t entries_of(std::size_t t) const { return entries + t * photons(); }
  };

  NearSeveral(std::size_t max_photons, std::size_t max_entries);

  // near: of each target, with the photons' numbers noted. photons: of the frame.
  void sort(std::span<const NearSet* const> near, std::size_t photons);

  [[nodiscard]] std::span<const Group> groups() const { return groups_; }
  // Which photons of the frame these are: those of the groups first, and then the crowded ones,
  // which are near several pulses of one target.
  [[nodiscard]] std::span<const std::uint32_t> index() const { return index_; }
  // The first of the crowded photons, and the entries of one of them.
  [[nodiscard]] std::size_t first_crowded() const { return index_.size() - crowded_.size() + 1; }
  struct Entries {
    std::size_t begin, end;
  };
  [[nodiscard]] Entries crowded(std::size_t photon) const {
    const std::size_t n = photon - first_crowded();
    return {crowded_[n], crowded_[n + 1]};
  }

  // The entries, each of a photon and a target's pulse, as in NearSet.
  std::vector<double> residual_ns, position, amplitude;
  std::vector<std::uint8_t> target;  // that an entry of a crowded photon is for

 private:
  void note_who(std::span<const NearSet* const> near, std::size_t photons);
  void lay_out_groups(unsigned all);
  void fill_groups(std::span<const NearSet* const> near);
  void take_crowded(std::span<const NearSet* const> near, unsigned targets);

  // A number's lowest bits are the targets that a photon is near, and the next one says that it is
  // near several pulses of one of them.
  static constexpr unsigned is_crowded = 1U << most_targets;
  std::vector<std::uint8_t> who_;                                   // of each photon of the frame
  std::array<std::size_t, std::size_t{2} * is_crowded> photons_{};  // of each such number
  // Of each target, where a photon that is near it has its place in the target's set.
  std::array<std::vector<std::uint32_t>, most_targets> place_;
  std::array<std::size_t, is_crowded> next_{};  // of each group: where its next photon goes
  std::vector<Group> groups_;
  std::vector<std::uint32_t> index_, crowded_;
  std::size_t entries_ = 0;  // that have been taken
};

}  // namespace splid
