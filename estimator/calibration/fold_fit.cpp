#include "estimator/calibration/fold_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

namespace splid::calibration {
namespace {

using Window = FoldModel::Window;

// The derivatives of a bin's rate by the parameters of one pulse.
struct Slopes {
  double count;  // by its counts
  double time;   // by its time
};

// The gradient of the log-likelihood and the expected Fisher information at the model's values.
class Information {
 public:
  explicit Information(FoldModel& model)
      : model_(model),
        rates_(model.rates()),
        score(Eigen::VectorXd::Zero(size())),
        matrix(Eigen::MatrixXd::Zero(size(), size())) {
    for (std::size_t p = 0; p < model.pulses(); ++p) windows_.push_back(model.window(p));
    add_background();
    for (std::size_t p = 0; p < model.pulses(); ++p) {
      add_pulse(p);
      for (std::size_t q = p + 1; q < model.pulses(); ++q) add_overlap(p, q);
    }
    matrix.triangularView<Eigen::StrictlyUpper>() = matrix.transpose();
  }

 private:
  [[nodiscard]] Eigen::Index size() const {
    return 2 * static_cast<Eigen::Index>(model_.pulses()) + 1;
  }
  [[nodiscard]] Eigen::Index time_of(std::size_t p) const {
    return static_cast<Eigen::Index>(model_.pulses() + p);
  }
  [[nodiscard]] std::size_t bin(const Window& window, std::size_t i) const {
    return model_.fold().wrapped(window.first + static_cast<std::ptrdiff_t>(i));
  }
  [[nodiscard]] Slopes slopes(std::size_t p, std::size_t i) const {
    const double bin_ps = model_.bin_ps();
    return {windows_[p].h[i] * bin_ps, -model_.counts[p] * windows_[p].slope[i] * bin_ps};
  }

  void add_background() {
    const double bin_ps = model_.bin_ps();
    const Eigen::Index b = size() - 1;
    for (std::size_t k = 0; k < rates_.size(); ++k) {
      score(b) += (model_.fold().counts()[k] / rates_[k] - 1) * bin_ps;
      matrix(b, b) += bin_ps * bin_ps / rates_[k];
    }
  }

  void add_pulse(std::size_t p) {
    const auto c = static_cast<Eigen::Index>(p);
    const Eigen::Index t = time_of(p);
    const Eigen::Index b = size() - 1;
    for (std::size_t i = 0; i < windows_[p].h.size(); ++i) {
      const std::size_t k = bin(windows_[p], i);
      const Slopes by = slopes(p, i);
      const double excess = model_.fold().counts()[k] / rates_[k] - 1;
      score(c) += excess * by.count;
      score(t) += excess * by.time;
      matrix(c, c) += by.count * by.count / rates_[k];
      matrix(t, t) += by.time * by.time / rates_[k];
      matrix(t, c) += by.time * by.count / rates_[k];
      matrix(b, c) += by.count * model_.bin_ps() / rates_[k];
      matrix(b, t) += by.time * model_.bin_ps() / rates_[k];
    }
  }

  // Adds the bins that two pulses share. Pulse q comes after p, but across the period's end it may
  // also come before p; its window is then shifted by a turn.
  void add_overlap(std::size_t p, std::size_t q) {
    const auto bins = static_cast<std::ptrdiff_t>(rates_.size());
    for (const std::ptrdiff_t turn : {std::ptrdiff_t{0}, bins}) {
      const std::ptrdiff_t shift = windows_[q].first - windows_[p].first - turn;
      const auto p_bins = static_cast<std::ptrdiff_t>(windows_[p].h.size());
      const auto q_bins = static_cast<std::ptrdiff_t>(windows_[q].h.size());
      for (std::ptrdiff_t i = std::max<std::ptrdiff_t>(0, shift);
           i < std::min(p_bins, q_bins + shift); ++i) {
        add_pair(p, static_cast<std::size_t>(i), q, static_cast<std::size_t>(i - shift));
      }
    }
  }

  void add_pair(std::size_t p, std::size_t i, std::size_t q, std::size_t j) {
    const double rate = rates_[bin(windows_[p], i)];
    const Slopes of_p = slopes(p, i);
    const Slopes of_q = slopes(q, j);
    const auto c_p = static_cast<Eigen::Index>(p);
    const auto c_q = static_cast<Eigen::Index>(q);
    matrix(c_q, c_p) += of_q.count * of_p.count / rate;
    matrix(time_of(q), time_of(p)) += of_q.time * of_p.time / rate;
    matrix(time_of(q), c_p) += of_q.time * of_p.count / rate;
    matrix(time_of(p), c_q) += of_p.time * of_q.count / rate;
  }

  FoldModel& model_;
  const std::vector<double>& rates_;
  std::vector<Window> windows_;

 public:
  Eigen::VectorXd score;
  Eigen::MatrixXd matrix;  // the expected information
};

// One step of Fisher scoring, which goes at most halfway to where counts or background vanish.
// Returns how far the time that moved furthest went, in ps.
double step(FoldModel& model) {
  const Information information(model);
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

double fit_fold(FoldModel& model) {
  constexpr int most_steps = 8;
  const std::vector<double> before_ps = model.times_ps;
  for (int n = 0; n < most_steps; ++n) {
    if (step(model) < 1e-4 * model.width_ps()) break;
  }
  double furthest_ps = 0;
  for (std::size_t p = 0; p < model.pulses(); ++p) {
    furthest_ps = std::max(furthest_ps, std::abs(model.times_ps[p] - before_ps[p]));
  }
  return furthest_ps;
}

Eigen::MatrixXd fold_covariance(FoldModel& model) {
  const Eigen::MatrixXd matrix = Information(model).matrix;
  return matrix.ldlt().solve(Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols()));
}

}  // namespace splid::calibration
