#include "estimator/sync/recording_period.hpp"

#include <algorithm>
#include <cmath>

namespace splid {

void RecordingPeriod::add(const SyncFit& fit) {
  constexpr double least_of_period = 1e-15;  // of a deviation, where syncs have no jitter
  if (!fit.locked) return;
  if (fits_ == 0) first_ps_ = fit.period_ps;
  const double std_ps = std::max(fit.std_period_ps, least_of_period * fit.period_ps);
  const double weight = 1 / (std_ps * std_ps), excess_ps = fit.period_ps - first_ps_;
  fits_ += 1;
  weights_ += weight;
  excess_ += weight * excess_ps;
  squares_ += weight * excess_ps * excess_ps;
}

MeasuredPeriod RecordingPeriod::period() const {
  if (fits_ == 0) return {};
  const double mean_ps = excess_ / weights_;
  const double spread = (squares_ - excess_ * mean_ps) / std::max(1.0, fits_ - 1);
  return {first_ps_ + mean_ps, std::sqrt(std::max(1.0, spread) / weights_)};
}

}  // namespace splid
