#include "estimator/fit/crossing_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "estimator/fit/small_matrix.hpp"

namespace splid {
namespace {

// Chi squared with 7 degrees of freedom exceeds this in one of 1000.
constexpr double most_left = 24.3;

constexpr std::size_t photons_at_once = 64;  // photons
using OfPhotons = std::array<double, photons_at_once>;

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

// The slopes over the frame of what is left of the light's mean and spread, by polynomials of
// Legendre in the time. A fit leaves no mean and no first slope of the mean, and the spread's mean
// is that of the pulse.
class SlopesLeft {
 public:
  void add(double position, double mean, double spread) {
    const double x = 2 * position;
    const double p2 = (3 * x * x - 1) / 2;
    const double p3 = (5 * x * x - 3) * x / 2;
    const double p4 = ((35 * x * x - 30) * x * x + 3) / 8;
    const std::array<double, terms> all = {mean * p2,   mean * p3,   mean * p4,  spread * x,
                                           spread * p2, spread * p3, spread * p4};
    for (std::size_t i = 0; i < terms; ++i) {
      sums_[i] += all[i];
      squares_[i] += all[i] * all[i];
    }
  }
  [[nodiscard]] double squared_deviations() const {
    double all = 0;
    for (std::size_t i = 0; i < terms; ++i) {
      if (squares_[i] > 0) all += sums_[i] * sums_[i] / squares_[i];
    }
    return all;
  }

 private:
  static constexpr std::size_t terms = 7;
  std::array<double, terms> sums_{}, squares_{};
};

// The light of a target at some photons near the pulses of a line, and its derivatives by the
// photons' times.
struct LightAbout {
  OfPhotons h, d1, d2;

  void see(const PulseShape& shape, const NearSet& near, std::size_t first, std::size_t count,
           const TargetParameters& target, double circle_ns) {
    const double delay_ns = std::remainder(target.line.delay_ns - near.line.delay_ns, circle_ns);
    const double travel_ns = target.line.travel_ns - near.line.travel_ns;
    OfPhotons offset_ns;
    for (std::size_t i = 0; i < count; ++i) {
      offset_ns[i] = near.residual_ns[first + i] - delay_ns - travel_ns * near.position[first + i];
    }
    shape.evaluate(std::span(offset_ns).first(count), {h, d1, d2});
    for (std::size_t i = 0; i < count; ++i) {
      const double S = target.signal_per_pulse * near.amplitude[first + i];
      h[i] *= S, d1[i] *= S, d2[i] *= S;
    }
  }
};

}  // namespace

bool CrossingCheck::Verdict::are_two() const { return does_part && left < most_left; }

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
