#include "estimator/sync/sync_survey.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "protocol/saturated.hpp"

namespace splid {
namespace {

// Design note: 512 gaps tell the period as well as all gaps would (a stray sync spoils two), and
// they fit on the stack, so that nothing is allocated while tags are flowing.
constexpr std::size_t most_gaps = 512;
constexpr std::size_t least_gaps = 8;

// The shortest gap may have this many periods, where an instrument sends only few of the syncs.
constexpr int most_periods = 32;

constexpr double nearly_all = 0.9;       // of the gaps that are alike
constexpr double least_countable = 0.5;  // of the gaps; where fewer are, they tell no period

// The period that gap_ps has `periods` of, if nearly all gaps are multiples of that period. The
// gaps come in ascending order, so that the period is known ever better as they get longer.
std::optional<double> fitted(std::span<const double> ascending_gaps, double gap_ps, int periods) {
  double period_ps = gap_ps / periods;
  const double slack_ps = sync::first_window_ps(period_ps);
  double known = slack_ps / gap_ps;
  double kg = 0;
  double kk = 0;
  double countable = 0;
  double accepted = 0;
  for (const double next_ps : ascending_gaps) {
    const double allowed_ps = slack_ps + next_ps * known;
    if (allowed_ps > period_ps / 4) continue;
    countable += 1;
    const double k = std::round(next_ps / period_ps);
    if (k < 1 || std::abs(next_ps - k * period_ps) > allowed_ps) continue;
    accepted += 1;
    kg += k * next_ps;
    kk += k * k;
    period_ps = kg / kk;
    known = std::min(known, slack_ps / next_ps);
  }
  const auto all = static_cast<double>(ascending_gaps.size());
  if (countable < least_countable * all || accepted < nearly_all * countable) return std::nullopt;
  return period_ps;
}

// Design note: a batch is as long as a frame of the daemon, in which an oscillator's rate is as
// good as constant, and has at least as many syncs as SyncClock follows one by one. Fast syncs fill
// a batch sooner.
constexpr std::int64_t batch_length_ps = 50'000'000'000;
constexpr std::size_t least_stretch_syncs = 64;
constexpr std::size_t most_syncs = 16'384;

// A clock that was set anew, or a pause, ends a batch.
constexpr std::int64_t unsorted_within_ps = 1'000'000;
constexpr std::int64_t longest_survey_gap_ps = 10'000'000'000'000;

// Doubles are told by a long gap, which nine of ten gaps are shorter than.
std::vector<std::int64_t> without_doubles(const std::vector<std::int64_t>& syncs_ps) {
  std::vector<double> gaps;
  for (std::size_t i = 1; i < syncs_ps.size(); ++i) {
    gaps.push_back(static_cast<double>(syncs_ps[i] - syncs_ps[i - 1]));
  }
  if (gaps.empty()) return {};
  const auto long_one = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() * 9 / 10);
  std::nth_element(gaps.begin(), long_one, gaps.end());
  const double least_ps = *long_one * sync::window_of_period;
  std::vector<std::int64_t> kept = {syncs_ps.front()};
  for (const std::int64_t sync_ps : syncs_ps) {
    if (static_cast<double>(sync_ps - kept.back()) >= least_ps) kept.push_back(sync_ps);
  }
  return kept;
}

}  // namespace

std::optional<double> find_sync_period_ps(std::span<const std::int64_t> syncs_ps) {
  std::array<double, most_gaps> room;
  std::size_t count = 0;
  for (std::size_t i = 1; i < syncs_ps.size() && count < most_gaps; ++i) {
    const auto gap_ps = static_cast<double>(syncs_ps[i] - syncs_ps[i - 1]);
    if (gap_ps > 0) room[count++] = gap_ps;
  }
  if (count < least_gaps) return std::nullopt;
  const std::span<double> gaps = std::span(room).first(count);
  std::sort(gaps.begin(), gaps.end());
  std::optional<double> best_ps;
  // The shortest gaps may come from strays or doubles, so longer gaps have their turn too.
  for (const std::size_t part :
       {count, std::size_t{64}, std::size_t{16}, std::size_t{8}, std::size_t{4}, std::size_t{2}}) {
    for (int periods = 1; periods <= most_periods; ++periods) {
      const auto found = fitted(gaps, gaps[count / part], periods);
      if (found && (!best_ps || *found > *best_ps)) best_ps = found;
      if (found) break;
    }
  }
  return best_ps;
}

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
    auto period_ps = find_sync_period_ps(batch_ps_);
    // Many doubles hide the period in the gaps.
    if (!period_ps) period_ps = find_sync_period_ps(without_doubles(batch_ps_));
    if (period_ps) clock_.emplace(*period_ps, DriftMethod::regression, most_syncs);
  }
  if (clock_ && !batch_ps_.empty()) {
    const auto [first, last] = std::minmax_element(batch_ps_.begin(), batch_ps_.end());
    period_.add(clock_->fit(batch_ps_, *first, *last + 1));
  }
  batch_ps_.clear();
}

}  // namespace splid
