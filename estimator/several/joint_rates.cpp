#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/likelihood/small_matrix.hpp"
#include "estimator/several/joint_likelihood.hpp"

// The likelihood of several targets whose lines stay, by their signals and the background.

namespace splid {

// The likelihood is concave in the rates, so that Newton's method finds their best. All photons but
// those of the other targets are background at first, which is right where targets are far apart.
double JointLikelihood::best_without(std::size_t target, const Exposure& exposure,
                                     const JointParameters& at, double value_of_all) {
  constexpr int rounds = 30;
  // So near the top a parabola says what is left to gain to within some thousandths of a nat; and
  // where a thousandth of what the target adds is left, to within a ten-thousandth of that.
  constexpr double settled_nats = 0.05;
  constexpr double settled_of_added = 1e-3;
  constexpr double least_rate_kept = 0.1;  // of a rate in one step, so that it stays above 0
  load(exposure, at);
  RateVector scales = RateVector::Zero(), rates = RateVector::Zero();
  for (std::size_t k = 0; k < at.count; ++k) {
    if (k == target) continue;
    const auto d = static_cast<Eigen::Index>(k);
    rates[d] = at.targets.at(k).signal_per_pulse;
    scales[d] = exposure.amplitude;
  }
  const double others = exposure.amplitude * rates.sum();
  rates[background_rate] = std::max(static_cast<double>(photons_) - others, 1.0) / exposure.seen_ns;
  scales[background_rate] = exposure.seen_ns;
  double best = -std::numeric_limits<double>::infinity();
  RateVector from = rates;
  for (int round = 0; round < rounds; ++round) {
    const RateSums sums = sum_by_rates(rates, target);
    const double value = sums.log_sum - scales.dot(rates);
    if (value < best) {
      rates = (rates + from) / 2;
      continue;
    }
    best = value;
    const RateVector slope = sums.gradient - scales;
    const RateVector step = solution_of_semidefinite(sums.information, slope);
    const double to_gain = slope.dot(step) / 2;
    const double settled = std::max(settled_nats, settled_of_added * (value_of_all - best));
    if (!(to_gain > settled)) return best + std::max(to_gain, 0.0);
    from = rates;
    rates = (rates + step).cwiseMax(least_rate_kept * rates);
  }
  return best;
}

// A rate that no photon speaks for stands alone.
JointLikelihood::RateSums JointLikelihood::sum_by_rates(const RateVector& rates,
                                                        std::size_t without) const {
  RateSums sums;
  LogSum logs;
  const double b = rates[background_rate];
  auto dark = static_cast<double>(photons_ - several_.index().size());
  visit_batches([&](const Batch& of) {
    if (of.group.target_count == 1 && of.group.targets[0] == without) {
      dark += static_cast<double>(of.count);
    } else {
      add_batch_rates(of, rates, without, logs, sums);
    }
  });
  for (std::size_t i = several_.first_crowded(); i < several_.index().size(); ++i) {
    add_crowded_rates(i, rates, without, logs, sums);
  }
  sums.gradient[background_rate] += dark / b;
  sums.information(background_rate, background_rate) += dark / (b * b);
  for (Eigen::Index k = 0; k < background_rate; ++k) {
    if (!(sums.information(k, k) > 0)) sums.information(k, k) = 1;
  }
  sums.log_sum = logs.value();
  if (dark > 0) sums.log_sum += dark * std::log(b);
  return sums;
}

void JointLikelihood::add_batch_rates(const Batch& of, const RateVector& rates, std::size_t without,
                                      LogSum& logs, RateSums& sums) const {
  Columns density;
  Column lambda, inverse;
  densities(of, {rates.data(), most_targets}, rates[background_rate], density, lambda);
  if (of.count < batch) inverse.setZero();
  for (std::size_t i = 0; i < of.count; ++i) {
    const auto n = static_cast<Eigen::Index>(i);
    logs.add(lambda.coeff(n));
    inverse.coeffRef(n) = 1 / lambda.coeff(n);
  }
  sums.gradient[background_rate] += inverse.sum();
  sums.information(background_rate, background_rate) += (inverse * inverse).sum();
  for (std::size_t t = 0; t < of.group.target_count; ++t) {
    const Eigen::Index k = of.group.targets[t];
    if (of.group.targets[t] == without) continue;
    Column& share = density[t];
    share *= inverse;
    sums.gradient[k] += share.sum();
    sums.add(k, background_rate, (share * inverse).sum());
    sums.information(k, k) += (share * share).sum();
    for (std::size_t m = 0; m < t; ++m) {
      if (of.group.targets[m] == without) continue;
      sums.add(k, of.group.targets[m], (share * density[m]).sum());
    }
  }
}

void JointLikelihood::add_crowded_rates(std::size_t photon, const RateVector& rates,
                                        std::size_t without, LogSum& logs, RateSums& sums) const {
  RateVector slope = RateVector::Zero();
  slope[background_rate] = 1;
  const auto [begin, end] = several_.crowded(photon);
  for (std::size_t j = begin; j < end; ++j) {
    if (several_.target[j] != without) slope[several_.target[j]] += several_.amplitude[j] * h_[j];
  }
  const double lambda = rates.dot(slope);
  logs.add(lambda);
  slope /= lambda;
  sums.gradient += slope;
  sums.information += slope * slope.transpose();
}

}  // namespace splid
