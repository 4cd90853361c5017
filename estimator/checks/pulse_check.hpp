#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>

#include "estimator/model/estimate.hpp"
#include "estimator/model/pulse_shape.hpp"

namespace splid {

// By how much the detected pulse differs from the configured one.
struct PulseMisfit {
  double width_ratio = 1;   // of the detected pulse's width to that of the configured one
  double signal_ratio = 1;  // of the light with that width to the light with the configured one
  double shift_ns = 0;  // of the pulse's place with that width from that with the configured one

  // Says the misfit in an estimate with the configured pulse, and puts what it leaves uncertain
  // into the deviations. width_ns: of the configured pulse, in the estimate's clock.
  // amplitude_per_ns: of the pattern.
  //
  // Design note: a pulse that is wider than the configured one by a convolution of the deviation s
  // has light from surfaces whose delays spread by s, or light that fog has delayed by as much.
  // Which of these delays is the target's, the photons do not say: the brighter of two surfaces is
  // 0.7 s before the mean of both where the other is half as bright, and s where both are alike. So
  // s is part of the delay's deviation. The likelihood takes each photon's time for more exact than
  // it is by the ratio of the widths, and so are delay, velocity and acceleration. The light is
  // shared otherwise between signal and background with the true width, and that difference is part
  // of their deviations. So is the difference of the places: a blind detector, which sees the first
  // photons of a pulse, sees them earlier where the pulse is wider.
  void widen(Estimate& estimate, double width_ns, double amplitude_per_ns) const;
};

// What the photons of a frame say of the width of the detected pulse.
struct PulseVerdict {
  // By how much the detected pulse appears wider than the configured one, relative to it, and one
  // standard deviation of that: one step of Fisher's scoring from the configured width. It holds
  // where it is small, and is meant to be averaged over frames; of one frame it says little. A
  // deviation of 0 is one that the photons do not tell.
  double excess = 0, std_excess = 0;
  // Absent unless these photons alone surely show another pulse.
  std::optional<PulseMisfit> misfit;
};

// The light of pulses whose first photon keeps the detector from seeing the others. There are no
// kinds of pulses where no dead time is modelled.
struct HidingLight {
  // Pulses whose light is much the same.
  struct Kind {
    double photons = 0;       // of a pulse
    double pulses = 0;        // so many, less those that come while the detector is blind
    double wakes_per_ns = 0;  // dead times that end about such a pulse, over `pulses`
  };
  static constexpr std::size_t most_kinds = 8;
  std::array<Kind, most_kinds> kinds{};
  std::size_t count = 0;
  double background_per_ns = 0;  // of which a photon hides what comes later too

  // Photons of all pulses, and how many pulses these are.
  [[nodiscard]] double light() const {
    double sum = 0;
    for (const Kind& kind : std::span(kinds).first(count)) sum += kind.pulses * kind.photons;
    return sum;
  }
  [[nodiscard]] double pulses() const {
    double sum = 0;
    for (const Kind& kind : std::span(kinds).first(count)) sum += kind.pulses;
    return sum;
  }
};

// What the photons of a frame say of the shape of a pulse whose width was fitted.
struct ShapeVerdict {
  // The skewness of the light about its mean, 0 of a gaussian and above 0 with a late tail, and one
  // standard deviation of that: one step of Fisher's scoring from the gaussian. It holds where it
  // is small, and is meant to be averaged over frames. A deviation of 0 is one that the photons do
  // not tell.
  double skew = 0, std_skew = 0;
  // How far the light is from the gaussian, relative root mean square. Absent unless these photons
  // alone surely show that it is none.
  std::optional<double> misfit;
  double signal_ratio = 1;  // of the light about the pulse to that of the gaussian

