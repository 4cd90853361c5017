#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "estimator/model/pulse_shape.hpp"

namespace splid {

// Tells a weak target close to a bright one from a bright pulse that is not quite what the
// configuration says. The photons' offsets from the bright target's pulses are counted in bins, and
// the counts are explained in two ways:
//  - by the configured pulse and a second target's;
//  - by one pulse of another shape, the likeliest of those that are 0.8 to 3 times as wide. Where
//    the weak target is the later one, it may have any mixture of exponential tails of 0.7 to 8
//    widths: light and detectors are late for many reasons, and early for none.
// Both have a background, and the other targets of the frame. All shares are those at which the
// likelihood of the counts is highest.
//
// Design note: the other pulse has one width, which is a mixture of two neighbours of those tried.
// A mixture of all widths, with tails before and behind, imitates a target of a twentieth three
// widths away to within four nats in a quarter of the frames of 1500 photons, and real pulses no
// better.
//
// Threads: one thread for each object. Errors: none. No allocation after construction.
class FlankCheck {
 public:
  // The bins, from the peak of the bright pulse towards the weak target, in pulse widths.
  static constexpr double first_widths = -6;
  static constexpr double bin_widths = 0.25;
  static constexpr std::size_t bins = 68;
  using Bins = std::array<double, bins>;

  explicit FlankCheck(const PulseShape& shape);

  // By how many nats the counts are likelier with a second target than with a pulse of another
  // shape. side: 1 where the weak target is later than the bright one, -1 where it is earlier.
  // target, others: shares of the second target's light, and of the light of targets elsewhere, in
  // the bins, at any scale.
  double nats_for_target(const Bins& counts, double side, const Bins& target,
                         std::span<const Bins> others);

 private:
  struct Shapes {
    std::vector<Bins> pulses;  // of ascending widths
    std::vector<Bins> tails;   // of the configured pulse
  };
  [[nodiscard]] Shapes shapes_of(const PulseShape& shape, double side) const;
  static constexpr std::size_t most_parts = 16;
  using Shares = std::array<double, most_parts>;
  double best_nats(const Bins& counts);
  // The likelihood of the counts at some shares, in nats, and its derivatives.
  struct Slopes {
    double nats = 0;
    Shares gradient{};
    std::array<Shares, most_parts> curvature{};
  };
  // The light in each bin, of which none is dark.
  [[nodiscard]] Bins light_of(const Shares& at) const;
  // The shares after a round of expectation maximisation.
  [[nodiscard]] Shares maximised(const Bins& counts, const Shares& at) const;
  [[nodiscard]] Slopes derive(const Bins& counts, const Shares& at) const;
  [[nodiscard]] Shares top_of(const Slopes& slopes, const Shares& at) const;
  void take(std::span<const Bins> some) { parts_.insert(parts_.end(), some.begin(), some.end()); }

  std::array<Shapes, 2> shapes_;  // of an earlier target, and of a later one
  std::vector<Bins> parts_;       // scratch: what the counts are explained by
};

}  // namespace splid
