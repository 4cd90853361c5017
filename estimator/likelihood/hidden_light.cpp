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
    targets_.push_back({NearSet(max_photons, entries),
                        NearSet(most_other_begins, most_other_entries), nullptr, 0});
  }
  for (auto* values : {&offset_, &h_, &d1_, &d2_, &integral_}) values->reserve(entries);
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
    target.photons = &photons;
    target.last.collect(dead.ends, near.windows(), train_, about,
                        near.gathers() ? near.width_ns() : 0);
    target.other_begins.collect(dead.begins, near.windows(), train_, about);
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
  const OfTarget& own = targets_[target];
  const DelayTrack& track = at.targets[target].track;
  Amplitude sum;
  sum.value = own.covered;
  add(own.last, 1, track, dilation, at.log_width, sum);
  add(*own.photons, -1, track, dilation, at.log_width, sum);
  add(own.other_begins, -1, track, dilation, at.log_width, sum);
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
void HiddenLight::add(const NearSet& near, double sign, const DelayTrack& track, double dilation,
                      double log_width, Amplitude& sum) {
  const double narrow = std::exp(-log_width);
  const std::size_t entries = near.entries();
  for (auto* values : {&offset_, &h_, &d1_, &d2_, &integral_}) values->resize(entries);
  const DelayTrack moved = track - near.track;
  for (std::size_t j = 0; j < entries; ++j) {
    offset_[j] = (near.residual_ns[j] - moved.at(near.position[j])) * dilation * narrow;
  }
  shape_.evaluate(offset_, {h_, d1_, d2_});
  shape_.integrate(offset_, integral_);
  double value = 0, by_width = 0, by_width_twice = 0;
  Eigen::Vector3d slope = Eigen::Vector3d::Zero(), mixed = slope;
  Eigen::Matrix3d curve = Eigen::Matrix3d::Zero();
  for (std::size_t n = 0; n < near.photons(); ++n) {
    for (std::size_t j = near.first[n]; j < near.first[n + 1]; ++j) {
      const double a = sign * near.weight[n] * near.amplitude[j];
      const double y = offset_[j], s = near.position[j];
      const double h = a * h_[j], d = a * d1_[j], w = h + y * d;
      const Eigen::Vector3d terms(1, s, DelayTrack::quadratic_at(s));
      value += a * integral_[j];
      slope += h * terms;
      curve += d * terms * terms.transpose();
      mixed += w * terms;
      by_width += y * h;
      by_width_twice += y * w;
    }
  }
  const double by_offset = -dilation * narrow;
  sum.value += value;
  sum.gradient.head<3>() += by_offset * slope;
  sum.gradient[3] -= by_width;
  sum.hessian.topLeftCorner<3, 3>() += by_offset * by_offset * curve;
  sum.hessian.topRightCorner<3, 1>() -= by_offset * mixed;
  sum.hessian(3, 3) += by_width_twice;
}

}  // namespace splid::likelihood
