#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "estimator/fold/dead_intervals.hpp"
#include "estimator/fold/near_set.hpp"
#include "estimator/likelihood/model.hpp"
#include "estimator/likelihood/near_photons.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid::likelihood {

// The light of one target that came while the detector was dead, linear in the targets: the
// amplitude of the pulses' parts that the dead intervals [u, w) cover,
//   B = sum over intervals of sum_p a_p (H(w - x_p) - H(u - x_p)),
// with H the integral of the pulse's shape and x_p the arrival of pulse p. Pulses whose windows
// hold neither end are counted once for each collect(), by how much light the comb has sent up to
// each end; only ends near a pulse are integrated over, for each model anew.
class HiddenLight {
 public:
  HiddenLight(const PulseShape& shape, const PulseTrain& train, std::size_t max_photons,
              std::size_t targets, const NearPhotons& near);

  // frame: with its dead time. near: collected from it just now.
  void collect(const FoldedFrame& frame, const NearPhotons& near, std::size_t targets);

  // B and its derivatives by the track's terms and by the logarithm of the width, in the order
  // (delay, walk, quadratic, width).
  struct Amplitude {
    double value = 0;
    Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
    Eigen::Matrix4d hessian = Eigen::Matrix4d::Zero();
  };
  // dilation: of an offset over a residual; see LogLikelihood.
  Amplitude of(std::size_t target, const Model& at, double dilation);

 private:
  struct OfTarget {  // ends of dead intervals near its pulses
    NearSet last, other_begins;
    const NearSet* photons = nullptr;
    double covered = 0;  // by pulses that are covered as a whole
  };
  // sign: of the light up to each of these ends, in B.
  void add(const NearSet& near, double sign, const DelayTrack& track, double dilation,
           double log_width, Amplitude& sum);

  const PulseShape& shape_;
  const PulseTrain& train_;
  std::vector<OfTarget> targets_;
  double share_ = 1;
  std::vector<double> offset_, h_, d1_, d2_, integral_;  // scratch: one value for each entry
};

}  // namespace splid::likelihood
