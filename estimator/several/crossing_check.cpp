#include "estimator/several/crossing_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "estimator/likelihood/small_matrix.hpp"
#include "estimator/several/light_about.hpp"

namespace splid {
namespace {

// Two numbers that each photon has.
struct Correlation {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;

  void add(double of_x, double of_y) {
    n += 1;
    x += of_x, y += of_y;
    xx += of_x * of_x, xy += of_x * of_y, yy += of_y * of_y;
  }
  // In deviations of that of numbers that have nothing to do with each other.
  [[nodiscard]] double deviations() const {
    const double squares = (xx - x * x / n) * (yy - y * y / n);
    return squares > 0 ? (xy - x * y / n) * std::sqrt(n / squares) : 0;
  }
};

}  // namespace

bool CrossingCheck::Verdict::are_two() const {
  return does_part && left < SlopesLeft::most_by_chance;
}

// One step of scoring from no spread, to v = d d + 2 d t s + t t s s. The pulse may be wider than
// the configuration says, so that d d is not taken from the mean.
std::optional<DelayLine> CrossingCheck::parting_about(const NearSet& near,
                                                      const TargetParameters& target,
                                                      double background_per_ns) const {
  LightAbout light;
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  Eigen::Vector3d slopes = Eigen::Vector3d::Zero();
  double squares = 0;
  for (std::size_t first = 0; first < near.entries(); first += photons_at_once) {
    const std::size_t count = std::min(photons_at_once, near.entries() - first);
    light.see(shape_, near, first, count, target, train_.circle_ns);
    for (std::size_t i = 0; i < count; ++i) {
      const double s = near.position[first + i];
      const double lambda = background_per_ns + light.h[i];
      if (!(lambda > 0)) continue;
      const double slope = light.d2[i] / lambda / 2;
      const Eigen::Vector3d by(1, s, s * s);
      slopes += slope * by;
      moments += by * by.transpose();
      squares += slope * slope;
    }
  }
  const auto solved = solution_of_positive(moments, slopes);
  if (!solved || !(squares > 0)) return std::nullopt;
  const Eigen::Vector3d v = *solved * (moments(0, 0) / squares);
  if (!(v[2] > 0)) return std::nullopt;
  const double travel_ns = std::sqrt(v[2]);
  return DelayLine{v[1] / (2 * travel_ns), travel_ns};
}

CrossingCheck::Verdict CrossingCheck::judge(const NearSet& near, const JointParameters& at,
                                            std::size_t one, std::size_t other) const {
  const TargetParameters& a = at.targets.at(one);
  const TargetParameters& b = at.targets.at(other);
  const double S = a.signal_per_pulse + b.signal_per_pulse;
  if (!(S > 0)) return {};
  const double share = b.signal_per_pulse / S;
  const double apart_ns = std::remainder(b.line.delay_ns - a.line.delay_ns, train_.circle_ns);
  const double parting_ns = b.line.travel_ns - a.line.travel_ns;
  const TargetParameters mean = {
      {a.line.delay_ns + share * apart_ns, a.line.travel_ns + share * parting_ns}, S};
  Correlation parting;
  SlopesLeft left;
  std::array<LightAbout, most_targets> lights;
  LightAbout of_one;
  for (std::size_t first = 0; first < near.entries(); first += photons_at_once) {
    const std::size_t count = std::min(photons_at_once, near.entries() - first);
    of_one.see(shape_, near, first, count, mean, train_.circle_ns);
    OfPhotons others;
    others.fill(at.background_per_ns);
    for (std::size_t k = 0; k < at.count; ++k) {
      lights[k].see(shape_, near, first, count, at.targets[k], train_.circle_ns);
      if (k == one || k == other) continue;
      for (std::size_t i = 0; i < count; ++i) others[i] += lights[k].h[i];
    }
    const LightAbout& of_a = lights[one];
    const LightAbout& of_b = lights[other];
    for (std::size_t i = 0; i < count; ++i) {
      const double s = near.position[first + i];
      const double distance_ns = apart_ns + parting_ns * s;
      const double as_one = others[i] + of_one.h[i];
      const double as_two = others[i] + of_a.h[i] + of_b.h[i];
      if (!(as_one > 0 && as_two > 0)) continue;
      parting.add(of_one.d2[i] / as_one, distance_ns * distance_ns);
      left.add(s, (of_a.d1[i] + of_b.d1[i]) / as_two, (of_a.d2[i] + of_b.d2[i]) / as_two);
    }
  }
  Verdict verdict;
  verdict.deviations = parting.deviations();
  verdict.left = left.squared_deviations();
  // The lines part as the light does by chance, too: its spread may have any slope and any
  // curvature over the frame, as two normal numbers, but that it must be larger at the ends.
  const double chance = std::exp(-verdict.deviations * verdict.deviations / 2) / 2;
  verdict.does_part = verdict.deviations > 0 && chance < false_alarm_rate_;
  return verdict;
}

}  // namespace splid
