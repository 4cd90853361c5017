#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>

#include "estimator/model/estimate.hpp"
#include "estimator/model/pulse_shape.hpp"

namespace splid {

// What the photons of a frame say against the path that its target was fitted with: a straight one,
// or, where its bend was fitted too, a parabola.
struct PathVerdict {
  bool is_bent = false;  // the path is a parabola

  // a t_a^2 / c of the path, as one step of Newton's method from the straight line has it. A path
  // that bends by more than two pulse widths bends by more than this says.
  double bend_ns = 0;
  double deviations = 0;  // of that bend from none
  // j t_a^3 / (3 c) of a path whose acceleration changes by j, by such a step with delay, travel
  // and bend free; in deviations from none; and by how much it puts the travel at mid-frame off.
  double turn_ns = 0, turn_deviations = 0, turn_travel_ns = 0;
  // How much the light swings about the path beyond a bend and a turn, in deviations of the sum
  // over 32 parts of the frame of what each is late by.
  double swing_deviations = 0;
  double photons = 0;    // of signal, that were looked at
  bool is_even = false;  // the signal is spread over the frame as evenly as chance has it
  // The share of the frame in which the signal is surely missing, in eighths.
  double signal_gap = 0;
  // What the fitted path leaves uncertain of the delay at mid-frame and of the travel.
  double off_delay_ns = 0, off_travel_ns = 0;
  // The spread of the light is larger at the frame's ends, by so many deviations, as that of two
  // targets whose travels are off by -+parting_ns. Travels that differ much are off by more.
  double parting_ns = 0, parting_deviations = 0;
  // What one straight path and one pulse leave over of the light's mean and spread over the frame,
  // in squared deviations: chi squared with 7 degrees of freedom where there is nothing else.
  double left = 0;
  // Light beside the pulse, 5 to 8 widths from its peak, beyond the fit's, in deviations.
  double beside_deviations = 0;

  // The path surely bends; chance says so in one frame of a million.
  [[nodiscard]] bool bends() const;
  // The acceleration surely changes over the frame, with the same chance of an error.
  [[nodiscard]] bool turns() const;
  // The light surely parts over the frame, and is not that of a path that bends.
  [[nodiscard]] bool parts() const;
  // There surely is other light than the configured pulse's, and it may meet the target's in a part
  // of the frame. Not where the path bends, or the light parts or has a gap, which say more.
  // has_pulse_misfit: see PulseVerdict.
  [[nodiscard]] bool is_met(bool has_pulse_misfit) const;
  // Nothing speaks for a bend, and no part of the frame is without its signal, as it would be where
  // the line touches a path that bends away from it.
  [[nodiscard]] bool is_straight() const;
  // Says in an estimate what speaks against its path, and puts into the deviations what it leaves
  // uncertain. Nothing where the path neither bends nor has a gap, and the light neither parts nor
  // meets other light. scale: the estimate's clock over the pattern's. length_ns: of the
  // frame, pattern's clock.
  void widen(Estimate& estimate, double scale, double length_ns, bool has_pulse_misfit) const;
  // Says by how much the path appears to be another one, where it was taken as straight and no
  // acceleration is looked for: the root mean square of bend, turn and swing.
  void say_excess(Estimate& estimate) const;
  // Where targets may accelerate, the same as widen() for an acceleration that changes, and for
  // what is likely and not sure. Says by how much the path appears to be another one, to be
  // averaged over frames. To be called after widen().
  //
  // Design note: elsewhere no frame says a jerk. Bright frames of sources at rest show one where
  // the pattern's clock wanders within the frame, which is no motion.
  void widen_if_accelerating(Estimate& estimate, double scale, double length_ns,
                             bool has_pulse_misfit) const;

 private:
  void widen_velocity(Estimate& estimate, double length_ns, double off_ns) const;
};

// Checks whether the photons of a found target are late and early over the frame as on a path that
// bends, by the score of the bend: the slope of the likelihood by it, with delay and travel free,
// over that slope's own deviation. Where the light is even, the three do not correlate.
//
// The score of the next power of the time, with the bend free too, says whether the acceleration
// changes over the frame. It is noticed later than it does harm: a change of so many of its
// deviations puts the velocity off by 2.3 times as many of the velocity's, since the velocity
// correlates with it.
//
// Where a path bends by many pulse widths, the best straight line touches it in a part of the
// frame, and the rest of the frame is without signal. A target that comes and goes looks the same.
//
// Two targets at the same distance that move otherwise look like one between them, whose velocity
// is neither's. Their light is spread by more at the frame's ends than in its middle (see
// CrossingCheck).
//
// Light of another target that meets the path near an end of the frame pulls the line there, and
// the deviations know nothing of it. Such light is seen beside the pulse, and leaves over what is
// no straight path and no single pulse: the mean of the offsets of the light, and their spread,
// have slopes over the frame. Delay and velocity may be off by as much.
//
// Design note: each photon's part of the slope is looked up in 64 steps of its time about the
// pulse, which loses 2 % of the bend's information. With all sums it costs 20 ns a photon.
//
// Threads: one thread for each object. Errors: none. No allocation.
class PathCheck {
 public:
  // closest_ns: smallest distance between two pulses, of which eight widths are asked for. shape:
  // outlives this.
  PathCheck(const PulseShape& shape, double closest_ns);

