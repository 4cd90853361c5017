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
    period_.add(clock_->fit(batch_ps_, *first, *last + 1));
  }
  batch_ps_.clear();
}

}  // namespace splid
