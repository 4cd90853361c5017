#pragma once

#include <Eigen/Core>
#include <array>
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
  // Ends of dead intervals near a target's pulses, each with the light that it has.
  struct Ends {
    const NearSet* near = nullptr;
    std::vector<double> amplitude;  // of each entry: that of its pulse, times how many ends it is
  };
  struct OfTarget {
    NearSet last, other_begins;
    std::array<Ends, 3> ends;  // last, the photons, other_begins
    double covered = 0;        // by pulses that are covered as a whole
  };
  static void take(const NearSet& near, double sign, Ends& ends);
  void add(const Ends& ends, const DelayTrack& track, double dilation, double log_width,
           Amplitude& sum);
  // Of H, of h, h' and h + y h' times powers of the share, of y h and of y (h + y h').
  struct Moments {
    double integral = 0, by_width = 0, by_width_twice = 0;
    std::array<double, 3> h{}, w{};
    std::array<double, 5> d1{};
  };
  [[nodiscard]] Moments moments_of(const Ends& ends) const;
  static void add(const Moments& moments, double by_offset, Amplitude& sum);

  const PulseShape& shape_;
  const PulseTrain& train_;
  std::vector<OfTarget> targets_;
  double share_ = 1;
  std::vector<double> offset_, h_, d1_, d2_, integral_;  // scratch: one value for each entry
};

}  // namespace splid::likelihood
