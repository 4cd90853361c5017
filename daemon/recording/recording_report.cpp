#include "daemon/recording/recording_report.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/channel_name.hpp"
#include "daemon/base/text.hpp"
#include "daemon/recording/photon_hdf5_reader.hpp"
#include "drivers/replay/recording_info.hpp"
#include "drivers/replay/recording_reader.hpp"
#include "estimator/checks/detector_waits.hpp"
#include "estimator/checks/finding.hpp"
#include "estimator/model/options.hpp"
#include "estimator/sync/sync_survey.hpp"
#include "protocol/json_value.hpp"
#include "protocol/recording_format.hpp"
#include "protocol/saturated.hpp"
#include "protocol/scan_lines.hpp"
#include "protocol/shown_text.hpp"

namespace splid::recording {
namespace {

// Where a recording's syncs are: on the channel that the configuration in its header names, or else
// in PTU's own sync records.
struct SyncChannel {
  ChannelName channel{TagKind::sync, 0};
  std::string of;  // the channel in words; empty for PTU's own sync records
};

SyncChannel sync_channel(const RecordingHeader& header) {
  const auto config = json_value_if_any(header.config_json);
  const nlohmann::json::json_pointer place("/channels/sync");
  if (config.is_discarded() || !config.contains(place)) return {};
  const nlohmann::json& name = config[place];
  const std::string text = name.is_string() ? name.get<std::string>() : json_text(name);
  const auto channel = parse_channel(text);
  if (!channel || channel->kind == TagKind::sync) return {};
  const std::string what = channel->kind == TagKind::photon ? "input " : "";
  return {*channel, ", of " + what + text + ", which its configuration names"};
}

// The first detections of each input, as many as tell what there is to tell.
using DetectionTimes = std::map<std::int32_t, std::vector<std::int64_t>>;
constexpr std::size_t most_times = 1 << 20;

void keep_time(DetectionTimes& inputs, const Tag& tag) {
  if (tag.kind != TagKind::photon) return;
  std::vector<std::int64_t>& times_ps = inputs[tag.value];
  if (times_ps.size() < most_times) times_ps.push_back(tag.time_ps);
}

std::string count_line(const std::string& name, std::uint64_t count, double duration_s) {
  std::string line = fmt::format("  {:14} {:>15}", name, grouped(count));
  if (duration_s > 0)
    line += fmt::format("  {:>12.6g} /s", static_cast<double>(count) / duration_s);
  return line + "\n";
}

std::string report_steps_back(const RecordingInfo& info) {
  std::string text = fmt::format(
      "  {:14} {:>15}  to a time before the preceding tag, by {} ps at most", "steps back",
      grouped(info.steps_back), grouped(static_cast<std::uint64_t>(info.longest_step_back_ps)));
  if (info.far_steps_back > 0) {
    text += fmt::format(
        "; {} by more than the 1 us within which tags are sorted: such tags are late, or the "
        "tagger's "
        "clock was set",
        grouped(info.far_steps_back));
  }
  return text + "\n";
}

std::string report_channels(const RecordingInfo& info, double duration_s) {
  std::string text;
  for (const auto& [input, count] : info.photons) {
    text += count_line("input " + std::to_string(input), count, duration_s);
  }
  if (info.syncs > 0) text += count_line("sync", info.syncs, duration_s);
  for (std::size_t i = 0; i < info.markers.size(); ++i) {
    if (info.markers[i] == 0) continue;
    text += count_line("marker:" + std::to_string(i), info.markers[i], duration_s);
  }
  return text;
}

std::string report_counts(const RecordingInfo& info, double duration_s) {
  std::string text = report_channels(info, duration_s);
  text += count_line("overflows", info.overflow_records, 0);
  if (info.unknown_records > 0) text += count_line("unknown", info.unknown_records, 0);
  if (info.steps_back > 0) text += report_steps_back(info);
  return text;
}

// From the first tag to the last, s; 0 without tags.
double duration_of(const RecordingInfo& info) {
  if (!info.first_ps || !info.last_ps) return 0;
  return static_cast<double>(saturated_difference(*info.last_ps, *info.first_ps)) / 1e12;
}

std::string report_times(const RecordingInfo& info, double duration_s) {
  if (!info.first_ps || !info.last_ps) return "  no tags\n";
  return fmt::format(
      "  first          {:15} ps\n  last           {:15} ps\n  duration       {:>15.9g} s\n",
      *info.first_ps, *info.last_ps, duration_s);
}

// The period is printed with as many digits as show two digits of its standard deviation.
std::string report_sync_period(const std::optional<MeasuredPeriod>& period, const std::string& of) {
  if (!period) return "  sync period    none that fits" + of + "\n";
  const double std_ps = period->std_period_ps;
  const double digits_needed = std_ps > 0 ? 1 - std::floor(std::log10(std_ps)) : 9;
  const int digits = static_cast<int>(std::clamp(digits_needed, 0.0, 9.0));
  return fmt::format("  sync period    {:>15.{}f} ps +- {:.{}f} ps{}\n", period->period_ps, digits,
                     std_ps, digits, of);
}

// What T3 says instead of the syncs' times, and what it leaves in doubt.
std::string report_t3(const RecordingInfo& info) {
  const double period_ps = info.header.sync_period_s * 1e12;
  std::string text = fmt::format(
      "  sync period    {:>15.6f} ps, as the header has it: T3 counts syncs and does not time "
      "them,\n                 so that frames have no drift and no jitter of the pattern\n",
      period_ps);
  for (const std::string& doubt : doubts_of_t3(info, period_ps, PulseOptions{}.sigma_ps)) {
    text += "  warning: " + doubt + "\n";
  }
  return text;
}

// "record type 0x01010204, ", where the format has types of records.
std::string records_in_words(const RecordingHeader& header) {
  if (!is_pico_quant(header.format)) return {};
  return fmt::format("record type 0x{:08x}, ", static_cast<std::uint32_t>(header.record_type));
}

// What the waits between the detections of each input show. period_ps: of the syncs.
std::string report_detectors(const RecordingInfo& info, DetectionTimes& inputs, double period_ps) {
  constexpr double frame_s = 0.05;
  const auto config = json_value_if_any(info.header.config_json);
  const nlohmann::json::json_pointer place("/detector/dead_time_ns");
  const bool is_known =
      !config.is_discarded() && config.contains(place) && config[place].is_number();
  std::string text;
  for (auto& [input, times_ps] : inputs) {
    if (times_ps.size() < 2) continue;
    std::sort(times_ps.begin(), times_ps.end());
    checks::DetectorWaits waits(is_known ? config[place].get<double>() : 0);
    waits.add(times_ps, period_ps);
    const double seconds =
        static_cast<double>(saturated_difference(times_ps.back(), times_ps.front())) * 1e-12;
    const double in_a_frame = static_cast<double>(times_ps.size()) / seconds * frame_s;
    const FoundList found = waits.found(in_a_frame, 0);
    for (const Finding& finding : found.all()) {
      const checks::FindingRow& row = checks::row_of(finding.name);
      text += fmt::format("  {:14} {} {:.4g} +- {:.2g}{}{}: {}\n", "input " + std::to_string(input),
                          checks::to_string(finding.name), finding.value, finding.std,
                          row.unit[0] != 0 ? " " : "", row.unit, row.advice);
    }
  }
  return text;
}

std::string report_own_facts(const RecordingHeader& header) {
  std::string text;
  if (!header.pattern_json.empty()) text += "  holds the pattern it was recorded with\n";
  if (!header.config_json.empty()) text += "  holds the configuration it was recorded with\n";
  if (const auto encoder = header.text("Splid_Encoder")) {
    text += "  counts of its encoder are beside it in " + *encoder + "\n";
  }
  if (const std::string inputs = header.inputs.text(); !inputs.empty()) {
    text += "  other readers see channels for inputs, CHANNEL:INPUT: " + inputs + "\n";
  }
  return text;
}

// Those that its header lists, and those that its records tell of.
std::string report_losses(const LossSummary& losses) {
  if (losses.count == 0) return {};
  return fmt::format(
      "  losses         {:>15}, {} tags known; losses of an unknown number of tags: {}\n"
      "  first loss     {:15} ps\n  last loss      {:15} ps\n  longest loss   {:15} ps\n",
      grouped(losses.count), grouped(losses.known_tags), grouped(losses.uncounted),
      losses.first_ps.value_or(0), losses.last_ps.value_or(0), losses.longest_ps);
}

// T2: the header's settings of the sync input, which its records may not show. period: of the
// syncs, where they came by that input.
std::string report_divided_syncs(const RecordingHeader& header,
                                 const std::optional<MeasuredPeriod>& period) {
  const std::int64_t divider = header.integer("HWSync_Divider").value_or(1);
  if (divider <= 1) return {};
  std::string text = fmt::format(
      "  warning: one sync in {} was recorded, as the header has it (HWSync_Divider): the sync "
      "period "
      "is then {} pattern periods",
      divider, divider);
  if (period) {
    text += fmt::format(", and a pattern period {:.6f} ps",
                        period->period_ps / static_cast<double>(divider));
  }
  return text + "\n";
}

// The lines that a replay takes by itself (frame.by `auto`), as the key would name them.
std::string report_scan(const RecordingHeader& header) {
  const auto scan = scan_of(header);
  if (!scan) return "";
  return fmt::format(
      "  scan           frame.by \"line:{}:{}:{}\", as the header has it: each dwell is a frame\n",
      scan->start, scan->stop, scan->pixels);
}

// What to do with a recording that has been looked at. syncs: on the channel that has them.
std::string what_next(const RecordingInfo& info, std::uint64_t syncs) {
  if (!info.first_ps)
    return "nothing was detected: look at thresholds and cables, and record again";
  if (syncs == 0 && !info.header.is_t3) {
    return "no sync records: name the input that has a sync each pattern period as channels.sync, "
           "since nothing is measured without";
  }
  return "splid replay measures it, with a pattern and a configuration (docs/guide/first-hour.md)";
}

}  // namespace

std::string report_of(const std::string& file) {
  const SyncChannel sync = sync_channel(RecordingReader(file, [](const std::string&) {}).header());
  SyncSurvey survey;
  std::uint64_t syncs = 0;
  DetectionTimes detections;
  const RecordingInfo info = scan_recording(file, 0, [&](std::span<const Tag> tags) {
    for (const Tag& tag : tags) {
      if (!sync.channel.matches(tag)) {
        keep_time(detections, tag);
        continue;
      }
      survey.take(tag.time_ps);
      ++syncs;
    }
  });
  const double duration_s = duration_of(info);
  const bool t3 = info.header.is_t3;
  std::string text = fmt::format("{}: {}, {}, {}{:.6g} ps a tick\n", shown_text(file, most_said),
                                 in_words(info.header.format), t3 ? "T3" : "T2",
                                 records_in_words(info.header), info.header.resolution_s * 1e12);
  text += count_line("records", info.records, 0);
  text += report_counts(info, duration_s);
  text += report_times(info, duration_s);
  if (t3) {
    text += report_t3(info);
  } else {
    const auto period = survey.finish();
    if (syncs > 0) text += report_sync_period(period, sync.of);
    if (period) text += report_detectors(info, detections, period->period_ps);
    // A PicoHarp's sync input is its input 0.
    const bool by_sync_input = syncs > 0 || info.header.record_type == RecordType::pico_harp;
    if (sync.of.empty() && by_sync_input) text += report_divided_syncs(info.header, period);
  }
  text += report_scan(info.header);
  text += report_losses(info.losses);
  text += report_own_facts(info.header);
  for (const std::string& warning : info.warnings) text += "  warning: " + warning + "\n";
  return text + "  next           " + what_next(info, syncs) + "\n";
}

std::string report_photon_hdf5(const std::string& file) {
  RecordingInfo info;
  const auto warn = [&](const std::string& text) { info.warnings.push_back(text); };
  PhotonHdf5Reader reader(file, warn);
  const RecordingHeader& header = reader.header();
  std::vector<Tag> tags(1 << 16);
  while (const std::size_t count = reader.read(tags)) {
    for (const Tag& tag : std::span(tags).first(count)) {
      if (tag.kind != TagKind::photon) continue;
      ++info.photons[tag.value];
      info.first_ps = std::min(info.first_ps.value_or(tag.time_ps), tag.time_ps);
      info.last_ps = std::max(info.last_ps.value_or(tag.time_ps), tag.time_ps);
    }
  }
  double duration_s = duration_of(info);
  if (header.is_t3) {
    duration_s *= header.sync_period_s * 1e12 / static_cast<double>(whole_period_ps(header));
  }
  std::string text = fmt::format("{}: a Photon-HDF5 recording, {}, {:.6g} ps a tick\n",
                                 shown_text(file, most_said), header.is_t3 ? "T3" : "T2",
                                 header.resolution_s * 1e12);
  text += count_line("photons", header.record_count, 0);
  text += report_channels(info, duration_s);
  text += fmt::format("  duration       {:>15.9g} s\n", duration_s);
  if (header.is_t3) {
    text += fmt::format("  sync period    {:>15.6f} ps, as the file has it\n",
                        header.sync_period_s * 1e12);
  }
  for (const std::string& warning : info.warnings) text += "  warning: " + warning + "\n";
  return text + "  next           splid convert " + shown_text(file, most_said) +
         " NEW.ptu, which every other command takes\n";
}

}  // namespace splid::recording