  // Says all this in an estimate with a fitted width, and puts what a misfit leaves uncertain into
  // the deviations. configured_ns, fitted_ns: the pulse's widths, in the estimate's clock.
  // amplitude_per_ns: of the pattern.
  //
  // Design note: the gaussian's place is the mean of the light, and where in it the target is, the
  // photons do not say. What is wider than the configured pulse has light whose delays spread by
  // the root of the difference of the squares, as PulseMisfit has it. A skewness g alone is that of
  // two surfaces of which the brighter one, twice as bright, is (g / 2)^(1/3) widths before the
  // mean.
  void widen(Estimate& estimate, double configured_ns, double fitted_ns,
             double amplitude_per_ns) const;
};

// Checks whether the photons of a found target lie about their pulses as the configured pulse says.
// They do not where a tilted target, a wide beam or fog widens the pulse, where a second surface is
// some pulse widths behind the target, or where the target's path bends and is taken as straight.
//
// The photons' times about their pulses are counted in bins of half a pulse width. Two models are
// fitted to the counts by maximum likelihood, each with its own light and place, and the background
// of the frame: the configured pulse, and that pulse made wider or narrower by a factor. Twice what
// the second gains over the first is distributed as chi squared with one degree of freedom where
// the configured pulse is right. From 24 on, which chance reaches in one frame of a million, the
// pulse is another. It is said where the width differs by 2 %, or moves the pulse's place by half a
// deviation.
//
// Design note: a score test would need no second fit, but with 100 photons its chance of an alarm
// is 150 times the stated one, since the squares of the times have a long tail. The ratio of the
// likelihoods has the right chance from some ten photons on. A score does decide whether the fits
// are made at all: it is above 2.4 deviations in one good frame of 70.
//
// Where the width is fitted, a gaussian is fitted to the counts in the same way, and tested by the
// deviance of counts in bins of 0.8 fitted widths or more, and of 8 expected photons or more. It is
// distributed as chi squared. The limit is the one that chance reaches in one frame of a million. A
// tail, two surfaces and a flat top are all no gaussian.
//
// Threads: one thread for each object. Errors: none. No allocation.
class PulseCheck {
 public:
  // closest_ns: smallest distance between two pulses. shape: outlives this. is_fitted: the width is
  // fitted, and may be several times the configured one; the times that are looked at are then
  // twice as far from the pulse.
  PulseCheck(const PulseShape& shape, double closest_ns, bool is_fitted = false);

  // False where pulses come so close that each photon is near several.
  [[nodiscard]] bool looks() const { return bins_ > 0; }
  // The times about a pulse that are looked at.
  [[nodiscard]] double first_ns() const { return first_ns_; }
  [[nodiscard]] double last_ns() const { return last_ns_; }
  [[nodiscard]] double bin_ns() const { return bin_ns_; }

  void clear() { counts_.fill(0); }
  // A photon at a time about its pulse, which must be from first_ns() to last_ns().
  void add(double residual_ns) {
    const auto bin = static_cast<std::size_t>((residual_ns - first_ns_) * bins_per_ns_);
    counts_[bin < bins_ ? bin : bins_ - 1] += 1;
  }
  // Photons that are spread evenly from such a time on, over less than bin_ns(). What lies beyond
  // first_ns() and last_ns() is left out.
  void add_spread(double from_ns, double over_ns, double photons) {
    const double from = (from_ns - first_ns_) * bins_per_ns_;
    const double edge = std::floor(from) + 1;
    const double before = std::min(1.0, (edge - from) / (over_ns * bins_per_ns_));
    add_to(edge - 1, before * photons);
    add_to(edge, (1 - before) * photons);
  }

  // What the photons added since clear() say; nothing where they are fewer than some 40.
  //
  // background: photons of background that a bin is expected to have.
  [[nodiscard]] PulseVerdict judge(double background, const HidingLight& hiding) const;
  // The same of a gaussian whose width was fitted, where no dead time is modelled. ratio: of that
  // width to the configured one.
  [[nodiscard]] ShapeVerdict judge_shape(double background, double ratio) const;

 private:
  static constexpr std::size_t most_bins = 64;
  void add_to(double bin, double photons) {
    if (bin >= 0 && bin < static_cast<double>(bins_)) {
      counts_[static_cast<std::size_t>(bin)] += photons;
    }
  }
  struct Known;
  struct Seen;
  struct Model;
  struct Expected;
  [[nodiscard]] Model model_of_counts(double background_in_bin) const;
  void see(const HidingLight& hiding, std::span<const double> integral, Seen& seen) const;
  void expect(const Model& model, const HidingLight& hiding, Expected& expected) const;
  [[nodiscard]] double log_likelihood(const Expected& expected) const;
  double climb(Model& model, const Known& known, int parameters) const;
  // What a width that is wrong moves in a likelihood that takes it for right, for a difference of
  // the logarithm of 1: the light, relative to itself, and the place of the pulse.
  struct Pull {
    double light = 0;
    double shift_ns = 0;
    double std_shift_ns = 0;  // one standard deviation of that place
  };
  [[nodiscard]] Pull pull_of_width(const Model& model, const HidingLight& hiding) const;
  // Of grouped counts from what was expected.
  struct Deviance {
    double value = 0;
    int groups = 0;
  };
  [[nodiscard]] Deviance deviance(const Expected& expected, double ratio) const;
  void step_to_skew(const Expected& expected, const Model& model, const Known& known,
                    ShapeVerdict& verdict) const;
  [[nodiscard]] PulseVerdict step_of_width(const Expected& expected, const Known& known) const;

  const PulseShape& shape_;
  std::size_t bins_ = 0;
  double first_ns_ = 0, last_ns_ = 0, bin_ns_ = 0, bins_per_ns_ = 0;
  std::array<double, most_bins> counts_{};
};

}  // namespace splid
