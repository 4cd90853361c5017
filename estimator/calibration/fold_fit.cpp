#include "estimator/calibration/fold_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace splid::calibration {
namespace {

// The gradient of the log-likelihood and the expected Fisher information at the model's values.
struct Information {
  Eigen::VectorXd score;
  Eigen::MatrixXd matrix;
};

// A bin that a pulse reaches: the derivatives of the bin's rate by the pulse's counts and time.
struct Reached {
  Eigen::Index pulse;
  double by_count, by_time;
  std::uint32_t before;  // what another pulse makes of the same bin
};

Information information_of(FoldModel& model) {
  constexpr auto none = std::numeric_limits<std::uint32_t>::max();
  const std::vector<double>& rates = model.rates();
  const std::vector<std::uint32_t>& seen = model.fold().counts();
  const double bin_ps = model.bin_ps();
  const auto pulses = static_cast<Eigen::Index>(model.pulses());
  const Eigen::Index b = 2 * pulses;
  Information at = {Eigen::VectorXd::Zero(b + 1), Eigen::MatrixXd::Zero(b + 1, b + 1)};
  for (std::size_t k = 0; k < rates.size(); ++k) {
    at.score(b) += (seen[k] / rates[k] - 1) * bin_ps;
    at.matrix(b, b) += bin_ps * bin_ps / rates[k];
  }
  std::vector<Reached> all;
  std::vector<std::uint32_t> last(rates.size(), none);  // of each bin
  for (Eigen::Index c = 0; c < pulses; ++c) {
    const Eigen::Index t = pulses + c;
    const auto pulse = static_cast<std::size_t>(c);
    const FoldModel::Window window = model.window(pulse);
    for (std::size_t i = 0; i < window.h.size(); ++i) {
      const std::size_t k = model.fold().wrapped(window.first + static_cast<std::ptrdiff_t>(i));
      const double excess = seen[k] / rates[k] - 1;
      const Reached own = {c, window.h[i] * bin_ps, -model.counts[pulse] * window.slope[i] * bin_ps,
                           last[k]};
      last[k] = static_cast<std::uint32_t>(all.size());
      all.push_back(own);
      at.score(c) += excess * own.by_count;
      at.score(t) += excess * own.by_time;
      at.matrix(b, c) += own.by_count * bin_ps / rates[k];
      at.matrix(b, t) += own.by_time * bin_ps / rates[k];
      for (std::uint32_t n = last[k]; n != none; n = all[n].before) {
        const Reached& other = all[n];
        at.matrix(c, other.pulse) += own.by_count * other.by_count / rates[k];
        at.matrix(t, pulses + other.pulse) += own.by_time * other.by_time / rates[k];
        at.matrix(t, other.pulse) += own.by_time * other.by_count / rates[k];
        if (other.pulse == c) continue;
        at.matrix(pulses + other.pulse, c) += other.by_time * own.by_count / rates[k];
      }
    }
  }
  at.matrix.triangularView<Eigen::StrictlyUpper>() = at.matrix.transpose();
  return at;
}

// One step of Fisher scoring, which goes at most halfway to where counts or background vanish.
// Returns how far the time that moved furthest went, in ps.
double step(FoldModel& model) {
  const Information information = information_of(model);
  const Eigen::VectorXd by = information.matrix.ldlt().solve(information.score);
  const auto pulses = static_cast<Eigen::Index>(model.pulses());
  const double longest_ps = model.width_ps() / 2;
  double furthest_ps = 0;
  for (Eigen::Index p = 0; p < pulses; ++p) {
    const auto at = static_cast<std::size_t>(p);
    model.counts[at] = std::max(model.counts[at] + by(p), model.counts[at] / 2);
    const double move_ps = std::clamp(by(pulses + p), -longest_ps, longest_ps);
    model.times_ps[at] += move_ps;
    furthest_ps = std::max(furthest_ps, std::abs(move_ps));
  }
  model.background_per_ps =
      std::max({model.background_per_ps + by(2 * pulses), model.background_per_ps / 2,
                model.least_background_per_ps()});
  return furthest_ps;
}

}  // namespace

void fit_fold(FoldModel& model) {
  constexpr int most_steps = 8;
  for (int n = 0; n < most_steps; ++n) {
    if (step(model) < 1e-4 * model.width_ps()) return;
  }
}

Eigen::MatrixXd fold_covariance(FoldModel& model) {
  const auto factored = information_of(model).matrix.ldlt();
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(factored.rows(), factored.cols());
  for (auto column : inverse.colwise()) factored.solveInPlace(column);
  return inverse;
}

}  // namespace splid::calibration
