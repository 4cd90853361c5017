#include "estimator/calibration/calibration.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/calibration/pulse_finder.hpp"
#include "estimator/calibration/shape_stack.hpp"
#include "estimator/model/chance.hpp"

namespace splid::calibration {
namespace {

constexpr int most_rounds = 16;
// After so many rounds the ends of the table are kept: they are settled to within noise, which
// would go on moving them to and fro.
constexpr int stacking_rounds = 4;
// A time that moves by less of a width is settled.
constexpr double settled_widths = 1e-3;

// Moves the shape so that its pulse_point_ps() is at 0, and the times the other way.
void centre(FoldModel& model) {
  const double point_ps = pulse_point_ps(model);
  TabulatedPulse table = model.table();
  table.first_ps -= point_ps;
  for (double& time_ps : model.times_ps) time_ps += point_ps;
  model.set_table(table);
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
    if (moved_ps < settled_widths * model.width_ps()) return true;
  }
  return false;
}

// The variances of the pulses' amplitudes, which are their counts over the mean counts.
Eigen::VectorXd amplitude_variances(const FoldModel& model, const Eigen::MatrixXd& covariance) {
  const auto pulses = static_cast<Eigen::Index>(model.pulses());
  const double total = model.total_counts();
  const Eigen::ArrayXd share =
      Eigen::Map<const Eigen::ArrayXd>(model.counts.data(), pulses) / total;
  const auto own = covariance.topLeftCorner(pulses, pulses);
  const Eigen::ArrayXd with_all = own.rowwise().sum();
  const double scale = static_cast<double>(pulses) / total;
  return scale * scale *
         (own.diagonal().array() - 2 * share * with_all + share * share * with_all.sum());
}

// Design note: the fit takes the shape as given, although the shape came from the same photons, so
// that it does not see an error that all times have in common. The variance of that common error,
// 1 / sum of the times' information, is therefore replaced by the variance of the shape's point.
// The time of a single pulse is known to no better than that.
Eigen::VectorXd time_variances_ps2(const Eigen::MatrixXd& covariance, double common_ps2) {
  const Eigen::ArrayXd own =
      covariance.diagonal().segment(covariance.rows() / 2, covariance.rows() / 2);
  return (own - 1 / own.inverse().sum()).max(0) + common_ps2;
}

// The shift if pulse `lag` of the second input is pulse 0 of the first.
InputShift shift_at(const Calibration& first, const Calibration& second, std::size_t lag) {
  const std::size_t pulses = first.pulses.size();
  const auto count = static_cast<double>(pulses);
  const double about_ps =
      std::remainder(second.pulses[lag].time_ps - first.pulses[0].time_ps, first.period_ps);
  double sum_ps = 0, squares = 0, variance = 0;  // relative to about_ps
  for (std::size_t p = 0; p < pulses; ++p) {
    const CalibratedPulse& a = first.pulses[p];
    const CalibratedPulse& b = second.pulses[(p + lag) % pulses];
    const double off_ps = std::remainder(b.time_ps - a.time_ps - about_ps, first.period_ps);
    sum_ps += off_ps;
    squares += off_ps * off_ps;
    variance += a.std_time_ps * a.std_time_ps + b.std_time_ps * b.std_time_ps;
  }
  const double mean_ps = sum_ps / count;
  return {std::remainder(about_ps + mean_ps, first.period_ps), std::sqrt(variance) / count,
          std::sqrt(std::max(0.0, squares / count - mean_ps * mean_ps))};
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
  const Eigen::VectorXd of_amplitudes = amplitude_variances(model, covariance);
  const Eigen::VectorXd of_times = time_variances_ps2(covariance, common_ps * common_ps);
  const double mean_counts = model.total_counts() / static_cast<double>(model.pulses());
  for (std::size_t p = 0; p < model.pulses(); ++p) {
    const auto at = static_cast<Eigen::Index>(p);
    const double turns = model.times_ps[p] / model.period_ps();
    result.pulses.push_back({model.times_ps[p] - model.period_ps() * std::floor(turns),
                             std::sqrt(of_times(at)), model.counts[p] / mean_counts,
                             std::sqrt(of_amplitudes(at))});
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

std::optional<InputShift> shift_between(const Calibration& first, const Calibration& second) {
  const std::size_t pulses = first.pulses.size();
  if (pulses == 0 || second.pulses.size() != pulses) return std::nullopt;
  std::optional<InputShift> best;
  for (std::size_t lag = 0; lag < pulses; ++lag) {
    const InputShift shift = shift_at(first, second, lag);
    // The deviation of this pulse in both inputs together.
    const double noise_ps = shift.std_ps * std::sqrt(static_cast<double>(pulses));
    const bool as_good = best && std::abs(shift.rms_ps - best->rms_ps) < noise_ps;
    if (!best || (as_good ? std::abs(shift.shift_ps) < std::abs(best->shift_ps)
                          : shift.rms_ps < best->rms_ps)) {
      best = shift;
    }
  }
  const double noise_ps = best->std_ps * std::sqrt(static_cast<double>(pulses));
  if (best->rms_ps > std::max(first.width_ps, sure_deviations * noise_ps)) return std::nullopt;
  return best;
}

}  // namespace splid::calibration
