#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "estimator/fold/near_set.hpp"
#include "estimator/likelihood/exposure.hpp"
#include "estimator/likelihood/model.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid::selection {

// How well pulses of other shapes explain the photons about a track: of another width, and with a
// tail, which is a share of the light that is late by an exponential delay. The photons are counted
// by how far from the track's pulses they are.
class PulseTail {
 public:
  // How far from a pulse its light is looked at, in pulse widths.
  static constexpr int reach_widths = 32;

  PulseTail(const PulseShape& shape, const PulseTrain& train, std::size_t max_photons);

  // False where pulses are too close to each other.
  [[nodiscard]] bool looks() const { return cells_ > 0; }
  // Counts the photons about the track of a model's first target.
  void count(const FoldedFrame& frame, const likelihood::Model& about);
  // The log-likelihood of the counts under a model.
  double nats(const likelihood::Model& model);
  // The most of it with another place and width of the first target's pulse, and with a tail too;
  // the signals of the others are refitted. enough_nats: the look ends where it
  // reaches so much, or cannot.
  double other_width_nats(const likelihood::Model& model, double enough_nats);
  double with_tail_nats(double enough_nats);

 private:
  static constexpr int cells_a_width = 2;
  static constexpr std::size_t most_cells = std::size_t{2} * reach_widths * cells_a_width;
  using Cells = std::array<double, most_cells>;
  using Edges = std::array<double, most_cells + 1>;
  // The amounts that the counts are fitted by, in their order: photons of the pulse, of its tail
  // and of the other targets, an offset in ns, and the logarithm of the width.
  enum Amount : std::size_t { body, tail, first_other };
  static constexpr std::size_t most_amounts = first_other + (most_targets - 1) + 2;
  using Amounts = std::array<double, most_amounts>;

  void put(const likelihood::Model& model, std::size_t target, std::size_t column);
  double expect(const Amounts& at, double tail_ns);
  double maximize(Amounts& at, double tail_ns, double enough_nats);
  [[nodiscard]] std::size_t amounts() const { return first_other + others_ + 2; }
  [[nodiscard]] std::size_t offset_at() const { return first_other + others_; }

  const PulseShape& shape_;
  const PulseTrain& train_;
  double cell_ns_, first_ns_;
  std::size_t cells_ = 0;
  std::vector<CombWindow> windows_;
  NearSet near_;
  Cells counts_{}, expected_{};
  DelayTrack about_;
  Exposure exposure_;
  Amounts fitted_{};  // of the other width
  double dark_ = 0;   // photons of the background in each cell
  std::size_t others_ = 0;
  // Derivatives of the expected photons by each amount.
  Eigen::Matrix<double, static_cast<int>(most_cells), static_cast<int>(most_amounts)> by_;
  Eigen::Matrix<double, static_cast<int>(most_cells), static_cast<int>(most_amounts)> over_;
  Edges place_{}, light_{}, h_{}, d1_{}, d2_{};  // scratch
};

}  // namespace splid::selection
