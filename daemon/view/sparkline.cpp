#include "daemon/view/sparkline.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace splid::view {
namespace {

constexpr std::array<const char*, 8> blocks{"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
constexpr std::array<const char*, 8> letters{"_", ".", "-", "~", "=", "+", "*", "#"};

}  // namespace

void Sparkline::add(double timestamp_s, const std::optional<double>& value) {
  constexpr double latest_s = 1e12;  // beyond any date, and within an integer
  if (!(std::abs(timestamp_s) < latest_s)) return;
  constexpr std::int64_t disorder_s = 60;
  const auto second = static_cast<std::int64_t>(std::floor(timestamp_s));
  if (second < last_ - disorder_s) seconds_.clear();
  last_ = seconds_.empty() ? second : std::max(last_, second);
  if (value && std::isfinite(*value)) {
    Mean& mean = seconds_[second];
    mean.sum += *value;
    ++mean.count;
  }
  seconds_.erase(seconds_.begin(), seconds_.lower_bound(last_ - kept_s));
}

std::int64_t Sparkline::first_of(std::size_t columns) const {
  return last_ - static_cast<std::int64_t>(columns) + 1;
}

std::optional<Sparkline::Range> Sparkline::range(std::size_t columns) const {
  std::optional<Range> all;
  for (auto at = seconds_.lower_bound(first_of(columns)); at != seconds_.end(); ++at) {
    const double value = at->second.value();
    if (!all) all = Range{value, value};
    all->low = std::min(all->low, value);
    all->high = std::max(all->high, value);
  }
  return all;
}

std::string Sparkline::draw(std::size_t columns, Characters characters) const {
  const auto& levels = characters == Characters::utf8 ? blocks : letters;
  const std::optional<Range> all = range(columns);
  std::string row;
  for (std::size_t i = 0; i < columns; ++i) {
    const auto at = seconds_.find(first_of(columns) + static_cast<std::int64_t>(i));
    if (at == seconds_.end() || !all) {
      row += ' ';
      continue;
    }
    const double span = all->high - all->low;
    const double share = span > 0 ? (at->second.value() - all->low) / span : 0.5;
    const auto level = static_cast<std::size_t>(share * (static_cast<double>(levels.size()) - 1));
    row += levels[std::min(level, levels.size() - 1)];
  }
  return row;
}

}  // namespace splid::view
