#include "daemon/batch/merge_slices.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include "daemon/base/text.hpp"
#include "daemon/base/write_file.hpp"
#include "daemon/batch/recording_summary.hpp"
#include "daemon/recording/frame_table.hpp"
#include "protocol/text.hpp"

namespace splid::batch {
namespace {

// What is missing of a recording, in a sentence; empty where its slices are whole.
std::string missing_of(const std::vector<SliceHead>& slices,
                       const std::optional<Folder::Members>& end, bool has_checksum) {
  std::uint64_t number = 0;
  std::uint64_t frames = 0;
  for (const SliceHead& slice : slices) {
    if (slice.number != number) break;
    frames += slice.frames;
    ++number;
  }
  if (number < slices.size()) return fmt::format("slice {} is missing", number);
  if (!end) return fmt::format("what follows frame {} is missing", grouped(frames));
  const auto all = whole_number(end->at("frames"));
  if (!all || frames != static_cast<std::uint64_t>(*all)) {
    return fmt::format("{} of its {} frames are there", grouped(frames), end->at("frames"));
  }
  return has_checksum ? "" : "its checksum is missing";
}

std::string make_table(const Folder& folder, const Recording& recording,
                       const Folder::Members& facts, const std::vector<SliceHead>& slices,
                       const std::string& checksum) {
  RecordingSummary summary;
  {
    recording::FrameTable table(folder.new_table_file(recording),
                                {facts.at("program"), facts.at("configuration"),
                                 facts.at("pattern"), facts.at("recording")},
                                true);
    for (const SliceHead& slice : slices) {
      const std::string rows = folder.slice_rows(recording, slice);
      summary.take(rows);
      table.add_rows(rows);
      table.flush();
    }
    table.write_checksum(checksum);
  }
  folder.keep_table(recording);
  return summary.lines();
}

Outcome outcome_of(const Recording& recording, State state) {
  Outcome outcome;
  outcome.recording = recording;
  outcome.state = state;
  return outcome;
}

Outcome done(const Recording& recording, const std::string& lines) {
  Outcome outcome = outcome_of(recording, State::done);
  outcome.lines = lines;
  return outcome;
}

Outcome not_done(const Folder& folder, const Recording& recording, const std::string& missing) {
  const auto failure = folder.read(recording, failure_of_recording, "");
  const bool failed = failure && failure->contains("why");
  Outcome outcome = outcome_of(recording, failed ? State::failed : State::unfinished);
  outcome.why = failed ? failure->at("why") : recording.file + ": " + missing;
  return outcome;
}

std::string quoted_field(const std::string& text) {
  std::string field = "\"";
  for (const char c : text) field += c == '"' ? std::string("\"\"") : std::string(1, c);
  return field + "\"";
}

}  // namespace

Outcome merge_slices(const Folder& folder, const Recording& recording) {
  const auto facts = folder.read(recording, facts_of_table, "");
  const std::string key = facts && facts->contains("key") ? facts->at("key") : "";
  const auto summary = folder.finished(recording, key);
  if (summary) {
    folder.remove_slices(recording);
    return done(recording, *summary);
  }
  if (key.empty()) return not_done(folder, recording, "no part of it was measured");
  const auto end = folder.read(recording, end_of_recording, key);
  const auto checksum = folder.read(recording, checksum_of_recording, key);
  const std::vector<SliceHead> slices = folder.slices(recording, key);
  const std::string missing = missing_of(slices, end, checksum.has_value());
  if (!missing.empty()) return not_done(folder, recording, missing);
  const std::string lines = make_table(folder, recording, *facts, slices, checksum->at("sha256"));
  folder.write(recording, summary_of_recording, {{"key", key}, {"lines", lines}});
  folder.remove_slices(recording);
  return done(recording, lines);
}

std::string summary_text(const std::vector<Outcome>& outcomes) {
  constexpr std::array names = {"done", "failed", "unfinished"};
  const std::string columns = RecordingSummary::columns();
  const auto values = static_cast<std::size_t>(std::count(columns.begin(), columns.end(), ','));
  std::string text = "recording,table,state," + columns + ",why\n";
  for (const Outcome& outcome : outcomes) {
    const bool is_done = outcome.state == State::done;
    const std::string table = is_done ? outcome.recording.name + ".h5" : "";
    const std::string begin = quoted_field(outcome.recording.file) + "," + quoted_field(table) +
                              "," + names.at(static_cast<std::size_t>(outcome.state)) + ",";
    const std::string lines = is_done ? outcome.lines : std::string(values, ',') + "\n";
    for (std::string_view rest = lines; !rest.empty();) {
      text.append(begin).append(take_until(rest, '\n')).append(",");
      text.append(quoted_field(outcome.why)).append("\n");
    }
  }
  return text;
}

std::vector<Outcome> merge_folder(const Folder& folder) {
  std::vector<Outcome> outcomes;
  for (const Recording& recording : folder.recordings()) {
    outcomes.push_back(merge_slices(folder, recording));
  }
  write_file(folder.summary_file(), summary_text(outcomes));
  return outcomes;
}

}  // namespace splid::batch
