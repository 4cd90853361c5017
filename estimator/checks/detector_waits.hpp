#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/model/finding.hpp"
#include "protocol/options.hpp"

namespace splid::checks {

// What the waits between the detections of one detector show of it, over a second or a recording.
// The control beside them, the waits from the same instants a whole number of pattern periods
// later, has as much of light that repeats with the pattern or changes slowly.
// - dead_time: the first waits are empty and those of the control are not. Up to some 37 us: then
//   the control, 20 us later, has no wait below 17 us either.
// - afterpulsing: after the dead time the next detection comes sooner than in the control, at first
//   more so than later; both are hazards, over the instants after which none came yet.
// - timing_walk: returns soon after a detection are late against those after more than 2 us.
//
// No allocation in the calls but walk().
class DetectorWaits {
 public:
  // dead_time_ns: as configured; 0: not given.
  explicit DetectorWaits(double dead_time_ns) : dead_time_ns_(dead_time_ns) {}
  void clear() { *this = DetectorWaits(dead_time_ns_); }

  // times_ps: detections of one detector in ascending order, of a time without loss. period_ps: of
  // the pattern, in the same clock.
  void add(std::span<const std::int64_t> times_ps, double period_ps);
  // A detection near a pulse of the fitted target. wait_ps: since the detection before; offset_ns:
  // from the pulse; share: of such detections that are of the target.
  void add_return(std::int64_t wait_ps, double offset_ns, double share);

  [[nodiscard]] double detections() const { return detections_; }
  // What is sure, and moves a frame with so many detections by more than half of a deviation.
  // pulse_ns: width of the detected pulse.
  [[nodiscard]] FoundList found(double detections_a_frame, double pulse_ns) const;
  // Waits in ns and by how much a return after each is late, in ps, for `detector.walk`.
  [[nodiscard]] std::vector<NumberPair> walk(double pulse_ns) const;

 private:
  // Sixteen bins an octave from 1.024 ns to 16.8 us. The first has all shorter waits, the last all
  // longer ones.
  static constexpr int per_octave_bits = 4;
  static constexpr int first_octave = 10, octaves = 14;
  static constexpr std::size_t bins = (std::size_t{octaves} << per_octave_bits) + 2;
  static constexpr std::size_t bins_a_row = 4;  // of the returns
  static constexpr std::size_t most_rows = bins / bins_a_row + 1;

  struct Returns {
    double count = 0, sum = 0, squares = 0;  // of offsets
    double waits_ns = 0;                     // sum
  };
  // Of one row, against the returns after long waits.
  struct Late {
    double wait_ns = 0, count = 0;
    double by_ns = 0, std_ns = 0;
    [[nodiscard]] double sure_ns() const { return std::abs(by_ns) - 3 * std_ns; }
  };
  struct Lateness {
    std::array<Late, most_rows> rows;
    std::size_t count = 0;
    double returns = 0, variance = 0;  // of all
  };
  struct SeenDeadTime {
    std::size_t end = 0;  // bins before this are empty
    double ns = 0, std_ns = 0;
    double gain_nats = 0;
  };

  struct Share {
    double value = 0, variance = 0;
  };

  static std::size_t bin_of(std::int64_t wait_ps);
  static double begin_ns(std::size_t bin);
  [[nodiscard]] SeenDeadTime seen_dead_time() const;
  [[nodiscard]] Share share_by(double live_from_ns, double early_ns) const;
  [[nodiscard]] Lateness lateness(double pulse_ns) const;
  void find_dead_time(FoundList& found, double detections_a_frame) const;
  void find_afterpulses(FoundList& found, double detections_a_frame) const;
  void find_walk(FoundList& found, double detections_a_frame, double pulse_ns) const;

  double dead_time_ns_;
  std::array<double, bins> after_ = {}, control_ = {};
  std::array<double, bins> least_ns_ = {};  // the shortest wait of after_
  std::array<Returns, most_rows> returns_;
  double detections_ = 0, seen_ns_ = 0;
  double share_sum_ = 0, share_count_ = 0;
};

}  // namespace splid::checks