  // Forgets the photons. signal_per_pulse: of a pulse of the mean amplitude. sends_evenly: pulses
  // come alike, and were seen, all over the frame; only then are gaps looked for.
  void begin(double signal_per_pulse, double background_per_ns, bool sends_evenly);

  // A photon at a time about its pulse, and at a share of the frame from -1/2 to 1/2.
  void add(double residual_ns, double share) {
    const double at = (residual_ns - first_ns_) * steps_per_ns_;
    if (!(at >= 0 && at < static_cast<double>(steps))) {
      const double off_ns = std::abs(residual_ns - shape_.peak_offset_ns());
      beside_ += off_ns >= beside_first_ns_ && off_ns < beside_last_ns_ ? 1 : 0;
      return;
    }
    const auto step = static_cast<std::size_t>(at);
    const double slope = slope_[step];
    const Eigen::Vector3d by(1, share, share * share - 1.0 / 12);
    score_ += slope * by;
    information_ += slope * slope * by * by.transpose();
    const auto part = static_cast<std::size_t>((share + 0.5) * parts);
    Part& sums = parts_[part < parts ? part : parts - 1];
    sums.signal += chance_[step];
    spread_ += chance_[step] * chance_[step];
    moments_ += chance_[step] * Eigen::Vector2d(share, share * share);
    const double curve = curve_[step];
    spread_score_ += curve * by;
    spread_moments_ += by * by.transpose();
    curves_ += curve * curve;
    sums.slope += slope, sums.slopes += slope * slope;
    sums.curve += curve, sums.curves += curve * curve, sums.products += slope * curve;
  }

  // What the photons added since begin() say. pulses: whose photons were added, all over the frame.
  // is_bent: the path's bend was fitted, and the times are those about the bent path. Nothing where
  // pulses are so close that each photon is near several.
  [[nodiscard]] PathVerdict judge(double pulses, bool is_bent = false) const;

 private:
  static constexpr std::size_t steps = 64;
  static constexpr std::size_t parts = 32;
  // What the photons of a part of the frame add up to.
  struct Part {
    double signal = 0;             // photons of it
    double slope = 0, slopes = 0;  // of slope_, and its squares
    double curve = 0, curves = 0;  // of curve_
    double products = 0;           // of both
  };
  void judge_light(double dark, PathVerdict& verdict) const;
  void step_to_bend(PathVerdict& verdict) const;
  void step_to_turn(PathVerdict& verdict) const;
  void bend_away(double dark, PathVerdict& verdict) const;
  void part(PathVerdict& verdict) const;
  [[nodiscard]] double left_over(double dark, double photons) const;
  [[nodiscard]] double deviations_beside(double pulses) const;

  const PulseShape& shape_;
  double first_ns_ = 0, steps_per_ns_ = 0;
  // Where light is looked for beside the pulse, from its peak, on either side; 0: nowhere.
  double beside_first_ns_ = 0, beside_last_ns_ = 0;
  double background_per_ns_ = 0, light_beside_ = 0;  // of the fit; that of a pulse
  bool sends_evenly_ = false;
  std::array<double, steps> slope_{};   // of log lambda by the delay, at a time about the pulse
  std::array<double, steps> chance_{};  // that a photon there is signal
  std::array<double, steps> curve_{};   // the slope of log lambda by the pulse's variance
  std::array<Part, parts> parts_{};
  double beside_ = 0;  // photons
  double spread_ = 0;  // the variance of the signal of all parts_ together
  Eigen::Vector2d moments_ = Eigen::Vector2d::Zero();  // of the signal over the frame
  Eigen::Vector3d score_ = Eigen::Vector3d::Zero();    // by delay, travel and bend
  Eigen::Matrix3d information_ = Eigen::Matrix3d::Zero();
  // Of the spread by its mean, slope and curvature over the frame.
  Eigen::Vector3d spread_score_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d spread_moments_ = Eigen::Matrix3d::Zero();
  double curves_ = 0;  // squares of the photons' parts
};

}  // namespace splid
