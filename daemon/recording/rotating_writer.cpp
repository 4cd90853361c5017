#include "daemon/recording/rotating_writer.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <utility>
#include <vector>

#include "daemon/base/text.hpp"
#include "daemon/recording/recording_facts.hpp"
#include "protocol/error.hpp"
#include "protocol/saturated.hpp"

namespace splid {
namespace {

constexpr double bytes_per_mib = 1024.0 * 1024;
constexpr double ps_per_s = 1e12;
constexpr std::int64_t retry_interval_ns = 5'000'000'000;

// Design note: a file that finds less room than the recorder writes at once would hold little more
// than its header, and there would be one every 5 s.
constexpr std::uint64_t least_free_bytes = 4 << 20;

// A file passes its limit by the tags taken at once, 256 KiB.
constexpr double file_excess_mib = 1;

std::uint64_t bytes_of(double mib) { return static_cast<std::uint64_t>(mib * bytes_per_mib); }

}  // namespace

RotatingWriter::RotatingWriter(const Config& config, SourceInfo source, const Clock& clock,
                               OpenCounts open_counts, std::function<void(const std::string&)> say)
    : config_(config),
      source_(std::move(source)),
      clock_(clock),
      open_counts_(std::move(open_counts)),
      say_(std::move(say)),
      folder_(config.record.folder, bytes_of(config.record.max_folder_gib * 1024)),
      channels_(config.channels) {}

void RotatingWriter::take(std::span<const Tag> tags) {
  while (!tags.empty()) {
    const std::size_t count = until_cut(tags);
    store(tags.first(count));
    follow_losses(tags.first(count));
    tags = tags.subspan(count);
    if (tags.empty()) break;
    end_file();
    if (tags.front().kind != TagKind::clock_break) continue;
    // What the tagger saw between its two clocks nobody knows.
    gap_.unknown = true;
    loss_is_open_ = false;
    tags = tags.subspan(1);
  }
  if (recorder_ && recorder_->bytes() >= bytes_of(config_.record.max_file_mib)) end_file();
}

void RotatingWriter::flush() {
  if (!recorder_) return;
  try {
    recorder_->flush();
    if (!counts_) return;
    counts_->write({});
    counts_->flush();
  } catch (const Error& error) {
    fail(error.what());
  }
}

void RotatingWriter::close() {
  end_file();
  if (gap_.count == 0) return;
  say_(grouped(gap_.count) + " tags are in no recording");
}

// How many of the tags go to the file that is being written, or that the first of them begins: that
// one is then in it, wherever the clock's range ends.
std::size_t RotatingWriter::until_cut(std::span<const Tag> tags) const {
  const std::int64_t end_ps = recorder_ ? end_ps_ : end_of_file(tags.front().time_ps);
  const bool begins = !recorder_ && tags.front().kind != TagKind::clock_break;
  const auto cut =
      std::find_if(tags.begin() + (begins ? 1 : 0), tags.end(), [end_ps](const Tag& tag) {
        return tag.kind == TagKind::clock_break || tag.time_ps >= end_ps;
      });
  return static_cast<std::size_t>(cut - tags.begin());
}

std::int64_t RotatingWriter::end_of_file(std::int64_t first_ps) const {
  return saturated_sum(first_ps, static_cast<std::int64_t>(config_.record.max_file_s * ps_per_s));
}

void RotatingWriter::follow_losses(std::span<const Tag> tags) {
  for (const Tag& tag : tags) {
    if (tag.kind == TagKind::loss_begin) loss_is_open_ = true;
    if (tag.kind == TagKind::loss_end) loss_is_open_ = false;
  }
}

void RotatingWriter::store(std::span<const Tag> tags) {
  if (tags.empty()) return;
  if (!recorder_ && !begin_file(tags.front().time_ps)) {
    lose(tags);
    return;
  }
  try {
    recorder_->write(tags);
  } catch (const Error& error) {
    fail(error.what());
  }
}

bool RotatingWriter::begin_file(std::int64_t first_ps) {
  if (!fault_.empty()) {
    if (clock_.steady_ns() < retry_ns_) return false;
    retry_ns_ = clock_.steady_ns() + retry_interval_ns;
    if (folder_.free_bytes() < least_free_bytes) return false;
  }
  try {
    open_file(first_ps);
    write_gap(first_ps);
  } catch (const Error& error) {
    fail(error.what());
    return false;
  }
  if (!fault_.empty()) say_("recording again, into " + file_);
  fault_.clear();
  return true;
}

void RotatingWriter::open_file(std::int64_t first_ps) {
  DeviceClock clock(source_, clock_);
  clock.anchor(first_ps);
  file_ =
      folder_.next(clock.unix_s(first_ps), bytes_of(config_.record.max_file_mib + file_excess_mib));
  std::unique_ptr<EncoderSource> counts = open_counts_();
  recorder_.emplace(file_, recording_facts(config_, source_, counts ? encoder_file_of(file_) : ""),
                    clock, false);
  if (counts) counts_.emplace(file_, std::move(counts), channels_);
  end_ps_ = end_of_file(first_ps);
  ++files_;
}

void RotatingWriter::write_gap(std::int64_t first_ps) {
  constexpr std::uint64_t most = std::numeric_limits<std::int32_t>::max();
  std::vector<Tag> tags;
  for (std::uint64_t left = gap_.count; left > 0; left -= std::min(left, most)) {
    const auto count = static_cast<std::int32_t>(std::min(left, most));
    tags.push_back({first_ps, count, TagKind::missed, {}});
  }
  if (gap_.unknown) tags.push_back({first_ps, -1, TagKind::missed, {}});
  if (loss_is_open_) tags.push_back({first_ps, 0, TagKind::loss_begin, {}});
  recorder_->write(tags);
  gap_ = {};
}

void RotatingWriter::end_file() {
  if (!recorder_) return;
  try {
    flush();
    if (!recorder_) return;
    recorder_->close();
    recorder_.reset();
    counts_.reset();
  } catch (const Error& error) {
    fail(error.what());
  }
}

void RotatingWriter::fail(const std::string& why) {
  if (recorder_) {
    lose(recorder_->give_up());
    if (recorder_->written_records() == 0) remove_file();
    recorder_.reset();
    counts_.reset();
  }
  retry_ns_ = clock_.steady_ns() + retry_interval_ns;
  if (fault_.empty()) say_("nothing is recorded: " + why);
  fault_ = "nothing is recorded: " + why;
}

// Nothing came into it; what its header says of losses goes to the next one.
void RotatingWriter::remove_file() {
  for (const Loss& loss : recorder_->losses()) {
    gap_.unknown = gap_.unknown || loss.count < 0;
    gap_.count += static_cast<std::uint64_t>(std::max<std::int64_t>(loss.count, 0));
  }
  std::remove(file_.c_str());
  std::remove(encoder_file_of(file_).c_str());
  file_.clear();
  --files_;
}

void RotatingWriter::lose(std::span<const Tag> tags) {
  std::uint64_t events = 0;
  for (const Tag& tag : tags) {
    events += is_event(tag.kind) ? 1 : 0;
    if (tag.kind != TagKind::missed && tag.kind != TagKind::loss_end) continue;
    // The stream's own losses have no file to stand in.
    gap_.unknown = gap_.unknown || tag.value < 0;
    gap_.count += static_cast<std::uint64_t>(std::max(tag.value, 0));
  }
  lose(events);
}

void RotatingWriter::lose(std::uint64_t count) {
  gap_.count += count;
  lost_tags_ += count;
}

}  // namespace splid
