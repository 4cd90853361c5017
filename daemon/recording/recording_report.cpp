#include "daemon/recording/recording_report.hpp"

#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstdint>
#include <vector>

#include "daemon/format.hpp"
#include "drivers/replay/recording_info.hpp"
#include "drivers/replay/recording_reader.hpp"
#include "estimator/sync_period.hpp"

namespace splid {
namespace {

// Syncs that the period is looked for in: 60 ms of a 3780 ns pattern.
constexpr std::size_t syncs_looked_at = 16'384;

std::vector<std::int64_t> first_syncs(const std::string& file) {
  RecordingReader reader(file, [](const std::string&) {});
  std::vector<Tag> block(65'536);
  std::vector<std::int64_t> syncs_ps;
  for (std::size_t count = 1; count > 0 && syncs_ps.size() < syncs_looked_at;) {
    count = reader.read(block);
    for (std::size_t i = 0; i < count && syncs_ps.size() < syncs_looked_at; ++i) {
      if (block[i].kind == TagKind::sync) syncs_ps.push_back(block[i].time_ps);
    }
  }
  return syncs_ps;
}

std::string count_line(const std::string& name, std::uint64_t count, double duration_s) {
  std::string line = format("  %-14s %15s", name.c_str(), grouped(count).c_str());
  if (duration_s > 0) line += format("  %12.6g /s", static_cast<double>(count) / duration_s);
  return line + "\n";
}

std::string report_counts(const RecordingInfo& info, double duration_s) {
  std::string text;
  for (std::size_t i = 0; i < info.photons.size(); ++i) {
    if (info.photons[i] == 0) continue;
    text += count_line("input " + std::to_string(i), info.photons[i], duration_s);
  }
  if (info.syncs > 0) text += count_line("sync", info.syncs, duration_s);
  for (std::size_t i = 0; i < info.markers.size(); ++i) {
    if (info.markers[i] == 0) continue;
    text += count_line("marker:" + std::to_string(i), info.markers[i], duration_s);
  }
  text += count_line("overflows", info.overflow_records, 0);
  if (info.unknown_records > 0) text += count_line("unknown", info.unknown_records, 0);
  if (info.steps_back > 0) text += count_line("steps back", info.steps_back, 0);
  return text;
}

std::string report_times(const RecordingInfo& info, double duration_s) {
  if (!info.first_ps || !info.last_ps) return "  no tags\n";
  return format("  first          %15" PRId64 " ps\n  last           %15" PRId64
                " ps\n  duration       %15.9g s\n",
                *info.first_ps, *info.last_ps, duration_s);
}

std::string report_sync_period(const std::string& file, const RecordingInfo& info) {
  if (info.syncs == 0) return {};
  const auto period_ps = find_sync_period_ps(first_syncs(file));
  if (!period_ps) return "  sync period    none that fits\n";
  return format("  sync period    %15.6f ps\n", *period_ps);
}

std::string report_own_facts(const PtuHeader& header) {
  std::string text;
  if (!header.pattern_json.empty()) text += "  holds the pattern it was recorded with\n";
  if (!header.config_json.empty()) text += "  holds the configuration it was recorded with\n";
  if (const auto encoder = header.text("Splid_Encoder")) {
    text += "  counts of its encoder are beside it in " + *encoder + "\n";
  }
  if (header.losses.empty()) return text;
  std::uint64_t known = 0;
  for (const Loss& loss : header.losses) {
    known += static_cast<std::uint64_t>(std::max<std::int64_t>(loss.count, 0));
  }
  return text + format("  losses         %15s, %s tags known\n",
                       grouped(header.losses.size()).c_str(), grouped(known).c_str());
}

}  // namespace

std::string report_recording(const std::string& file) {
  const RecordingInfo info = scan_recording(file);
  const bool timed = info.first_ps && info.last_ps;
  const double duration_s = timed ? static_cast<double>(*info.last_ps - *info.first_ps) / 1e12 : 0;
  std::string text =
      format("%s: a PTU recording, T2, record type 0x%08" PRIx32 ", %.6g ps a tick\n", file.c_str(),
             static_cast<std::uint32_t>(info.header.record_type), info.header.resolution_s * 1e12);
  text += count_line("records", info.records, 0);
  text += report_counts(info, duration_s);
  text += report_times(info, duration_s);
  text += report_sync_period(file, info);
  text += report_own_facts(info.header);
  for (const std::string& warning : info.warnings) text += "  warning: " + warning + "\n";
  return text;
}

}  // namespace splid
