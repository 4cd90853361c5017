#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "estimator/calibration/phase_histogram.hpp"
#include "estimator/calibration/pulse_finder.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "protocol/pattern.hpp"

namespace splid {

// What a fold should hold, photons a bin: background, and each pulse's photons in the same shape,
//   rate(x) = background + sum_p counts_p h(x - time_p)
// Unit of time: ps; of h: 1/ps.
//
// Threads: one. Errors: none.
class FoldModel {
 public:
  // The pulses start as gaussians of width_ps. fold outlives this; pulses: at least one.
  FoldModel(const PhaseHistogram& fold, const std::vector<FoundPulse>& pulses, double width_ps);

  // A pulse's part of the fold: bins from `first` (any whole number, see PhaseHistogram::wrapped)
  // on, and at the middle of each the offset from its time, h and its slope.
  struct Window {
    std::ptrdiff_t first = 0;
    std::vector<double> offset_ps;
    std::vector<double> h;      // 1/ps
    std::vector<double> slope;  // 1/ps^2
  };
  [[nodiscard]] Window window(std::size_t pulse) const;
  // Of a support of one's own, without h.
  [[nodiscard]] Window window(std::size_t pulse, double first_ps, double last_ps) const;

  [[nodiscard]] const PhaseHistogram& fold() const { return fold_; }
  [[nodiscard]] double period_ps() const { return period_ps_; }
  [[nodiscard]] double bin_ps() const { return bin_ps_; }
  [[nodiscard]] std::size_t pulses() const { return times_ps.size(); }
  [[nodiscard]] double total_counts() const;
  [[nodiscard]] const TabulatedPulse& table() const { return table_; }
  // Standard deviation of a gaussian with the shape's peak.
  [[nodiscard]] double width_ps() const;
  // Median distance from a pulse to the next; the period for one pulse.
  [[nodiscard]] double median_gap_ps() const;

  void set_table(const TabulatedPulse& table);
  // Photons expected in each bin, by the values as they are.
  [[nodiscard]] const std::vector<double>& rates();
  // The least background: half a photon in all, so that a stray one is not impossible.
  [[nodiscard]] double least_background_per_ps() const { return 0.5 / period_ps_; }

  std::vector<double> times_ps;  // not wrapped to the period
  std::vector<double> counts;    // > 0
  double background_per_ps = 0;  // photons of the whole fold, > 0

 private:
  const PhaseHistogram& fold_;
  double period_ps_;
  double bin_ps_;
  TabulatedPulse table_;
  std::unique_ptr<PulseShape> shape_;
  std::vector<double> rates_;
};

}  // namespace splid
