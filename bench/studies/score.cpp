#include "bench/studies/score.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace splid::studies {
namespace {

// The smallest value that a share of all values does not exceed.
double quantile(std::vector<double> sorted, double share) {
  std::sort(sorted.begin(), sorted.end());
  const double rank = std::ceil(share * static_cast<double>(sorted.size()));
  return sorted[static_cast<std::size_t>(std::max(1.0, rank)) - 1];
}

// With few photons a delay may be off by more than a pulse width, and its deviation says so.
bool is_wrong_and_sure(const TrialOutcome& outcome) {
  return !outcome.ambiguous && std::abs(outcome.error[delay]) > 5 * outcome.deviation[delay];
}

bool publishes_deviations(const TrialOutcome& outcome) {
  return std::all_of(outcome.deviation.begin(), outcome.deviation.begin() + delay_start,
                     [](double deviation) { return deviation > 0; });
}

// Both add a frame to the sums, which score() divides at the end.
void add_found(const TrialOutcome& outcome, Score& sums) {
  for (std::size_t i = 0; i < values; ++i) {
    sums.rmse_all[i] += outcome.error[i] * outcome.error[i];
  }
}

void add_right(const TrialOutcome& outcome, Score& sums) {
  const bool published = publishes_deviations(outcome);
  sums.with_deviation += published ? 1 : 0;
  for (std::size_t i = 0; i < values; ++i) {
    sums.rmse[i] += outcome.error[i] * outcome.error[i];
    const double off = std::abs(outcome.error[i]);
    sums.inside_one[i] += published && off <= outcome.deviation[i] ? 1 : 0;
    sums.inside_two[i] += published && off <= 2 * outcome.deviation[i] ? 1 : 0;
  }
}

}  // namespace

Share wilson_95(int hits, int trials) {
  constexpr double z = 1.959964;
  const double n = trials;
  const double share = hits / n;
  const double middle = (share + z * z / (2 * n)) / (1 + z * z / n);
  const double half =
      z / (1 + z * z / n) * std::sqrt(share * (1 - share) / n + z * z / (4 * n * n));
  // At 0 and at 1 the two terms cancel, except for rounding.
  return {hits == 0 ? 0 : middle - half, hits == trials ? 1 : middle + half};
}

double Score::relative_error() const { return 1 / std::sqrt(2.0 * right()); }

Score score(const std::vector<TrialOutcome>& outcomes, double wrong_peak_limit_ns) {
  Score found;
  std::vector<double> times_ms;
  for (const TrialOutcome& outcome : outcomes) {
    ++found.trials;
    times_ms.push_back(outcome.compute_ms);
    found.ambiguous += outcome.has_values && outcome.ambiguous ? 1 : 0;
    if (!outcome.has_values) {
      ++found.no_value;
      continue;
    }
    add_found(outcome, found);
    if (std::abs(outcome.error[delay]) > wrong_peak_limit_ns) {
      ++found.wrong;
      found.wrong_ok += is_wrong_and_sure(outcome) ? 1 : 0;
    } else {
      add_right(outcome, found);
    }
  }
  for (std::size_t i = 0; i < values; ++i) {
    found.rmse[i] = std::sqrt(found.rmse[i] / std::max(1, found.right()));
    found.rmse_all[i] = std::sqrt(found.rmse_all[i] / std::max(1, found.found()));
    found.inside_one[i] /= std::max(1, found.with_deviation);
    found.inside_two[i] /= std::max(1, found.with_deviation);
  }
  if (!times_ms.empty()) {
    found.p50_ms = quantile(times_ms, 0.5);
    found.p99_ms = quantile(times_ms, 0.99);
  }
  return found;
}

}  // namespace splid::studies
