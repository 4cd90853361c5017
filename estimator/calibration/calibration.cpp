#include "estimator/calibration/calibration.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/calibration/fold_fit.hpp"
#include "estimator/calibration/pulse_finder.hpp"
#include "estimator/calibration/shape_stack.hpp"
#include "estimator/sync/in_quadrature.hpp"

namespace splid::calibration {
namespace {

constexpr int most_rounds = 16;
// After so many rounds the ends of the table are kept: they are settled to within noise, which
// would go on moving them to and fro.
constexpr int stacking_rounds = 4;
// A time is settled when it moves by less than a tenth of the best time's deviation, or, where
// photons are many, by so little that it does not matter.
constexpr double settled_deviations = 0.1;
constexpr double settled_widths = 1e-3;

// Moves the shape so that its pulse_point_ps() is at 0, and the times the other way.
void centre(FoldModel& model) {
  const double point_ps = pulse_point_ps(model);
  TabulatedPulse table = model.table();
  table.first_ps -= point_ps;
  for (double& time_ps : model.times_ps) time_ps += point_ps;
  model.set_table(table);
}

double settled_ps(const FoldModel& model) {
  const double most = *std::max_element(model.counts.begin(), model.counts.end());
  return model.width_ps() * std::max(settled_widths, settled_deviations / std::sqrt(most));
}

bool settle(FoldModel& model) {
  fit_fold(model);
  for (int round = 0; round < most_rounds; ++round) {
    const std::vector<double> before_ps = model.times_ps;
    if (round < stacking_rounds) {
      stack_shape(model);
    } else {
      improve_shape(model);
    }
    fit_fold(model);
    centre(model);
    double moved_ps = 0;
    for (std::size_t p = 0; p < model.pulses(); ++p) {
      moved_ps = std::max(moved_ps, std::abs(model.times_ps[p] - before_ps[p]));
    }
    if (moved_ps < settled_ps(model)) return true;
  }
  return false;
}

// The variance of the amplitude of pulse p, which is its counts over the mean counts.
double amplitude_variance(const FoldModel& model, const Eigen::MatrixXd& covariance,
                          std::size_t p) {
  const auto pulses = static_cast<Eigen::Index>(model.pulses());
  const double total = model.total_counts();
  Eigen::VectorXd slope = Eigen::VectorXd::Constant(pulses, -model.counts[p] / total);
  slope(static_cast<Eigen::Index>(p)) += 1;
  slope *= static_cast<double>(pulses) / total;
  return slope.dot(covariance.topLeftCorner(pulses, pulses) * slope);
}

// Design note: the fit takes the shape as given, although the shape came from the same photons, so
// that it does not see an error that all times have in common. The variance of that common error,
// 1 / sum of the times' information, is therefore replaced by the variance of the shape's point.
// The time of a single pulse is known to no better than that.
double time_variance_ps2(FoldModel& model, const Eigen::MatrixXd& covariance, std::size_t p,
                         double common_ps2) {
  const auto pulses = static_cast<Eigen::Index>(model.pulses());
  double information = 0;
  for (Eigen::Index q = 0; q < pulses; ++q) {
    information += 1 / covariance(pulses + q, pulses + q);
  }
  const Eigen::Index at = pulses + static_cast<Eigen::Index>(p);
  return std::max(covariance(at, at) - 1 / information, 0.0) + common_ps2;
}

}  // namespace

std::optional<Calibration> calibrate(const PhaseHistogram& fold, double width_ps) {
  const std::vector<FoundPulse> found = find_pulses(fold, width_ps);
  if (found.empty()) return std::nullopt;
  FoldModel model(fold, found, width_ps);
  Calibration result;
  result.settled = settle(model);
  const Eigen::MatrixXd covariance = fold_covariance(model);
  const double common_ps = in_quadrature(std_pulse_point_ps(model), fold.std_phase_ps());
  const double mean_counts = model.total_counts() / static_cast<double>(model.pulses());
  for (std::size_t p = 0; p < model.pulses(); ++p) {
    const double turns = model.times_ps[p] / model.period_ps();
    result.pulses.push_back(
        {model.times_ps[p] - model.period_ps() * std::floor(turns),
         std::sqrt(time_variance_ps2(model, covariance, p, common_ps * common_ps)),
         model.counts[p] / mean_counts, std::sqrt(amplitude_variance(model, covariance, p))});
  }
  std::sort(
      result.pulses.begin(), result.pulses.end(),
      [](const CalibratedPulse& a, const CalibratedPulse& b) { return a.time_ps < b.time_ps; });
  result.period_ps = model.period_ps();
  result.std_period_ps = fold.period().std_period_ps;
  result.shape = model.table();
  result.std_density = std_density(model);
  result.width_ps = model.width_ps();
  result.photons = fold.photons();
  result.signal_photons = model.total_counts();
  result.background_per_ps = model.background_per_ps;
  result.seconds = fold.seconds();
  return result;
}

FoldModel model_of(const PhaseHistogram& fold, const Calibration& calibration) {
  const double mean_counts =
      calibration.signal_photons / static_cast<double>(calibration.pulses.size());
  std::vector<FoundPulse> pulses;
  for (const CalibratedPulse& pulse : calibration.pulses) {
    pulses.push_back({pulse.time_ps, pulse.amplitude * mean_counts});
  }
  FoldModel model(fold, pulses, calibration.width_ps);
  model.set_table(calibration.shape);
  model.background_per_ps = calibration.background_per_ps;
  return model;
}

double photons_wanted(const Calibration& calibration, const Goal& goal) {
  double factor = 0;
  for (const CalibratedPulse& pulse : calibration.pulses) {
    const double of_time = pulse.std_time_ps / goal.std_time_ps;
    const double of_amplitude = pulse.std_amplitude / goal.std_amplitude;
    factor = std::max({factor, of_time * of_time, of_amplitude * of_amplitude});
  }
  return factor;
}

}  // namespace splid::calibration
