#include "estimator/sync/sync_survey.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "estimator/sync/period_from_gaps.hpp"
#include "protocol/saturated.hpp"

namespace splid {
namespace {

// Design note: a batch is as long as a frame of the daemon, in which an oscillator's rate is as
// good as constant, and has at least as many syncs as SyncClock follows one by one. Fast syncs fill
// a batch sooner.
constexpr std::int64_t batch_length_ps = 50'000'000'000;
constexpr std::size_t least_stretch_syncs = 64;
constexpr std::size_t most_syncs = 16'384;

// A clock that was set anew, or a pause, ends a batch.
constexpr std::int64_t unsorted_within_ps = 1'000'000;
constexpr std::int64_t longest_survey_gap_ps = 10'000'000'000'000;

// A sync that comes sooner after another than this part of a long gap is a double of it. A long gap
// is one that nine of ten gaps are shorter than.
constexpr double double_of_gap = 1.0 / 16;

std::vector<std::int64_t> without_doubles(const std::vector<std::int64_t>& syncs_ps) {
  std::vector<double> gaps;
  for (std::size_t i = 1; i < syncs_ps.size(); ++i) {
    gaps.push_back(static_cast<double>(syncs_ps[i] - syncs_ps[i - 1]));
  }
  if (gaps.empty()) return {};
  const auto long_one = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() * 9 / 10);
  std::nth_element(gaps.begin(), long_one, gaps.end());
  const double least_ps = *long_one * double_of_gap;
  std::vector<std::int64_t> kept = {syncs_ps.front()};
  for (const std::int64_t sync_ps : syncs_ps) {
    if (static_cast<double>(sync_ps - kept.back()) >= least_ps) kept.push_back(sync_ps);
  }
  return kept;
}

// Whether the generator began again between two fits: the pattern's starts are then farther from
// where the fit before expects them than the errors of both fits, and an oscillator that wanders by
// 0.1 ppm, explain.
bool began_again(const SyncFit& before, const SyncFit& fit) {
  constexpr double wander = 1e-7;
  constexpr double deviations = 10;
  const double gap_ps = static_cast<double>(saturated_difference(fit.origin_ps, before.origin_ps)) +
                        fit.phase_ps - before.phase_ps;
  const double period_ps = (fit.period_ps + before.period_ps) / 2;
  const double periods = std::round(gap_ps / period_ps);
  const double std_ps = std::hypot(before.std_phase_ps, fit.std_phase_ps) +
                        std::abs(periods) * (before.std_period_ps + fit.std_period_ps) / 2;
  return std::abs(gap_ps - periods * period_ps) >
         deviations * std_ps + wander * std::abs(gap_ps) + 1;
}

// Many doubles hide the period in the gaps, so they are taken out where the first try fails.
std::optional<double> first_period_ps(const std::vector<std::int64_t>& syncs_ps) {
  const auto found = find_sync_period_ps(syncs_ps);
  return found ? found : find_sync_period_ps(without_doubles(syncs_ps));
}

}  // namespace

void SyncSurvey::take(std::int64_t sync_ps) {
  if (!batch_ps_.empty()) {
    const std::int64_t step_ps = saturated_difference(sync_ps, batch_ps_.back());
    const std::int64_t length_ps = saturated_difference(sync_ps, batch_ps_.front());
    const bool is_long = length_ps >= batch_length_ps && batch_ps_.size() >= least_stretch_syncs;
    const bool is_apart = step_ps < -unsorted_within_ps || step_ps > longest_survey_gap_ps;
    if (is_long || is_apart || batch_ps_.size() == most_syncs) end_batch();
  }
  batch_ps_.push_back(sync_ps);
}

std::optional<MeasuredPeriod> SyncSurvey::finish() {
  end_batch();
  const MeasuredPeriod period = period_.period();
  if (!(period.period_ps > 0)) return std::nullopt;
  return period;
}

void SyncSurvey::end_batch() {
  if (!clock_) {
    if (const auto period_ps = first_period_ps(batch_ps_)) {
      clock_.emplace(*period_ps, DriftMethod::regression, most_syncs);
    }
  }
  if (clock_ && !batch_ps_.empty()) {
    const auto [first, last] = std::minmax_element(batch_ps_.begin(), batch_ps_.end());
    const SyncFit fit = clock_->fit(batch_ps_, *first, *last + 1);
    if (fit.locked) {
      if (last_.locked && began_again(last_, fit)) period_.cut();
      period_.add(fit);
      last_ = fit;
    }
  }
  batch_ps_.clear();
}

}  // namespace splid
