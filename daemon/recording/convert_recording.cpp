#include "daemon/recording/convert_recording.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <span>
#include <system_error>
#include <utility>
#include <vector>

#include "daemon/base/log.hpp"
#include "daemon/base/progress.hpp"
#include "daemon/base/text.hpp"
#include "daemon/base/write_file.hpp"
#include "daemon/recording/loss_words.hpp"
#include "daemon/recording/photon_hdf5_reader.hpp"
#include "daemon/recording/ptu_writer.hpp"
#include "daemon/stream/device_clock.hpp"
#include "drivers/replay/loss_list.hpp"
#include "drivers/replay/recording_reader.hpp"
#include "protocol/error.hpp"
#include "protocol/ptu_encode.hpp"
#include "protocol/ptu_t3_encode.hpp"
#include "protocol/saturated.hpp"

namespace splid::recording {
namespace {

constexpr std::size_t converted_at_once = 65'536;

void warn_of(const std::string& text) { log_warning(text); }

PtuFacts kept_facts(const RecordingHeader& header) {
  PtuFacts facts;
  facts.created_unix_s = header.created_unix_s.value_or(0);
  facts.origin_ps = header.origin_ps;
  facts.instrument = header.text("HW_Type").value_or("unknown");
  facts.release = SPLID_VERSION;
  facts.comment = header.text("File_Comment").value_or("");
  facts.sync_divider = header.integer("HWSync_Divider").value_or(1);
  facts.inputs = header.inputs;
  facts.scan = scan_of(header);
  facts.pattern_json = header.pattern_json;
  facts.config_json = header.config_json;
  facts.encoder_file = header.text("Splid_Encoder").value_or("");
  return facts;
}

// What is converted: where its tags come from, and how far they have.
class Original {
 public:
  Original() = default;
  Original(const Original&) = delete;
  Original& operator=(const Original&) = delete;
  virtual ~Original() = default;

  [[nodiscard]] virtual const RecordingHeader& header() const = 0;
  virtual std::size_t read(std::span<Tag> out) = 0;
  [[nodiscard]] virtual std::int64_t reached_ps() const = 0;
  [[nodiscard]] virtual std::uint64_t records() const = 0;
  // What records() becomes; 0: not known.
  [[nodiscard]] virtual double all_records() const = 0;
};

class RecordingFile final : public Original {
 public:
  RecordingFile(const std::string& file, double period_ps) : reader_(file, warn_of, period_ps) {
    std::error_code unknown;
    const std::uintmax_t bytes = std::filesystem::file_size(file, unknown);
    if (!unknown) bytes_ = static_cast<double>(bytes);
  }
  [[nodiscard]] const RecordingHeader& header() const override { return reader_.header(); }
  std::size_t read(std::span<Tag> out) override { return reader_.read(out); }
  [[nodiscard]] std::int64_t reached_ps() const override { return reader_.decoder().reached_ps(); }
  [[nodiscard]] std::uint64_t records() const override { return reader_.records(); }
  [[nodiscard]] double all_records() const override {
    return bytes_ / static_cast<double>(reader_.decoder().record_bytes());
  }

 private:
  RecordingReader reader_;
  double bytes_ = 0;
};

class PhotonHdf5 final : public Original {
 public:
  PhotonHdf5(const std::string& file, const std::stop_token& stop) : reader_(file, warn_of, stop) {}
  [[nodiscard]] const RecordingHeader& header() const override { return reader_.header(); }
  std::size_t read(std::span<Tag> out) override { return reader_.read(out); }
  [[nodiscard]] std::int64_t reached_ps() const override { return reader_.reached_ps(); }
  [[nodiscard]] std::uint64_t records() const override { return reader_.photons(); }
  [[nodiscard]] double all_records() const override {
    return static_cast<double>(reader_.header().record_count);
  }

 private:
  PhotonHdf5Reader reader_;
};

std::unique_ptr<Original> open_original(const std::string& file, const std::stop_token& stop) {
  require_seekable(file);
  if (begins_as_hdf5(file)) return std::make_unique<PhotonHdf5>(file, stop);
  const RecordingHeader header = RecordingReader(file, [](const std::string&) {}).header();
  const auto period_ps = static_cast<double>(whole_period_ps(header));
  return std::make_unique<RecordingFile>(file, header.is_t3 ? period_ps : 0);
}

// Fails where a PTU in T2 mode would not have a tag, or not at its time, since its records follow
// in the order of time. A replay of the original measures such tags.
class TimesInOrder {
 public:
  explicit TimesInOrder(std::string file) : file_(std::move(file)) {}

  void check(std::span<const Tag> tags) {
    for (const Tag& tag : tags) {
      ++tags_;
      const std::int64_t latest_ps = latest_ps_.value_or(tag.time_ps);
      const std::int64_t step_ps = saturated_difference(tag.time_ps, latest_ps);
      if (step_ps < -ptu_sorted_within_ps) {
        refuse(latest_ps, tag,
               "before a tag that precedes it: the tagger's clock was set or counted past its end, "
               "or the tag came late");
      }
      if (step_ps > ptu_longest_step_ps) {
        refuse(latest_ps, tag, "after all tags that precede it, which is more than a day");
      }
      latest_ps_ = std::max(latest_ps, tag.time_ps);
    }
  }

 private:
  [[noreturn]] void refuse(std::int64_t latest_ps, const Tag& tag, const std::string& how) const {
    const std::uint64_t far_ps = static_cast<std::uint64_t>(std::max(latest_ps, tag.time_ps)) -
                                 static_cast<std::uint64_t>(std::min(latest_ps, tag.time_ps));
    throw Error(Fault::data,
                fmt::format("{}: tag {}, at {} ps, is {} ps {}. A PTU holds tags in the order of "
                            "time, to 1 us; splid replay measures the recording itself",
                            file_, grouped(tags_), tag.time_ps, grouped(far_ps), how));
  }

