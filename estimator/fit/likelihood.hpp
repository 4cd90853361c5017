#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimator/fold/near_set.hpp"
#include "estimator/model/pulse_shape.hpp"

namespace splid {

// What the likelihood depends on, in the pattern's clock (see FoldedFrame); rates are in the
// tagger's.
struct FrameParameters {
  DelayLine line;
  double signal_per_pulse = 0;   // S >= 0
  double background_per_ns = 0;  // b >= 0
};

// Order of parameters in gradients and matrices.
enum ParameterIndex { delay_index, travel_index, signal_index, background_index };

// Value, gradient and Hessian of the log-likelihood. Units: nats per ns, ns, count a pulse, count a
// ns, in the order of ParameterIndex.
struct LikelihoodPoint {
  double value = 0;
  Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
  Eigen::Matrix4d hessian = Eigen::Matrix4d::Zero();
};

// How much of the pattern and of the time a frame saw: integral of the intensity
// S * amplitude * (1 - g) + b * seen_ns.
//
// Design note: the pulses in a loss are counted by their mean rate. A loss that starts or ends
// within a period is wrong by a pulse or two at most, of the 529,000 in a frame of 50 ms.
struct Exposure {
  double amplitude = 0;  // sum of a_p over the pulses seen, target at rest
  double seen_ns = 0;
  double length_ns = 0;  // t_a, pattern's clock
  double scale = 1;      // tagger's clock over pattern's clock

  Exposure() = default;
  Exposure(const FoldedFrame& frame, const PulseTrain& train);
};

// l = -integral lambda + sum over photons of log lambda ([P] Eq. 4 and 7, whose print lacks the
// logarithm), with lambda = b + S sum_p a_p h about the line's comb ([P] Eq. 2). Photons without an
// entry in the near set are background: log b each, so b must be above 0 where there are any.
//
// Threads: one an object (scratch). No allocation after construction for sets within max_entries.
class Likelihood {
 public:
  Likelihood(const PulseShape& shape, std::size_t max_entries);

  // At the parameters, with `near` collected about some line not too far (its window must hold all
  // entries that matter). is_loaded: the call before was profile() of the same set at this line.
  LikelihoodPoint evaluate(const NearSet& near, const Exposure& exposure, const FrameParameters& at,
                           bool is_loaded = false);

  // For a line, the best signal fraction f = S A / (S A + b t), in [0, 1], and the value there,
  // with the total count matched (S A + b t = N, which holds at every maximum inside S, b > 0).
  struct Profile {
    FrameParameters parameters;
    double value = 0;      // log-likelihood
    double gain_nats = 0;  // over no target, S = 0 and b = N / t
    double signal_fraction = 0;
  };
  // about_fraction: of a line nearby, from which the best one is found in fewer rounds; negative:
  // not known.
  Profile profile(const NearSet& near, const Exposure& exposure, DelayLine line,
                  double about_fraction = -1);

 private:
  void load(const NearSet& near, const Exposure& exposure, DelayLine line);

  const PulseShape& shape_;
  std::vector<double> offset_, h_, d1_, d2_;  // an entry each
  std::vector<double> density_;               // a photon each: sum_p a_p h
};

}  // namespace splid
