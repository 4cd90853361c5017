#include "estimator/calibration/fold_model.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "estimator/model/units.hpp"

namespace splid::calibration {
namespace {

TabulatedPulse gaussian_table(double width_ps) {
  constexpr double reach_widths = 5;
  constexpr int steps_per_width = 4;
  constexpr int half = static_cast<int>(reach_widths) * steps_per_width;
  TabulatedPulse table{-reach_widths * width_ps, width_ps / steps_per_width, {}};
  for (int j = -half; j <= half; ++j) {
    const double x = static_cast<double>(j) / steps_per_width;
    table.density.push_back(std::exp(-0.5 * x * x));
  }
  return table;
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

double FoldModel::median_gap_ps() const {
  std::vector<double> gaps;
  for (std::size_t p = 1; p < pulses(); ++p) gaps.push_back(times_ps[p] - times_ps[p - 1]);
  gaps.push_back(times_ps.front() + period_ps_ - times_ps.back());
  const auto middle = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2);
  std::nth_element(gaps.begin(), middle, gaps.end());
  return *middle;
}

void FoldModel::set_table(const TabulatedPulse& table) {
  table_ = table;
  shape_ = make_tabulated(table_);
}

const std::vector<double>& FoldModel::rates() {
  rates_.assign(fold_.bins(), background_per_ps * bin_ps_);
  for (std::size_t p = 0; p < pulses(); ++p) {
    const Window part = window(p);
    for (std::size_t i = 0; i < part.h.size(); ++i) {
      rates_[fold_.wrapped(part.first + static_cast<std::ptrdiff_t>(i))] +=
          counts[p] * part.h[i] * bin_ps_;
    }
  }
  return rates_;
}

}  // namespace splid::calibration
