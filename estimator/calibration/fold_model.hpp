#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <vector>

#include "estimator/calibration/phase_histogram.hpp"
#include "estimator/calibration/pulse_finder.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "protocol/pattern.hpp"

namespace splid::calibration {

// The photons that each bin of a fold should hold: background, and the photons of every pulse in
// one and the same shape,
//   rate(x) = background + sum_p counts_p h(x - time_p)
// Times are in ps, h is in 1/ps.
class FoldModel {
 public:
  // The pulses start as gaussians of width_ps. pulses: at least one.
  FoldModel(const PhaseHistogram& fold, const std::vector<FoundPulse>& pulses, double width_ps);

  // The part of the fold that a pulse reaches: the bins from `first` on (any whole number, see
  // PhaseHistogram::wrapped), with the offset of each bin's middle from the pulse's time, and h and
  // its slope there.
  struct Window {
    std::ptrdiff_t first = 0;
    std::vector<double> offset_ps;
    std::vector<double> h;      // 1/ps
    std::vector<double> slope;  // 1/ps^2
  };
  [[nodiscard]] Window window(std::size_t pulse) const;
  // The same for a reach of the caller's choice, without h and slope.
  [[nodiscard]] Window window(std::size_t pulse, double first_ps, double last_ps) const;

  // Calls take(p, window, i, bin) for each bin of the fold that each pulse p reaches: element i of
  // the pulse's window.
  template <typename Take>
  void each_reached(const Take& take) const {
    for (std::size_t p = 0; p < pulses(); ++p) {
      const Window reached = window(p);
      for (std::size_t i = 0; i < reached.h.size(); ++i) {
        take(p, reached, i, fold_.wrapped(reached.first + static_cast<std::ptrdiff_t>(i)));
      }
    }
  }

  [[nodiscard]] const PhaseHistogram& fold() const { return fold_; }
  [[nodiscard]] double period_ps() const { return period_ps_; }
  [[nodiscard]] double bin_ps() const { return bin_ps_; }
  [[nodiscard]] std::size_t pulses() const { return times_ps.size(); }
  [[nodiscard]] double total_counts() const;
  [[nodiscard]] const TabulatedPulse& table() const { return table_; }
  // Standard deviation of a gaussian whose peak is as high as the shape's.
  [[nodiscard]] double width_ps() const;

  void set_table(const TabulatedPulse& table);
  // The photons expected in each bin, by the present values. Valid until the next call.
  [[nodiscard]] const std::vector<double>& rates();
  // The least background: half a photon in the fold, so that a stray photon is not impossible.
  [[nodiscard]] double least_background_per_ps() const { return 0.5 / period_ps_; }

  std::vector<double> times_ps;  // not wrapped to the period
  std::vector<double> counts;    // > 0
  double background_per_ps = 0;  // photons of the whole fold in a ps of the period, > 0

 private:
  const PhaseHistogram& fold_;
  double period_ps_;
  double bin_ps_;
  TabulatedPulse table_;
  std::unique_ptr<PulseShape> shape_;
  std::vector<double> rates_;
};

// The fit of a fold by its Poisson likelihood, with the pulses' shape given. Parameters 0 .. P-1
// are the counts of the P pulses, P .. 2P-1 their times (ps), and 2P is the background (1/ps).
//
// Brings the model to the maximum by Fisher scoring; counts and background stay above zero.
// Allocates a matrix of 2P + 1 rows.
void fit_fold(FoldModel& model);
// The covariance of the parameters: the inverse of the expected Fisher information at the model's
// values.
Eigen::MatrixXd fold_covariance(FoldModel& model);

}  // namespace splid::calibration
