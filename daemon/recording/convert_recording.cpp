#include "daemon/recording/convert_recording.hpp"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <span>
#include <system_error>
#include <vector>

#include "daemon/base/progress.hpp"
#include "daemon/base/text.hpp"
#include "daemon/base/write_file.hpp"
#include "daemon/recording/ptu_writer.hpp"
#include "daemon/stream/device_clock.hpp"
#include "drivers/replay/loss_list.hpp"
#include "drivers/replay/recording_reader.hpp"
#include "protocol/error.hpp"
#include "protocol/ptu_t3_encode.hpp"

namespace splid {
namespace {

constexpr std::size_t converted_at_once = 65'536;

void warn_of(const std::string& text) { spdlog::warn("{}", text); }

PtuFacts kept_facts(const RecordingHeader& header) {
  PtuFacts facts;
  facts.created_unix_s = header.created_unix_s.value_or(0);
  facts.origin_ps = header.origin_ps;
  facts.instrument = header.text("HW_Type").value_or("unknown");
  facts.release = SPLID_VERSION;
  facts.comment = header.text("File_Comment").value_or("");
  facts.least_input = 0;
  facts.pattern_json = header.pattern_json;
  facts.config_json = header.config_json;
  facts.encoder_file = header.text("Splid_Encoder").value_or("");
  return facts;
}

// Says how far a conversion has come, and whether it has been stopped.
class Steps {
 public:
  Steps(const std::string& file, const Clock& clock, const std::stop_token& stop)
      : progress_(clock), stop_(stop) {
    std::error_code unknown;
    bytes_ = std::filesystem::file_size(file, unknown);
    if (unknown) bytes_ = 0;
  }

  // False once a stop was requested.
  bool go_on(const RecordingReader& reader) {
    if (progress_.due()) {
      const std::uint64_t read = reader.records() * reader.decoder().record_bytes();
      const double share =
          bytes_ == 0 ? 0 : static_cast<double>(read) / static_cast<double>(bytes_);
      progress_.show(fmt::format("{} records converted, {:.0f} %", grouped(reader.records()),
                                 100 * std::min(share, 1.0)));
    }
    return !stop_.stop_requested();
  }

 private:
  Progress progress_;
  const std::stop_token& stop_;
  std::uint64_t bytes_ = 0;
};

// A file that is removed again unless it is kept.
class PartFile {
 public:
  explicit PartFile(const std::string& output) : output_(output), part_(output + ".part") {}
  ~PartFile() {
    if (!kept_) std::remove(part_.c_str());
  }
  PartFile(const PartFile&) = delete;
  PartFile& operator=(const PartFile&) = delete;

  [[nodiscard]] const std::string& name() const { return part_; }

  void keep() {
    std::error_code failure;
    std::filesystem::rename(part_, output_, failure);
    if (failure) {
      throw Error(Fault::device,
                  part_ + ": cannot be renamed to " + output_ + ": " + failure.message());
    }
    kept_ = true;
  }

 private:
  std::string output_;
  std::string part_;
  bool kept_ = false;
};

// False where it was stopped.
bool convert_t2(RecordingReader& reader, const std::string& part, Steps& steps, const Clock& clock,
                ConvertSummary& summary) {
  const RecordingHeader& header = reader.header();
  SourceInfo info;
  info.start_unix_s =
      header.created_unix_s.value_or(0) - static_cast<double>(header.origin_ps) * 1e-12;
  PtuWriter writer(part, kept_facts(header), DeviceClock(info, clock), true);
  LossList losses(header.losses);
  std::vector<Tag> block(converted_at_once);
  std::vector<Tag> merged;
  while (const std::size_t count = reader.read(block)) {
    merged.clear();
    for (const Tag& tag : std::span(block).first(count)) {
      for (; losses.next() != nullptr && losses.next()->time_ps <= tag.time_ps; losses.take()) {
        merged.push_back(*losses.next());
      }
      merged.push_back(tag);
    }
    writer.write(merged);
    if (!steps.go_on(reader)) return false;
  }
  for (; losses.next() != nullptr; losses.take()) writer.write(std::span(losses.next(), 1));
  writer.close();
  summary.records = writer.records();
  summary.lost_tags = writer.lost_tags();
  return true;
}

void write_or_fail(std::ofstream& out, const std::string& file, std::span<const std::byte> bytes) {
  out.write(reinterpret_cast<const char*>(bytes.data()),
            static_cast<std::streamsize>(bytes.size()));
  if (!out) {
    throw Error(Fault::device, file + ": cannot be written; is the disk full?");
  }
}

// False where it was stopped. period_ps: by which the reader makes the syncs' times.
bool convert_t3(RecordingReader& reader, std::int64_t period_ps, const std::string& part,
                Steps& steps, ConvertSummary& summary) {
  const RecordingHeader& header = reader.header();
  PtuFacts facts = kept_facts(header);
  facts.t3 = PtuT3Facts{header.sync_period_s, header.resolution_s,
                        header.integer("HWSync_Divider").value_or(1)};
  facts.sync_rate_hz = std::llround(1 / header.sync_period_s);
  facts.losses = header.losses;
  std::ofstream out(part, std::ios::binary | std::ios::trunc);
  write_or_fail(out, part, make_ptu_header(facts));
  PtuT3Encoder encoder(period_ps, header.resolution_s * 1e12);
  std::vector<Tag> block(converted_at_once);
  std::vector<std::byte> records;
  while (const std::size_t count = reader.read(block)) {
    records.clear();
    encoder.encode(std::span(block).first(count), records);
    write_or_fail(out, part, records);
    if (!steps.go_on(reader)) return false;
  }
  facts.record_count = encoder.records();
  facts.acquisition_ms = reader.decoder().reached_ps() / 1'000'000'000;
  const std::vector<Loss> more = encoder.losses().losses(reader.decoder().reached_ps());
  facts.losses.insert(facts.losses.end(), more.begin(), more.end());
  std::sort(facts.losses.begin(), facts.losses.end(),
            [](const Loss& a, const Loss& b) { return a.begin_ps < b.begin_ps; });
  out.seekp(0);
  write_or_fail(out, part, make_ptu_header(facts));
  out.close();
  if (!out) throw Error(Fault::device, part + ": cannot be written; is the disk full?");
  summary.records = encoder.records();
  summary.lost_tags = encoder.losses().lost_tags();
  return true;
}

}  // namespace

ConvertSummary convert_recording(const std::string& recording, const std::string& output,
                                 bool overwrite, const Clock& clock, const std::stop_token& stop) {
  check_may_write(output, overwrite);
  ConvertSummary summary;
  PartFile part(output);
  Steps steps(recording, clock, stop);
  const RecordingHeader header = RecordingReader(recording, [](const std::string&) {}).header();
  summary.is_t3 = header.is_t3;
  // A whole number, so that a sync's number comes back from its time.
  const std::int64_t period_ps =
      std::max<std::int64_t>(std::llround(header.sync_period_s * 1e12), 1);
  RecordingReader reader(recording, warn_of, header.is_t3 ? static_cast<double>(period_ps) : 0);
  const bool is_whole = header.is_t3 ? convert_t3(reader, period_ps, part.name(), steps, summary)
                                     : convert_t2(reader, part.name(), steps, clock, summary);
  summary.stopped = !is_whole;
  if (is_whole) part.keep();
  return summary;
}

}  // namespace splid
