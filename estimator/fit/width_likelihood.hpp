#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimator/fit/likelihood.hpp"
#include "estimator/model/pulse_shape.hpp"

namespace splid {

// The width's place in gradients and matrices, after those of ParameterIndex. It is the logarithm
// of the gaussian's standard deviation.
inline constexpr int log_width_index = 4;

// Value, gradient and Hessian of the log-likelihood, by the four parameters of ParameterIndex and
// by the logarithm of the pulse's width.
struct WidthPoint {
  double value = 0;
  Eigen::Vector<double, 5> gradient = Eigen::Vector<double, 5>::Zero();
  Eigen::Matrix<double, 5, 5> hessian = Eigen::Matrix<double, 5, 5>::Zero();
};

// The likelihood of a gaussian pulse whose width is a parameter too. The intensity's integral does
// not depend on the width, so that the photons alone tell it.
//
// Threads: one thread for each object, which holds scratch. Errors: none. No allocation after
// construction for sets of up to max_entries.
class WidthLikelihood {
 public:
  WidthLikelihood(double sigma_ns, std::size_t max_entries);

  void set_sigma_ns(double sigma_ns);
  // See Likelihood, with the width that was set.
  Likelihood::Profile profile(const NearSet& near, const Exposure& exposure, DelayLine line,
                              double about_fraction = -1);
  WidthPoint evaluate(const NearSet& near, const Exposure& exposure, const FrameParameters& at);

 private:
  void add_width(const NearSet& near, const Exposure& exposure, const FrameParameters& at,
                 WidthPoint& point) const;

  GaussianPulse shape_;
  Likelihood likelihood_;
  std::vector<double> offset_, h_, d1_, d2_;  // scratch: one value for each entry
};

}  // namespace splid
