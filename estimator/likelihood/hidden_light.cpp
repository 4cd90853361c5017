#include "estimator/likelihood/hidden_light.hpp"

#include <cmath>

#include "estimator/fold/dead_intervals.hpp"

namespace splid::likelihood {
namespace {

constexpr std::size_t most_other_begins = 1024;
constexpr std::size_t most_other_entries = 65536;

}  // namespace

HiddenLight::HiddenLight(const PulseShape& shape, const PulseTrain& train, std::size_t max_photons,
                         std::size_t targets, const NearPhotons& near)
    : shape_(shape), train_(train) {
  const std::size_t entries = max_photons * widest_overlap(near.windows());
  for (std::size_t k = 0; k < targets; ++k) {
    targets_.push_back(
        {NearSet(max_photons, entries), NearSet(most_other_begins, most_other_entries), {}, 0});
    for (Ends& ends : targets_.back().ends) ends.amplitude.reserve(entries);
  }
  for (auto* values : {&offset_, &h_, &d1_, &d2_, &integral_}) values->reserve(entries);
}

void HiddenLight::take(const NearSet& near, double sign, Ends& ends) {
  ends.near = &near;
  ends.amplitude.resize(near.entries());
  for (std::size_t n = 0; n < near.photons(); ++n) {
    for (std::size_t j = near.first[n]; j < near.first[n + 1]; ++j) {
      ends.amplitude[j] = sign * near.weight[n] * near.amplitude[j];
    }
  }
}

// How much the combs send on average from the begin to the end of each interval: those of a photon
// are taken as long as the dead time, each at the rate of its own comb. What the others and the
// shortened ones differ from that is taken at the mean rate.
//
// Design note: ends are gathered as the photons of a single target are; see NearSet.
void HiddenLight::collect(const FoldedFrame& frame, const NearPhotons& near, std::size_t targets) {
  const DeadIntervals& dead = *frame.dead;
  share_ = dead.share;
  for (std::size_t k = 0; k < targets; ++k) {
    OfTarget& target = targets_[k];
    const NearSet& photons = near.near(k);
    const DelayTrack about = photons.track;
    target.last.collect(dead.ends, near.windows(), train_, about,
                        near.gathers() ? near.width_ns() : 0);
    target.other_begins.collect(dead.begins, near.windows(), train_, about);
    take(target.last, 1, target.ends[0]);
    take(photons, -1, target.ends[1]);
    take(target.other_begins, -1, target.ends[2]);
    const NearSet::Passed at_photons = photons.passed(frame, near.windows(), train_);
    const double passing = 1 - about.walk_ns / frame.length_ns;
    const double dead_ns = dead.dead_time_ns / frame.scale;
    const double other_ns =
        dead.dead_ns / dead.share / frame.scale - dead_ns * static_cast<double>(frame.size());
    target.covered =
        target.last.passed(dead.ends, near.windows(), train_).amplitude - at_photons.amplitude -
        target.other_begins.passed(dead.begins, near.windows(), train_).amplitude +
        passing * (dead_ns * at_photons.amplitude_per_ns + other_ns * train_.amplitude_per_ns);
  }
}

HiddenLight::Amplitude HiddenLight::of(std::size_t target, const Model& at, double dilation) {
  Amplitude sum;
  sum.value = targets_[target].covered;
  for (const Ends& ends : targets_[target].ends) {
    add(ends, at.targets[target].track, dilation, at.log_width, sum);
  }
  sum.value *= share_;
  sum.gradient *= share_;
  sum.hessian *= share_;
  sum.hessian.triangularView<Eigen::StrictlyLower>() = sum.hessian.transpose();
  return sum;
}

// With y the offset in units in which the pulse is the configured one, H(y) has the derivatives
//   dH/do = h / w   d2H/do2 = h' / w^2   dH/dw = -y h   d2H/dw2 = y h + y^2 h'
//   d2H/(do dw) = -(h + y h') / w
// by the offset o and the logarithm of the width w.
void HiddenLight::add(const Ends& ends, const DelayTrack& track, double dilation, double log_width,
                      Amplitude& sum) {
  const NearSet& near = *ends.near;
  const double narrow = std::exp(-log_width);
  const std::size_t entries = near.entries();
  for (auto* values : {&offset_, &h_, &d1_, &d2_, &integral_}) values->resize(entries);
  const DelayTrack moved = track - near.track;
  for (std::size_t j = 0; j < entries; ++j) {
    offset_[j] = (near.residual_ns[j] - moved.at(near.position[j])) * dilation * narrow;
  }
  shape_.evaluate(offset_, {h_, d1_, d2_});
  shape_.integrate(offset_, integral_);
  add(moments_of(ends), -dilation * narrow, sum);
}

// Sums over the ends, of products with powers of the share.
HiddenLight::Moments HiddenLight::moments_of(const Ends& ends) const {
  Moments m;
  double h0 = 0, h1 = 0, h2 = 0, d0 = 0, d1 = 0, d2 = 0, d3 = 0, d4 = 0;
  double w0 = 0, w1 = 0, w2 = 0;
  for (std::size_t j = 0; j < ends.amplitude.size(); ++j) {
    const double a = ends.amplitude[j], y = offset_[j];
    const double s = ends.near->position[j], s2 = s * s;
    const double h = a * h_[j], d = a * d1_[j], w = h + y * d;
    m.integral += a * integral_[j];
    h0 += h, h1 += h * s, h2 += h * s2;
    d0 += d, d1 += d * s, d2 += d * s2, d3 += d * s2 * s, d4 += d * s2 * s2;
    w0 += w, w1 += w * s, w2 += w * s2;
    m.by_width += y * h;
    m.by_width_twice += y * w;
  }
  m.h = {h0, h1, h2};
  m.d1 = {d0, d1, d2, d3, d4};
  m.w = {w0, w1, w2};
  return m;
}

// From powers of the share to the terms of a track: 1, s and 6 s^2 - 1/2.
void HiddenLight::add(const Moments& m, double by_offset, Amplitude& sum) {
  const auto terms = [](double one, double s, double s2) {
    return Eigen::Vector3d(one, s, 6 * s2 - 0.5 * one);
  };
  const auto& [d0, d1, d2, d3, d4] = m.d1;
  Eigen::Matrix3d products;
  products.row(0) = terms(d0, d1, d2);
  products.row(1) = terms(d1, d2, d3);
  products.row(2) = 6 * terms(d2, d3, d4) - 0.5 * terms(d0, d1, d2);
  sum.value += m.integral;
  sum.gradient.head<3>() += by_offset * terms(m.h[0], m.h[1], m.h[2]);
  sum.gradient[3] -= m.by_width;
  sum.hessian.topLeftCorner<3, 3>() += by_offset * by_offset * products;
  sum.hessian.topRightCorner<3, 1>() -= by_offset * terms(m.w[0], m.w[1], m.w[2]);
  sum.hessian(3, 3) += m.by_width_twice;
}

}  // namespace splid::likelihood
