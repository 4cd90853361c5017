#include "estimator/calibration/fold_model.hpp"

#include <Eigen/Cholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "estimator/model/units.hpp"

namespace splid::calibration {
namespace {

TabulatedPulse gaussian_table(double width_ps) {
  constexpr int steps_per_width = 4;
  constexpr int half = static_cast<int>(pulse_reach_widths) * steps_per_width;
  TabulatedPulse table{-pulse_reach_widths * width_ps, width_ps / steps_per_width, {}};
  for (int j = -half; j <= half; ++j) {
    const double x = static_cast<double>(j) / steps_per_width;
    table.density.push_back(std::exp(-0.5 * x * x));
  }
  return table;
}

// The gradient of the log-likelihood and the expected Fisher information at the model's values.
struct Information {
  Eigen::VectorXd score;
  Eigen::MatrixXd matrix;
};

Information information_of(FoldModel& model) {
  const std::vector<double>& rates = model.rates();
  const auto bins = static_cast<Eigen::Index>(rates.size());
  const auto pulses = static_cast<Eigen::Index>(model.pulses());
  const Eigen::Index b = 2 * pulses;
  const double bin_ps = model.bin_ps();
  Eigen::VectorXd excess(bins), per_photon(bins);  // seen over expected, less 1; 1 / expected
  for (Eigen::Index k = 0; k < bins; ++k) {
    const auto bin = static_cast<std::size_t>(k);
    per_photon(k) = 1 / rates[bin];
    excess(k) = model.fold().counts()[bin] * per_photon(k) - 1;
  }
  // The derivatives of each bin's rate by the counts and times of the pulses that reach it.
  std::vector<Eigen::Triplet<double>> entries;
  model.each_reached([&](std::size_t p, const FoldModel::Window& window, std::size_t i, auto bin) {
    const auto row = static_cast<int>(bin), column = static_cast<int>(p);
    entries.emplace_back(row, column, window.h[i] * bin_ps);
    entries.emplace_back(row, static_cast<int>(pulses) + column,
                         -model.counts[p] * window.slope[i] * bin_ps);
  });
  Eigen::SparseMatrix<double> slopes(bins, b);
  slopes.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SparseMatrix<double> relative = per_photon.asDiagonal() * slopes;
  Information at = {Eigen::VectorXd(b + 1), Eigen::MatrixXd(b + 1, b + 1)};
  at.score << slopes.transpose() * excess, bin_ps * excess.sum();
  at.matrix.topLeftCorner(b, b) = Eigen::MatrixXd(slopes.transpose() * relative);
  at.matrix.col(b) << bin_ps * (slopes.transpose() * per_photon),
      bin_ps * bin_ps * per_photon.sum();
  at.matrix.row(b) = at.matrix.col(b).transpose();
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

FoldModel::FoldModel(const PhaseHistogram& fold, const std::vector<FoundPulse>& pulses,
                     double width_ps)
    : fold_(fold), period_ps_(fold.period().period_ps), bin_ps_(fold.bin_ps()) {
  for (const FoundPulse& pulse : pulses) {
    times_ps.push_back(pulse.time_ps);
    counts.push_back(std::max(pulse.counts, 1.0));
  }
  const double rest = static_cast<double>(fold.photons()) - total_counts();
  background_per_ps = std::max(rest / period_ps_, least_background_per_ps());
  set_table(gaussian_table(width_ps));
}

FoldModel::Window FoldModel::window(std::size_t pulse, double first_ps, double last_ps) const {
  Window window;
  const double time_ps = times_ps[pulse];
  window.first = static_cast<std::ptrdiff_t>(std::floor((time_ps + first_ps) / bin_ps_));
  const auto last = static_cast<std::ptrdiff_t>(std::ceil((time_ps + last_ps) / bin_ps_));
  // However short the period is, no bin is in the window twice.
  const auto end = std::min(last, window.first + static_cast<std::ptrdiff_t>(fold_.bins()));
  for (std::ptrdiff_t k = window.first; k < end; ++k) {
    window.offset_ps.push_back((static_cast<double>(k) + 0.5) * bin_ps_ - time_ps);
  }
  return window;
}

FoldModel::Window FoldModel::window(std::size_t pulse) const {
  Window found = window(pulse, shape_->first_ns() / ns_per_ps, shape_->last_ns() / ns_per_ps);
  std::vector<double> offsets_ns = found.offset_ps;
  for (double& offset : offsets_ns) offset *= ns_per_ps;
  found.h.resize(offsets_ns.size());
  found.slope.resize(offsets_ns.size());
  std::vector<double> curvature(offsets_ns.size());
  shape_->evaluate(offsets_ns, {found.h, found.slope, curvature});
  for (double& h : found.h) h *= ns_per_ps;
  for (double& slope : found.slope) slope *= ns_per_ps * ns_per_ps;
  return found;
}

double FoldModel::total_counts() const {
  return std::accumulate(counts.begin(), counts.end(), 0.0);
}

double FoldModel::width_ps() const { return shape_->width_ns() / ns_per_ps; }

void FoldModel::set_table(const TabulatedPulse& table) {
  table_ = table;
  shape_ = make_tabulated(table_);
}

const std::vector<double>& FoldModel::rates() {
  rates_.assign(fold_.bins(), background_per_ps * bin_ps_);
  each_reached([&](std::size_t p, const Window& window, std::size_t i, std::size_t bin) {
    rates_[bin] += counts[p] * window.h[i] * bin_ps_;
  });
  return rates_;
}

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
