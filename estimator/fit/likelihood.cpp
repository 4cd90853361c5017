#include "estimator/fit/likelihood.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/likelihood/log_sum.hpp"

namespace splid {

Likelihood::Likelihood(const PulseShape& shape, std::size_t max_entries) : shape_(shape) {
  for (auto* scratch : {&offset_, &h_, &d1_, &d2_, &density_}) scratch->reserve(max_entries);
}

// Residuals are times of emission. A photon's offset in its detected pulse is the residual times
// the dilation dt/de = scale / (1 - g), by which a pattern is longer when it comes back.
void Likelihood::load(const NearSet& near, const Exposure& exposure, DelayLine line) {
  const std::size_t count = near.entries();
  for (auto* scratch : {&h_, &d1_, &d2_}) scratch->resize(count);
  offsets_on(near, exposure, line, offset_);
  shape_.evaluate({offset_.data(), count}, {h_, d1_, d2_});
  density_.resize(near.photons());
  for (std::size_t k = 0; k < near.photons(); ++k) {
    double sum = 0;
    for (std::size_t j = near.first[k]; j < near.first[k + 1]; ++j) {
      sum += near.amplitude[j] * h_[j];
    }
    density_[k] = sum;
  }
  if (blind_ != nullptr) missed_ = blind_->at(near, {offset_, h_, d1_}, exposure, line);
}

// The integral over the blind time is part of -integral lambda, and is given back.
void Likelihood::give_back_missed(double S, LikelihoodPoint& point) const {
  point.value += S * missed_.value;
  point.gradient[delay_index] += S * missed_.d1;
  point.gradient[travel_index] += S * missed_.d2;
  point.gradient[signal_index] += missed_.value;
  point.hessian(delay_index, delay_index) += S * missed_.d11;
  point.hessian(delay_index, travel_index) += S * missed_.d12;
  point.hessian(travel_index, travel_index) += S * missed_.d22;
  point.hessian(delay_index, signal_index) += missed_.d1;
  point.hessian(travel_index, signal_index) += missed_.d2;
}

LikelihoodPoint Likelihood::evaluate(const NearSet& near, const Exposure& exposure,
                                     const FrameParameters& at, bool is_loaded) {
  if (!is_loaded) load(near, exposure, at.line);
  const double t_a = exposure.length_ns;
  const double one_less_g = 1 - at.line.travel_ns / t_a;
  const double dilation = exposure.scale / one_less_g;
  const double S = at.signal_per_pulse;
  const double b = at.background_per_ns;
  const auto far = static_cast<double>(near.far_photons);

  LikelihoodPoint point;
  point.value = -S * exposure.amplitude * one_less_g - b * exposure.seen_ns;
  point.gradient[travel_index] = S * exposure.amplitude / t_a;
  point.gradient[signal_index] = -exposure.amplitude * one_less_g;
  point.gradient[background_index] = -exposure.seen_ns;
  point.hessian(travel_index, signal_index) = exposure.amplitude / t_a;
  if (blind_ != nullptr) give_back_missed(S, point);
  if (far > 0) {
    point.value += far * std::log(b);
    point.gradient[background_index] += far / b;
    point.hessian(background_index, background_index) -= far / (b * b);
  }
  add_photons(near, at, {dilation, 1 / (one_less_g * t_a)}, point);
  point.hessian.triangularView<Eigen::StrictlyLower>() = point.hessian.transpose();
  return point;
}

// Adds log lambda of the near photons and its derivatives.
//
// Design note: the sums are kept in local variables, which the compiler holds in registers; in the
// matrices, each sum of each photon would wait for the memory that the photon before it wrote.
void Likelihood::add_photons(const NearSet& near, const FrameParameters& at, const Stretching& by,
                             LikelihoodPoint& point) const {
  const double S = at.signal_per_pulse;
  const double b = at.background_per_ns;
  LogSum logs;
  Eigen::Vector4d& gradient = point.gradient;
  Eigen::Matrix4d& H = point.hessian;
  double d_delay = gradient[0], d_travel = gradient[1], d_S = gradient[2], d_b = gradient[3];
  double h00 = H(0, 0), h01 = H(0, 1), h02 = H(0, 2), h03 = H(0, 3), h11 = H(1, 1);
  double h12 = H(1, 2), h13 = H(1, 3), h22 = H(2, 2), h23 = H(2, 3), h33 = H(3, 3);
  const double o1 = -by.dilation;
  const double o12 = -by.dilation * by.turn;
  const std::size_t photons = near.photons();
  for (std::size_t k = 0; k < photons; ++k) {
    // Sums over the photon's pulses of the derivatives of a_p h by delay (1) and travel (2).
    double g1 = 0, g2 = 0, g11 = 0, g12 = 0, g22 = 0;
    const std::size_t end = near.first[k + 1];
    for (std::size_t j = near.first[k]; j < end; ++j) {
      const double a = near.amplitude[j];
      // The offset is o = residual * dilation(g). By the delay its derivative is -dilation, by the
      // travel it is -dilation s + o / ((1 - g) t_a).
      const double s = near.position[j];
      const double o2 = -by.dilation * s + offset_[j] * by.turn;
      const double o22 = 2 * by.turn * o2;
      g1 += a * d1_[j] * o1;
      g2 += a * d1_[j] * o2;
      g11 += a * d2_[j] * o1 * o1;
      g12 += a * (d2_[j] * o1 * o2 + d1_[j] * o12);
      g22 += a * (d2_[j] * o2 * o2 + d1_[j] * o22);
    }
    const double lambda = b + S * density_[k];
    const double n = near.weight[k];
    const double inverse = 1 / lambda;
    // A first derivative of log lambda is that of lambda, divided by lambda.
    const double weight = n * inverse;
    logs.add_times(n, lambda);
    const double l1 = S * g1 * inverse;
    const double l2 = S * g2 * inverse;
    const double lS = density_[k] * inverse;
    d_delay += n * l1, d_travel += n * l2, d_S += n * lS, d_b += n * inverse;
    h00 += S * g11 * weight - n * l1 * l1;
    h01 += S * g12 * weight - n * l1 * l2;
    h11 += S * g22 * weight - n * l2 * l2;
    h02 += g1 * weight - n * l1 * lS;
    h12 += g2 * weight - n * l2 * lS;
    h22 -= n * lS * lS;
    h03 -= l1 * weight;
    h13 -= l2 * weight;
    h23 -= lS * weight;
    h33 -= inverse * weight;
  }
  point.value += logs.value();
  gradient = {d_delay, d_travel, d_S, d_b};
  H.row(0) << h00, h01, h02, h03;
  H(1, 1) = h11, H(1, 2) = h12, H(1, 3) = h13;
  H(2, 2) = h22, H(2, 3) = h23, H(3, 3) = h33;
}

Likelihood::Profile Likelihood::profile(const NearSet& near, const Exposure& exposure,
                                        DelayLine line, double about_fraction) {
  load(near, exposure, line);
  const auto far = static_cast<double>(near.far_photons);
  const double total = far + near.near_photons;
  Profile result;
  result.parameters.line = line;
  if (total == 0) return result;

  // l(f) = sum log(1 + f (r_k - 1)) + far log(1 - f) + const, where r_k is the signal's density at
  // photon k over that of no target. l is concave in f, so that Newton's method between brackets
  // finds its only maximum.
  double amplitude = exposure.amplitude * (1 - line.travel_ns / exposure.length_ns);
  if (blind_ != nullptr) amplitude = std::max(amplitude - missed_.value, 1e-9 * amplitude);
  const double ratio_scale = exposure.seen_ns / amplitude;
  double lo = 0, hi = 1;
  double f = about_fraction > 0 && about_fraction < 1 ? about_fraction
                                                      : std::clamp(1 - far / total, 1e-6, 1 - 1e-6);
  for (int round = 0; round < 60; ++round) {
    double slope = far > 0 ? -far / (1 - f) : 0;
    double curvature = far > 0 ? -far / ((1 - f) * (1 - f)) : 0;
    for (std::size_t k = 0; k < near.photons(); ++k) {
      const double excess = density_[k] * ratio_scale - 1;
      const double term = excess / (1 + f * excess);
      slope += near.weight[k] * term;
      curvature -= near.weight[k] * term * term;
    }
    (slope > 0 ? lo : hi) = f;
    double next = curvature < 0 ? f - slope / curvature : f;
    if (!(next > lo && next < hi)) {
      // The maximum may lie on a bound: a factor of 1000 is faster there than halving.
      next = next >= hi && hi == 1   ? 1 - (1 - f) * 1e-3
             : next <= lo && lo == 0 ? f * 1e-3
                                     : (lo + hi) / 2;
    }
    const bool settled = std::abs(next - f) <= 1e-14 + 1e-12 * f;
    f = next;
    if (settled || f < 1e-12 || (far == 0 && 1 - f < 1e-14)) break;
  }
  LogSum logs;
  for (std::size_t k = 0; k < near.photons(); ++k) {
    logs.add_times(near.weight[k], 1 + f * (density_[k] * ratio_scale - 1));
  }
  const double gain = logs.value() + (far > 0 ? far * std::log1p(-f) : 0);
  result.parameters.signal_per_pulse = f * total / amplitude;
  result.parameters.background_per_ns = (1 - f) * total / exposure.seen_ns;
  result.gain_nats = gain;
  result.signal_fraction = f;
  result.value = gain + total * std::log(total / exposure.seen_ns) - total;
  return result;
}

}  // namespace splid