  std::string file_;
  std::uint64_t tags_ = 0;
  std::optional<std::int64_t> latest_ps_;
};

// Says how far a conversion has come, and whether it has been stopped.
class Steps {
 public:
  Steps(const Clock& clock, const std::stop_token& stop) : progress_(clock), stop_(stop) {}

  // False once a stop was requested.
  bool go_on(const Original& original) {
    if (progress_.due()) {
      const double all = original.all_records();
      const double share = all > 0 ? static_cast<double>(original.records()) / all : 0;
      progress_.show(fmt::format("{} records converted, {:.0f} %", grouped(original.records()),
                                 100 * std::min(share, 1.0)));
    }
    return !stop_.stop_requested();
  }

 private:
  Progress progress_;
  const std::stop_token& stop_;
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
bool convert_t2(Original& original, TimesInOrder times, const std::string& part, Steps& steps,
                const Clock& clock, ConvertSummary& summary) {
  const RecordingHeader& header = original.header();
  SourceInfo info;
  info.start_unix_s =
      header.created_unix_s.value_or(0) - static_cast<double>(header.origin_ps) * 1e-12;
  PtuWriter writer(part, kept_facts(header), DeviceClock(info, clock), true);
  LossList losses(header.losses);
  std::vector<Tag> block(converted_at_once);
  std::vector<Tag> merged;
  while (const std::size_t count = original.read(block)) {
    times.check(std::span(block).first(count));
    merged.clear();
    for (const Tag& tag : std::span(block).first(count)) {
      for (; losses.next() != nullptr && losses.next()->time_ps <= tag.time_ps; losses.take()) {
        merged.push_back(*losses.next());
      }
      merged.push_back(tag);
    }
    writer.write(merged);
    if (!steps.go_on(original)) return false;
  }
  if (!steps.go_on(original)) return false;
  for (; losses.next() != nullptr; losses.take()) writer.write(std::span(losses.next(), 1));
  writer.close();
  summary.records = writer.records();
  summary.lost_tags = writer.lost_tags();
  summary.uncounted_losses = uncounted_losses(writer.losses());
  return true;
}

void write_or_fail(std::ofstream& out, const std::string& file, std::span<const std::byte> bytes) {
  out.write(reinterpret_cast<const char*>(bytes.data()),
            static_cast<std::streamsize>(bytes.size()));
  if (!out) {
    throw Error(Fault::device, file + ": cannot be written; is the disk full?");
  }
}

void refuse_what_t3_cannot_hold(const std::string& file, std::uint64_t tags) {
  if (tags == 0) return;
  throw Error(Fault::data, file + ": " + grouped(tags) +
                               " of its tags have a sync before that of an earlier tag, or an "
                               "input above 63, and a PTU in T3 mode cannot hold them; sort its "
                               "tags by time, or let splid replay measure the recording itself");
}

// False where it was stopped.
bool convert_t3(Original& original, const std::string& file, const std::string& part, Steps& steps,
                ConvertSummary& summary) {
  const RecordingHeader& header = original.header();
  PtuFacts facts = kept_facts(header);
  facts.t3 = PtuT3Facts{header.sync_period_s, header.resolution_s};
  facts.sync_rate_hz = std::llround(1 / header.sync_period_s);
  facts.losses = header.losses;
  std::ofstream out(part, std::ios::binary | std::ios::trunc);
  write_or_fail(out, part, make_ptu_header(facts));
  PtuT3Encoder encoder(whole_period_ps(header), header.resolution_s * 1e12);
  std::vector<Tag> block(converted_at_once);
  std::vector<std::byte> records;
  while (const std::size_t count = original.read(block)) {
    records.clear();
    encoder.encode(std::span(block).first(count), records);
    refuse_what_t3_cannot_hold(file, encoder.rejected());
    write_or_fail(out, part, records);
    if (!steps.go_on(original)) return false;
  }
  if (!steps.go_on(original)) return false;
  facts.record_count = encoder.records();
  facts.acquisition_ms = original.reached_ps() / 1'000'000'000;
  const std::vector<Loss> more = encoder.losses().losses(original.reached_ps());
  facts.losses.insert(facts.losses.end(), more.begin(), more.end());
  std::sort(facts.losses.begin(), facts.losses.end(),
            [](const Loss& a, const Loss& b) { return a.begin_ps < b.begin_ps; });
  out.seekp(0);
  write_or_fail(out, part, make_ptu_header(facts));
  out.close();
  if (!out) throw Error(Fault::device, part + ": cannot be written; is the disk full?");
  summary.records = encoder.records();
  summary.lost_tags = encoder.losses().lost_tags() + known_lost_tags(header.losses);
  summary.uncounted_losses = uncounted_losses(facts.losses);
  return true;
}

}  // namespace

ConvertSummary convert(const std::string& recording, const std::string& output, bool overwrite,
                       const Clock& clock, const std::stop_token& stop) {
  check_may_write(output, overwrite);
  ConvertSummary summary;
  PartFile part(output);
  Steps steps(clock, stop);
  const std::unique_ptr<Original> original = open_original(recording, stop);
  summary.is_t3 = original->header().is_t3;
  const bool is_whole =
      summary.is_t3
          ? convert_t3(*original, recording, part.name(), steps, summary)
          : convert_t2(*original, TimesInOrder(recording), part.name(), steps, clock, summary);
  summary.stopped = !is_whole;
  if (is_whole) part.keep();
  return summary;
}

}  // namespace splid::recording
