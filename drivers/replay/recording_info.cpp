#include "drivers/replay/recording_info.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <span>

#include "drivers/replay/recording_reader.hpp"
#include "protocol/json_writer.hpp"
#include "protocol/saturated.hpp"

namespace splid {
namespace {

constexpr std::size_t look_tags = 65'536;
constexpr std::int64_t sorted_within_ps = 1'000'000;

// A header's period comes of a rate in whole hertz: for 264,550 Hz to 2e-6.
constexpr double most_period_error = 1e-3;

void count_step_back(std::int64_t step_ps, RecordingInfo& info) {
  if (step_ps <= 0) return;
  ++info.steps_back;
  if (step_ps > sorted_within_ps) ++info.far_steps_back;
  info.longest_step_back_ps = std::max(info.longest_step_back_ps, step_ps);
}

void count(const Tag& tag, RecordingInfo& info) {
  const auto value = static_cast<std::size_t>(tag.value);
  if (tag.kind == TagKind::photon) ++info.photons[tag.value];
  if (tag.kind == TagKind::marker && value < info.markers.size()) ++info.markers[value];
  if (tag.kind == TagKind::sync) ++info.syncs;
  if (!info.first_ps) info.first_ps = info.last_ps = tag.time_ps;
  info.first_ps = std::min(*info.first_ps, tag.time_ps);
  info.last_ps = std::max(*info.last_ps, tag.time_ps);
}

// The losses that the records tell of; untimed photons, which are `missed` tags, are none.
class LossesOfRecords {
 public:
  explicit LossesOfRecords(LossSummary& summary) : summary_(summary) {}

  void take(const Tag& tag) {
    if (tag.kind == TagKind::loss_begin && !is_open_) {
      is_open_ = true;
      since_ps_ = tag.time_ps;
    }
    if (tag.kind == TagKind::loss_end) end(tag.time_ps, tag.value);
  }
  // A loss that has not ended reaches to the end.
  void finish(std::int64_t end_ps) {
    if (is_open_) end(end_ps, -1);
  }

 private:
  void end(std::int64_t end_ps, std::int64_t count) {
    const std::int64_t begin_ps = is_open_ ? since_ps_ : end_ps;
    summary_.add({std::min(begin_ps, end_ps), std::max(begin_ps, end_ps), count});
    is_open_ = false;
  }

  LossSummary& summary_;
  bool is_open_ = false;
  std::int64_t since_ps_ = 0;  // where a loss is open
};

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

void LossSummary::add(const Loss& loss) {
  ++count;
  if (loss.count < 0) ++uncounted;
  if (loss.count > 0) known_tags += static_cast<std::uint64_t>(loss.count);
  first_ps = std::min(first_ps.value_or(loss.begin_ps), loss.begin_ps);
  last_ps = std::max(last_ps.value_or(loss.begin_ps), loss.begin_ps);
  longest_ps = std::max(longest_ps, saturated_difference(loss.end_ps, loss.begin_ps));
}

std::uint64_t RecordingInfo::tags() const {
  const auto add = [](std::uint64_t sum, const auto& input) { return sum + input.second; };
  return std::accumulate(photons.begin(), photons.end(), syncs, add) +
         std::accumulate(markers.begin(), markers.end(), std::uint64_t{0});
}

RecordingInfo scan_recording(const std::string& file, std::uint64_t max_tags, const SeeTags& see) {
  RecordingInfo info;
  RecordingReader reader(file, [&info](const std::string& text) { info.warnings.push_back(text); });
  info.header = reader.header();
  for (const Loss& loss : info.header.losses) info.losses.add(loss);
  LossesOfRecords losses(info.losses);
  std::vector<Tag> block(look_tags);
  std::uint64_t scanned = 0;
  std::optional<std::int64_t> before_ps;
  while (max_tags == 0 || scanned < max_tags) {
    const std::span<const Tag> tags = std::span(block).first(reader.read(block));
    info.whole = tags.empty();
    if (info.whole) break;
    for (const Tag& tag : tags) {
      count(tag, info);
      losses.take(tag);
      count_step_back(saturated_difference(before_ps.value_or(tag.time_ps), tag.time_ps), info);
      before_ps = tag.time_ps;
    }
    if (see) see(tags);
    scanned += tags.size();
  }
  losses.finish(info.last_ps.value_or(0));
  info.records = reader.records();
  info.overflow_records = reader.decoder().overflow_records();
  info.unknown_records = reader.decoder().unknown_records();
  info.saturated_photons = reader.decoder().saturated_photons();
  return info;
}

std::vector<std::string> doubts_of_t3(const RecordingInfo& info, double period_ps,
                                      double pulse_sigma_ps) {
  const RecordingHeader& header = info.header;
  if (!header.is_t3) return {};
  std::vector<std::string> doubts;
  const std::int64_t divider = header.integer("HWSync_Divider").value_or(1);
  if (divider > 1) {
    doubts.push_back("its syncs were divided by " + std::to_string(divider) +
                     " (HWSync_Divider), so that a photon's time may be since an earlier pattern "
                     "period than its sync's; record without a divider");
  }
  const double sync_ps = header.sync_period_s * 1e12;
  if (std::abs(sync_ps - period_ps) > most_period_error * period_ps) {
    doubts.push_back(
        "its header has a sync every " + number_text(sync_ps) +
        " ps, and the pattern a period of " + number_text(period_ps) +
        " ps: the syncs were divided, the recorder counted by a clock of its own, or it is "
        "another pattern");
  }
  const double tick_ps = header.resolution_s * 1e12;
  const auto steps = static_cast<double>(header.time_steps);
  if (steps * tick_ps < std::min(sync_ps, period_ps)) {
    doubts.push_back("a photon's time since its sync fits a record up to " +
                     number_text(steps * tick_ps / 1000) + " ns, and syncs come every " +
                     number_text(sync_ps / 1000) +
                     " ns: later photons are lost; record with coarser steps, or in T2 mode");
  }
  if (tick_ps > pulse_sigma_ps) {
    doubts.push_back("photons' times have steps of " + number_text(tick_ps) +
                     " ps, which are coarser than pulses of " + number_text(pulse_sigma_ps) +
                     " ps: errors are larger than the standard deviations of frames; record with "
                     "finer steps, or "
                     "in T2 mode");
  }
  if (info.saturated_photons > 0) {
    doubts.push_back(
        "photons that came later after their sync than a record can say, and count as lost: " +
        std::to_string(info.saturated_photons));
  }
  return doubts;
}

std::optional<std::string> width_fault(const RecordingHeader& header, double pulse_sigma_ps) {
  // Standard deviation of a time that is rounded to steps.
  const double tick_ps = header.resolution_s * 1e12;
  const double least_ps = std::ceil(tick_ps / std::sqrt(12.0));
  if (pulse_sigma_ps >= least_ps) return std::nullopt;
  return number_text(pulse_sigma_ps) + " is below " + number_text(least_ps) +
         " ps, by which the recording's steps of " + number_text(tick_ps) +
         " ps alone spread a pulse; write the width in ps";
}

std::string channels_in_words(const RecordingInfo& info) {
  std::vector<std::string> names;
  for (const auto& [input, count] : info.photons) {
    names.push_back("input " + std::to_string(input));
  }
  if (info.syncs > 0) names.emplace_back("sync");
  for (std::size_t i = 0; i < info.markers.size(); ++i) {
    if (info.markers[i] > 0) names.push_back("marker:" + std::to_string(i));
  }
  return names.empty() ? "no tags" : joined(names);
}

}  // namespace splid
