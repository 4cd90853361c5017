#include "estimator/fit/width_likelihood.hpp"

#include "estimator/fit/blind_light.hpp"

namespace splid {

WidthLikelihood::WidthLikelihood(double sigma_ns, std::size_t max_entries)
    : shape_(sigma_ns), likelihood_(shape_, max_entries) {
  for (auto* scratch : {&offset_, &h_, &d1_, &d2_}) scratch->reserve(max_entries);
}

void WidthLikelihood::set_sigma_ns(double sigma_ns) { shape_.set_sigma_ns(sigma_ns); }

Likelihood::Profile WidthLikelihood::profile(const NearSet& near, const Exposure& exposure,
                                             DelayLine line, double about_fraction) {
  return likelihood_.profile(near, exposure, line, about_fraction);
}

WidthPoint WidthLikelihood::evaluate(const NearSet& near, const Exposure& exposure,
                                     const FrameParameters& at) {
  const LikelihoodPoint others = likelihood_.evaluate(near, exposure, at);
  WidthPoint point;
  point.value = others.value;
  point.gradient.head<4>() = others.gradient;
  point.hessian.topLeftCorner<4, 4>() = others.hessian;
  for (auto* scratch : {&h_, &d1_, &d2_}) scratch->resize(near.entries());
  offsets_on(near, exposure, at.line, offset_);
  shape_.evaluate({offset_.data(), near.entries()}, {h_, d1_, d2_});
  add_width(near, exposure, at, point);
  return point;
}

// With x = o / sigma and w = log sigma, a gaussian has
//   dh/dw = (x^2 - 1) h,   d2h/dw2 = (x^4 - 4 x^2 + 1) h,   d2h/(dw do) = (3 x - x^3) h / sigma.
// The offset's derivatives are those in Likelihood::evaluate().
void WidthLikelihood::add_width(const NearSet& near, const Exposure& exposure,
                                const FrameParameters& at, WidthPoint& point) const {
  const double t_a = exposure.length_ns;
  const double one_less_g = 1 - at.line.travel_ns / t_a;
  const double dilation = exposure.scale / one_less_g;
  const double turn = 1 / (one_less_g * t_a);
  const double S = at.signal_per_pulse;
  const double inverse_sigma = 1 / shape_.width_ns();
  Eigen::Vector<double, 5> row = Eigen::Vector<double, 5>::Zero();
  for (std::size_t k = 0; k < near.photons(); ++k) {
    double density = 0, g1 = 0, g2 = 0, gw = 0, g1w = 0, g2w = 0, gww = 0;
    for (std::size_t j = near.first[k]; j < near.first[k + 1]; ++j) {
      const double a = near.amplitude[j];
      const double o1 = -dilation;
      const double o2 = -dilation * near.position[j] + offset_[j] * turn;
      const double x = offset_[j] * inverse_sigma;
      const double square = x * x;
      const double by_both = (3 - square) * x * h_[j] * inverse_sigma;
      density += a * h_[j];
      g1 += a * d1_[j] * o1;
      g2 += a * d1_[j] * o2;
      gw += a * (square - 1) * h_[j];
      g1w += a * by_both * o1;
      g2w += a * by_both * o2;
      gww += a * ((square - 4) * square + 1) * h_[j];
    }
    const double inverse = 1 / (at.background_per_ns + S * density);
    const double n = near.weight[k];
    const double lw = S * gw * inverse;
    point.gradient[log_width_index] += n * lw;
    row[delay_index] += n * (S * g1w - lw * S * g1) * inverse;
    row[travel_index] += n * (S * g2w - lw * S * g2) * inverse;
    row[signal_index] += n * (gw - lw * density) * inverse;
    row[background_index] -= n * lw * inverse;
    row[log_width_index] += n * (S * gww * inverse - lw * lw);
  }
  point.hessian.row(log_width_index) = row.transpose();
  point.hessian.col(log_width_index) = row;
}

}  // namespace splid
