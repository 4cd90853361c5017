#include "daemon/study/calibration/crosstalk.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace splid::calibration {
namespace {

constexpr double longest_ps = 20'000;
constexpr int periods_apart = 4;  // the pairs to take off are a mean over so many
constexpr double deviations = 5;
constexpr std::size_t most_lines = 20;
constexpr double ps_per_ns = 1e3;

}  // namespace

CrosstalkCount::CrosstalkCount(double period_ps, std::vector<double> late_ps)
    : period_ps_(period_ps),
      late_ps_(std::move(late_ps)),
      detected_(late_ps_.size()),
      near_(late_ps_.size() * late_ps_.size()),
      far_(near_.size()) {}

double CrosstalkCount::Lags::spread_ps2(double from_ps) const {
  return sum_ps2 - 2 * from_ps * sum_ps + from_ps * from_ps * count;
}

void CrosstalkCount::add(const Frame& frame) {
  const auto length_ps = static_cast<double>(frame.end_ps - frame.start_ps);
  if (length_ps < (periods_apart + 1) * period_ps_) return;
  collect(frame);
  count(0, 1, near_);
  for (int k = 1; k <= periods_apart; ++k) {
    const double apart_ps = k * period_ps_;
    // The first detections of a frame have none so far before them.
    const double weight = length_ps / (length_ps - apart_ps) / periods_apart;
    count(std::llround(apart_ps), weight, far_);
  }
}

void CrosstalkCount::collect(const Frame& frame) {
  detections_.clear();
  for (std::size_t i = 0; i < late_ps_.size(); ++i) {
    const auto late_ps = std::llround(late_ps_[i]);
    const auto photons = frame.pixels[i]->photons_ps.view();
    for (const std::int64_t time_ps : photons) detections_.push_back({time_ps - late_ps, i});
    detected_[i] += static_cast<double>(photons.size());
  }
  std::sort(detections_.begin(), detections_.end(),
            [](const Detection& a, const Detection& b) { return a.time_ps < b.time_ps; });
}

// Adds all pairs of which the second comes up to 20 ns after the first, and apart_ps more.
void CrosstalkCount::count(std::int64_t apart_ps, double weight, std::vector<Lags>& pairs) const {
  const auto window_ps = std::llround(std::min(longest_ps, period_ps_ / 2));
  auto first = detections_.begin();
  for (const Detection& second : detections_) {
    const std::int64_t until_ps = second.time_ps - apart_ps;
    while (first->time_ps < until_ps - window_ps) ++first;
    for (auto it = first; it != detections_.end() && it->time_ps <= until_ps; ++it) {
      if (it->pixel == second.pixel) continue;
      const auto lag_ps = static_cast<double>(until_ps - it->time_ps);
      Lags& lags = pairs[it->pixel * late_ps_.size() + second.pixel];
      lags.count += weight;
      lags.sum_ps += weight * lag_ps;
      lags.sum_ps2 += weight * lag_ps * lag_ps;
    }
  }
}

std::vector<Crosstalk> CrosstalkCount::significant() const {
  std::vector<Crosstalk> found;
  for (std::size_t i = 0; i < near_.size(); ++i) {
    const Lags& near = near_[i];
    const Lags& far = far_[i];
    const double excess = near.count - far.count;
    const double std_excess = std::sqrt(near.count + far.count / periods_apart);
    if (!(excess > deviations * std_excess)) continue;
    const std::size_t from = i / late_ps_.size();
    const double delay_ps = (near.sum_ps - far.sum_ps) / excess;
    const double spread_ps2 = near.spread_ps2(delay_ps) + far.spread_ps2(delay_ps) / periods_apart;
    found.push_back({from, i % late_ps_.size(), excess / detected_[from],
                     std_excess / detected_[from], delay_ps / ps_per_ns,
                     std::sqrt(spread_ps2) / excess / ps_per_ns});
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Crosstalk& a, const Crosstalk& b) { return a.share > b.share; });
  return found;
}

std::string describe_crosstalk(const std::vector<Crosstalk>& pairs,
                               const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < std::min(pairs.size(), most_lines); ++i) {
    const Crosstalk& pair = pairs[i];
    text += fmt::format(
        "crosstalk from {} to {}: {:.3g} +- {:.2g} % of its detections, after {:.3g} +- {:.2g} "
        "ns\n",
        names[pair.from], names[pair.to], 100 * pair.share, 100 * pair.std_share, pair.delay_ns,
        pair.std_delay_ns);
  }
  if (pairs.size() > most_lines) {
    text += fmt::format("crosstalk of {} more pairs is smaller\n", pairs.size() - most_lines);
  }
  return text;
}

}  // namespace splid::calibration
