#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "estimator/paper/train_photons.hpp"

namespace splid::paper {

// How much the photons of a train stand out once a motion is taken out of them: the sum of squares
// of the photons, folded on 1 / f' = period / (1 - g) and smoothed by the pulse, which is the power
// of all harmonics (fourier_velocity.hpp). Each photon is shared between the two bins beside it, so
// that the power is continuous in g.
class HarmonicPower {
 public:
  // bins: 4 at least, of about a pulse width.
  HarmonicPower(const TrainPhotons& photons, std::size_t bins);

  // rate: g of the delay, in ns per ns.
  double operator()(double rate);

 private:
  void add_photons(double rate, std::size_t first, std::size_t count);

  const TrainPhotons& photons_;
  std::size_t bins_;
  std::vector<double> counts_;       // bin k at k + 1; around them the bins beyond either end
  std::vector<double> rests_;        // of some photons: their shares of the bin after theirs
  std::vector<std::int32_t> cells_;  // of some photons: their bins
};

}  // namespace splid::paper
