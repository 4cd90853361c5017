#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/fold/folded_frame.hpp"
#include "estimator/fold/near_set.hpp"
#include "estimator/likelihood/likelihood_kernels.hpp"
#include "estimator/likelihood/model.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid::likelihood {

// A frame's photons near the tracks of a model's targets, sorted by which targets these are, so
// that sums over them are loops over vectors without a choice.
class NearPhotons {
 public:
  // Photons stand in groups whose sizes are multiples of this.
  static constexpr std::size_t lanes = LikelihoodKernels::lanes;

  // Photons near the same targets. For each of these targets a photon has `pulses` entries, one a
  // pulse that it is near; where it is near fewer pulses, the other entries have the amplitude 0.
  // The last photons of a group may be empty, with the weight 0.
  struct Group {
    std::array<std::uint8_t, most_targets> targets{};  // ascending
    std::size_t target_count = 0;
    std::size_t pulses = 1;
    std::size_t first = 0, photons = 0;
    std::size_t first_entry = 0;

    // Where the entries of one of its targets begin: `photons` of them for each pulse.
    [[nodiscard]] std::size_t entries_of(std::size_t t) const {
      return first_entry + t * pulses * photons;
    }
  };

  // train, shape: as for the likelihood. most_width: how many times as wide as configured the pulse
  // may become, 1 or more.
  NearPhotons(const PulseTrain& train, const PulseShape& shape, std::size_t max_photons,
              std::size_t targets, double most_width);

  // Another frame comes next.
  void begin() { collected_ = 0; }
  // Takes the photons near the model's tracks, unless those that were taken last still serve.
  // gather_from: see NearSet; the photons of several targets are not gathered.
  void collect(const FoldedFrame& frame, const Model& about, std::size_t gather_from);
  // Whether no end of a track is farther from where its photons were collected than the margin.
  [[nodiscard]] bool serves(const Model& at) const;

  [[nodiscard]] std::span<const Group> groups() const { return groups_; }
  // Of each photon: its share of the frame, from -1/2 to 1/2, and how many photons it stands for,
  // with the root of that.
  [[nodiscard]] std::span<const double> shares() const { return share_; }
  [[nodiscard]] std::span<const double> weights() const { return weight_; }
  [[nodiscard]] std::span<const double> roots() const { return root_; }
  // Of each entry: when the photon left after its pulse, ns, were the target where its photons were
  // collected; and the pulse's amplitude.
  [[nodiscard]] std::span<const double> residuals_ns() const { return residual_; }
  [[nodiscard]] std::span<const double> amplitudes() const { return amplitude_; }

  // Photons within so many ns of a track's pulses, by whichever pulse.
  [[nodiscard]] double count_within(std::size_t target, const DelayTrack& track,
                                    double reach_ns) const;
  [[nodiscard]] const NearSet& near(std::size_t target) const { return near_[target]; }
  [[nodiscard]] std::span<const CombWindow> windows() const { return windows_; }
  [[nodiscard]] double width_ns() const { return width_ns_; }
  // Photons near any of the tracks.
  [[nodiscard]] double near_count() const { return near_count_; }
  [[nodiscard]] bool gathers() const { return collected_ == 1 && near_.front().gathers; }
  // Photons that seemed to be near a model's only target; see NearSet.
  [[nodiscard]] std::size_t likely_near() const { return near_.front().likely_near; }
  [[nodiscard]] std::size_t most_entries() const { return most_entries_; }

 private:
  // A photon's lowest bits are the targets that it is near; the next one says that it is near
  // several pulses of one of them.
  static constexpr unsigned is_crowded = 1U << most_targets;
  static constexpr unsigned kinds = 2 * is_crowded;

  [[nodiscard]] std::size_t number_of(std::size_t target, std::size_t n) const {
    return collected_ == 1 ? n : near_[target].index[n];
  }
  void sort(std::size_t photons);
  void note_kinds(std::size_t photons);
  void lay_out();
  void fill(const Group& group, std::span<const std::uint32_t> numbers);

  const PulseTrain& train_;
  double width_ns_, peak_ns_, margin_ns_;
  std::vector<CombWindow> windows_;  // one for each segment of the train
  std::size_t most_entries_;         // of all targets
  std::vector<NearSet> near_;        // of each target
  std::size_t collected_ = 0;        // targets whose photons have been collected
  double near_count_ = 0;
  std::vector<std::uint8_t> kind_;                              // of each photon of the frame
  std::array<std::vector<std::uint32_t>, most_targets> place_;  // of a photon in a target's set
  std::array<std::size_t, kinds> count_{}, pulses_{};           // of each kind
  std::vector<std::uint32_t> numbers_;                          // photons sorted by kind
  std::vector<Group> groups_;
  std::vector<double> share_, weight_, root_, residual_, amplitude_;
};

}  // namespace splid::likelihood
