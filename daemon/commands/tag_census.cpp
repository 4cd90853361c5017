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

std::optional<double> regular_period(std::vector<std::int64_t> times) {
  if (times.size() < least_kept) return std::nullopt;
  std::sort(times.begin(), times.end());
  std::vector<double> gaps;
  for (std::size_t i = 1; i < times.size(); ++i) {
    gaps.push_back(static_cast<double>(times[i] - times[i - 1]));
  }
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
    all[channel_name(channel.first, channel.second)] = {times.tags, regular_period(times.first_ps)};
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
