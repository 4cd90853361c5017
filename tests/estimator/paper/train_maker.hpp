#pragma once

#include <cstdint>
#include <random>

#include "estimator/paper/train_photons.hpp"

namespace splid::test {

// Photons of one pulse train off a moving target, with background: folded as the initialisers take
// them.
struct TrainMaker {
  double period_ns = 94.5;
  double length_ns = 5e5;
  double delay_ns = 61.3;  // D at the start
  double velocity_mps = 77;
  double signal = 95;  // photons, mean
  double background_per_ns = 1e-3;
  double sigma_ns = 0.1;

  [[nodiscard]] paper::TrainPhotons make(std::uint64_t seed) const {
    std::mt19937_64 random(seed);
    paper::TrainPhotons photons;
    photons.period_ns = period_ns;
    photons.seen_ns = length_ns;
    photons.amplitude = length_ns / period_ns;
    const double rate = 2 * velocity_mps / (299792458.0 + velocity_mps);
    std::uniform_real_distribution<double> when(0, length_ns);
    std::uniform_real_distribution<double> where(0, period_ns);
    std::normal_distribution<double> jitter(0, sigma_ns);
    const auto add = [&](double time_ns, double phase_ns) {
      photons.time_ns.push_back(time_ns);
      photons.phase_ns.push_back(fold_on(phase_ns, period_ns));
    };
    for (int n = std::poisson_distribution<int>(signal)(random); n > 0; --n) {
      const double time_ns = when(random);
      add(time_ns, delay_ns + rate * time_ns + jitter(random));
    }
    const double background = background_per_ns * length_ns + 1e-300;
    for (int n = std::poisson_distribution<int>(background)(random); n > 0; --n) {
      add(when(random), where(random));
    }
    photons.counted = static_cast<double>(photons.size());
    return photons;
  }
};

}  // namespace splid::test
