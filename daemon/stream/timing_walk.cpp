#include "daemon/stream/timing_walk.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "protocol/saturated.hpp"

namespace splid {

TimingWalk::TimingWalk(std::span<const NumberPair> rows, std::size_t inputs) : last_ps_(inputs) {
  constexpr double ps_a_ns = 1000;
  for (const NumberPair& row : rows) {
    rows_.push_back({std::llround(row[0] * ps_a_ns), std::llround(row[1])});
  }
}

std::int64_t TimingWalk::without(std::int64_t time_ps, std::size_t input) {
  const std::optional<std::int64_t> before_ps = std::exchange(last_ps_[input], time_ps);
  if (!before_ps) return time_ps;
  const std::int64_t wait_ps = saturated_difference(time_ps, *before_ps);
  if (wait_ps < 0 || wait_ps > rows_.back().wait_ps) return time_ps;
  const std::int64_t right_ps = saturated_difference(time_ps, delay_ps(wait_ps));
  last_ps_[input] = right_ps;
  return right_ps;
}

std::int64_t TimingWalk::delay_ps(std::int64_t wait_ps) const {
  if (wait_ps <= rows_.front().wait_ps) return rows_.front().delay_ps;
  const auto high = std::find_if(rows_.begin() + 1, rows_.end(),
                                 [&](const Row& row) { return wait_ps <= row.wait_ps; });
  const Row& low = *(high - 1);
  // At most 2e4 ps times 1e9 ps.
  const std::int64_t rise = (high->delay_ps - low.delay_ps) * (wait_ps - low.wait_ps);
  const std::int64_t span_ps = high->wait_ps - low.wait_ps;
  return low.delay_ps + (rise + (rise > 0 ? span_ps : -span_ps) / 2) / span_ps;
}

}  // namespace splid
