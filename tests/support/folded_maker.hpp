#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include "estimator/fold/folded_frame.hpp"
#include "estimator/likelihood/model.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid::test {

// Folded frames of a target, drawn photon by photon: some 0.3 ms a frame of [P]'s light, so that
// statistics of many thousands of frames take seconds. For trains of a single stretch.
struct FoldedMaker {
  struct Photon {
    double offset_ns;   // from its pulse
    double share;       // of the frame, -1/2 to 1/2
    std::size_t pulse;  // of the train
    bool is_seen = true;
    [[nodiscard]] double u() const { return 2 * share; }
  };

  PulseTrain train;
  double length_ns = 50e6;
  double photons = 713;  // of signal, mean
  double background_per_ns = 1.75e-4;
  double sigma_ns = 0.1;
  DelayTrack track = {1898, 3.3, 0};
  // What the scene does to a photon of the target.
  std::function<void(Photon&, std::mt19937_64&)> scene = {};
  // Adds phases and shares of other photons.
  std::function<void(std::vector<std::pair<double, double>>&, std::mt19937_64&)> foreign = {};
  std::vector<double> amplitudes = {};  // that are played; empty: the train's

  explicit FoldedMaker(const Pattern& pattern) : train(pattern) {}

  [[nodiscard]] double signal_per_pulse() const {
    return photons / (train.amplitude_per_ns * length_ns);
  }
  [[nodiscard]] likelihood::Model truth() const {
    likelihood::Model model;
    model.add({track, signal_per_pulse()});
    model.background_per_ns = background_per_ns;
    return model;
  }

  void make(FoldedFrame& frame, std::uint64_t seed) const {
    std::mt19937_64 random(seed);
    const Comb& comb = train.segments.front().comb;
    std::uniform_real_distribution<double> uniform(0, 1);
    std::normal_distribution<double> normal(0, 1);
    frame.length_ns = frame.seen_ns = length_ns;
    frame.scale = 1;
    frame.dead = nullptr;
    frame.phase_ns.clear(), frame.time_ns.clear(), frame.phase_32.clear();
    const auto add = [&](double phase_ns, double share) {
      const double turns = phase_ns / comb.period_ns;
      const double turned = turns - std::floor(turns);
      frame.phase_ns.push_back(turned * comb.period_ns);
      frame.time_ns.push_back(share * length_ns);
      frame.phase_32.push_back(
          static_cast<std::uint32_t>(static_cast<std::uint64_t>(turned * 0x1p32)));
    };
    const std::vector<double>& played = amplitudes.empty() ? comb.amplitudes : amplitudes;
    std::discrete_distribution<std::size_t> pulse(played.begin(), played.end());
    for (int n = std::poisson_distribution<int>(photons)(random); n > 0; --n) {
      Photon photon = {sigma_ns * normal(random), uniform(random) - 0.5, pulse(random)};
      if (scene) scene(photon, random);
      if (!photon.is_seen) continue;
      add(track.at(photon.share) + comb.times_ns[photon.pulse] + photon.offset_ns, photon.share);
    }
    const double dark = background_per_ns * length_ns;
    for (int n = std::poisson_distribution<int>(dark)(random); n > 0; --n) {
      add(uniform(random) * comb.period_ns, uniform(random) - 0.5);
    }
    if (foreign) {
      std::vector<std::pair<double, double>> others;
      foreign(others, random);
      for (const auto& [phase_ns, share] : others) add(phase_ns, share);
    }
    frame.group_end.assign(1, frame.phase_ns.size());
  }
};

}  // namespace splid::test
