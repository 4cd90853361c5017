#include "drivers/replay/recording_info.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <span>

#include "drivers/replay/recording_reader.hpp"
#include "protocol/saturated.hpp"

namespace splid {
namespace {

constexpr std::size_t block_tags = 65'536;
constexpr std::int64_t sorted_within_ps = 1'000'000;

void count_step_back(std::int64_t step_ps, RecordingInfo& info) {
  if (step_ps <= 0) return;
  ++info.steps_back;
  if (step_ps > sorted_within_ps) ++info.far_steps_back;
  info.longest_step_back_ps = std::max(info.longest_step_back_ps, step_ps);
}

void count(const Tag& tag, RecordingInfo& info) {
  const auto value = static_cast<std::size_t>(tag.value);
  if (tag.kind == TagKind::photon && value < info.photons.size()) ++info.photons[value];
  if (tag.kind == TagKind::marker && value < info.markers.size()) ++info.markers[value];
  if (tag.kind == TagKind::sync) ++info.syncs;
  if (!info.first_ps) info.first_ps = info.last_ps = tag.time_ps;
  info.first_ps = std::min(*info.first_ps, tag.time_ps);
  info.last_ps = std::max(*info.last_ps, tag.time_ps);
}

// "a, b and c"
std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) text += i + 1 == names.size() ? " and " : ", ";
    text += names[i];
  }
  return text;
}

}  // namespace

std::uint64_t RecordingInfo::tags() const {
  return std::accumulate(photons.begin(), photons.end(), std::uint64_t{0}) + syncs +
         std::accumulate(markers.begin(), markers.end(), std::uint64_t{0});
}

RecordingInfo scan_recording(const std::string& file, std::uint64_t max_tags, const SeeTags& see) {
  RecordingInfo info;
  RecordingReader reader(file, [&info](const std::string& text) { info.warnings.push_back(text); });
  info.header = reader.header();
  std::vector<Tag> block(block_tags);
  std::uint64_t scanned = 0;
  std::optional<std::int64_t> before_ps;
  while (max_tags == 0 || scanned < max_tags) {
    const std::span<const Tag> tags = std::span(block).first(reader.read(block));
    info.whole = tags.empty();
    if (info.whole) break;
    for (const Tag& tag : tags) {
      count(tag, info);
      count_step_back(saturated_difference(before_ps.value_or(tag.time_ps), tag.time_ps), info);
      before_ps = tag.time_ps;
    }
    if (see) see(tags);
    scanned += tags.size();
  }
  info.records = reader.records();
  info.overflow_records = reader.decoder().overflow_records();
  info.unknown_records = reader.decoder().unknown_records();
  return info;
}

std::string channels_in_words(const RecordingInfo& info) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < info.photons.size(); ++i) {
    if (info.photons[i] > 0) names.push_back("input " + std::to_string(i));
  }
  if (info.syncs > 0) names.emplace_back("sync");
  for (std::size_t i = 0; i < info.markers.size(); ++i) {
    if (info.markers[i] > 0) names.push_back("marker:" + std::to_string(i));
  }
  return names.empty() ? "no tags" : joined(names);
}

}  // namespace splid
