#include "daemon/commands/tag_census.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace splid {
namespace {

constexpr std::size_t most_kept = 100'000;
constexpr std::size_t least_kept = 100;

std::string channel_name(TagKind kind, std::int32_t value) {
  if (kind == TagKind::sync) return "sync";
  return (kind == TagKind::marker ? "marker:" : "") + std::to_string(value);
}

std::vector<double> gaps_of(std::vector<std::int64_t> times) {
  std::sort(times.begin(), times.end());
  std::vector<double> gaps;
  for (std::size_t i = 1; i < times.size(); ++i) {
    if (times[i] > times[i - 1]) gaps.push_back(static_cast<double>(times[i] - times[i - 1]));
  }
  return gaps;
}

std::optional<double> regular_period(std::vector<double> gaps) {
  if (gaps.size() + 1 < least_kept) return std::nullopt;
  const auto middle = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2);
  std::nth_element(gaps.begin(), middle, gaps.end());
  const double median = *middle;
  double sum = 0;
  std::size_t regular = 0;
  for (const double gap : gaps) {
    if (std::abs(gap - median) > median / 100) continue;
    sum += gap;
    ++regular;
  }
  if (10 * regular < 9 * gaps.size()) return std::nullopt;
  return sum / static_cast<double>(regular);
}

// Where syncs come beside photons alone, gaps are whole numbers of periods, and the shortest is
// one. The period is the mean of the gaps so far, from the shortest to the longest: each tells it
// to a smaller part of the next.
std::optional<double> sparse_period(std::vector<double> gaps) {
  if (gaps.size() + 1 < least_kept) return std::nullopt;
  std::sort(gaps.begin(), gaps.end());
  double period = gaps.front(), sum = 0, periods = 0;
  std::size_t fitting = 0;
  for (const double gap : gaps) {
    const double count = std::round(gap / period);
    if (std::abs(gap - count * period) > period / 8) continue;
    sum += gap;
    periods += count;
    period = sum / periods;
    ++fitting;
  }
  if (10 * fitting < 9 * gaps.size()) return std::nullopt;
  return period;
}

}  // namespace

void TagCensus::count(std::span<const Tag> tags) {
  for (const Tag& tag : tags) {
    if (is_event(tag.kind)) {
      Times& times = times_[{tag.kind, tag.kind == TagKind::sync ? 0 : tag.value}];
      ++times.tags;
      if (times.first_ps.size() < most_kept) times.first_ps.push_back(tag.time_ps);
    } else if (tag.kind == TagKind::loss_end || tag.kind == TagKind::missed) {
      ++losses_;
      lost_tags_ += static_cast<std::uint64_t>(std::max(tag.value, 0));
    }
  }
}

std::map<std::string, TagCensus::Channel> TagCensus::channels() const {
  std::map<std::string, Channel> all;
  for (const auto& [channel, times] : times_) {
    const std::vector<double> gaps = gaps_of(times.first_ps);
    auto period_ps = regular_period(gaps);
    if (!period_ps && channel.first == TagKind::sync) period_ps = sparse_period(gaps);
    all[channel_name(channel.first, channel.second)] = {times.tags, period_ps};
  }
  return all;
}

std::string TagCensus::sync() const {
  std::string found;
  double longest_ps = 0;
  for (const auto& [name, channel] : channels()) {
    if (name == "sync") return name;
    if (name.starts_with("marker:") || channel.period_ps.value_or(0) <= longest_ps) continue;
    longest_ps = *channel.period_ps;
    found = name;
  }
  return found;
}

std::vector<std::string> TagCensus::photons() const {
  const std::string of_syncs = sync();
  std::vector<std::string> inputs;
  for (const auto& [channel, times] : times_) {
    std::string name = channel_name(channel.first, channel.second);
    if (channel.first == TagKind::photon && name != of_syncs) inputs.push_back(std::move(name));
  }
  return inputs;
}

}  // namespace splid
