#include "estimator/sync/sync_survey.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "estimator/sync/sync_clock.hpp"
#include "estimator/sync/sync_curvature.hpp"
#include "protocol/saturated.hpp"

namespace splid {
namespace {

// Design note: 512 gaps tell the period as well as all gaps would (a stray sync spoils two), and
// they fit on the stack, so that nothing is allocated while tags are flowing.
constexpr std::size_t most_gaps = 512;
constexpr std::size_t least_gaps = 8;

// The shortest gap may have this many periods, where an instrument sends only few of the syncs.
constexpr int most_periods = 32;

constexpr double least_countable = 0.5;  // of the gaps; where fewer are, they tell no period

// The period that gap_ps has `periods` of, if most gaps are multiples of that period. The
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
  if (countable < least_countable * all || accepted < sync::min_agreeing * countable)
    return std::nullopt;
  return period_ps;
}

std::size_t sorted_gaps(std::span<const std::int64_t> syncs_ps,
                        std::array<double, most_gaps>& gaps) {
  std::size_t count = 0;
  for (std::size_t i = 1; i < syncs_ps.size() && count < most_gaps; ++i) {
    const auto gap_ps = static_cast<double>(syncs_ps[i] - syncs_ps[i - 1]);
    if (gap_ps > 0) gaps[count++] = gap_ps;
  }
  std::sort(gaps.begin(), gaps.begin() + static_cast<std::ptrdiff_t>(count));
  return count;
}

// Doubles are told by a long gap, which nine of ten gaps are shorter than.
std::vector<std::int64_t> without_doubles(std::span<const std::int64_t> syncs_ps) {
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

// Many doubles hide the period in the gaps, so they are taken out where the first try fails.
std::optional<double> first_period_ps(std::span<const std::int64_t> syncs_ps) {
  const auto found = find_sync_period_ps(syncs_ps);
  return found ? found : find_sync_period_ps(without_doubles(syncs_ps));
}

}  // namespace

std::optional<double> find_sync_period_ps(std::span<const std::int64_t> syncs_ps) {
  std::array<double, most_gaps> room;
  const std::size_t count = sorted_gaps(syncs_ps, room);
  if (count < least_gaps) return std::nullopt;
  const std::span<const double> gaps = std::span<const double>(room).first(count);
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

std::optional<MeasuredPeriod> survey_period(std::span<const std::int64_t> syncs_ps) {
  constexpr std::size_t most_syncs = 16'384;
  constexpr std::int64_t longest_ps = std::numeric_limits<std::int64_t>::max() / 2;
  while (!syncs_ps.empty()) {
    const auto part = syncs_ps.first(std::min(most_syncs, syncs_ps.size()));
    syncs_ps = syncs_ps.subspan(part.size());
    const auto [first, last] = std::minmax_element(part.begin(), part.end());
    // Times of a damaged recording may be farther apart than 64 bits tell.
    if (saturated_difference(*last, *first) > longest_ps) continue;
    const auto about_ps = first_period_ps(part);
    if (!about_ps) continue;
    SyncClock clock(*about_ps, DriftMethod::regression, part.size());
    const SyncFit fit = clock.fit(part, *first, saturated_sum(*last, 1));
    if (fit.locked) return MeasuredPeriod{fit.period_ps, fit.std_period_ps};
  }
  return std::nullopt;
}

}  // namespace splid
