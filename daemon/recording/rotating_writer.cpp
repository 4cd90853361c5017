#include "daemon/recording/rotating_writer.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <utility>
#include <vector>

#include "daemon/base/text.hpp"
#include "protocol/error.hpp"
#include "protocol/saturated.hpp"

namespace splid::recording {
namespace {

constexpr double bytes_per_mib = 1024.0 * 1024;
constexpr double ps_per_s = 1e12;
constexpr std::int64_t retry_interval_ns = 5'000'000'000;

// Design note: the writer writes up to 1 MiB at once. A file begun with hardly that much room
// would hold little more than its header, and every 5 s another such file would appear.
constexpr std::uint64_t least_free_bytes = 4 << 20;

// A file may pass its size limit by the tags of one take(): 65,536 records of 4 bytes are 256 KiB.
constexpr double file_excess_mib = 1;

std::string name_of(const std::string& path) { return path.substr(path.rfind('/') + 1); }

std::uint64_t bytes_of(double mib) { return static_cast<std::uint64_t>(mib * bytes_per_mib); }

}  // namespace

RotatingWriter::RotatingWriter(Plan plan, const Clock& clock, OpenCounts open_counts,
                               std::function<void(const std::string&)> say)
    : plan_(std::move(plan)),
      clock_(clock),
      open_counts_(std::move(open_counts)),
      say_(std::move(say)),
      folder_(plan_.options.folder, bytes_of(plan_.options.max_folder_gib * 1024)),
      channels_(plan_.channels) {}

void RotatingWriter::take(std::span<const Tag> tags) { record(stray_times_.sort_out(tags)); }

void RotatingWriter::record(std::span<const Tag> tags) {
  while (!tags.empty()) {
    const std::size_t count = until_cut(tags);
    store(tags.first(count));
    follow_losses(tags.first(count));
    tags = tags.subspan(count);
    if (tags.empty()) break;
    end_file();
    if (tags.front().kind != TagKind::clock_break) continue;
    // Nobody knows how many tags the tagger saw while its clock was being set.
    gap_.unknown = true;
    loss_is_open_ = false;
    tags = tags.subspan(1);
  }
  if (writer_ && writer_->bytes() >= bytes_of(plan_.options.max_file_mib)) end_file();
}

double RotatingWriter::file_seconds() const {
  return (static_cast<double>(last_ps_) - static_cast<double>(first_ps_)) / ps_per_s;
}

void RotatingWriter::flush() {
  if (!writer_) return;
  try {
    writer_->flush();
    if (!counts_) return;
    counts_->write({});
    counts_->flush();
  } catch (const Error& error) {
    fail(error.what());
  }
}

void RotatingWriter::close() {
  record(stray_times_.finish());
  end_file();
  if (gap_.count == 0) return;
  say_(grouped(gap_.count) + " tags are in no recording");
}

// How many of the tags go into the current file. Where no file is open, the first tag begins a file
// and goes into it in any case, even at the very end of the range of times.
std::size_t RotatingWriter::until_cut(std::span<const Tag> tags) const {
  const std::int64_t end_ps = writer_ ? end_ps_ : end_of_file(tags.front().time_ps);
  const bool begins = !writer_ && tags.front().kind != TagKind::clock_break;
  const auto cut =
      std::find_if(tags.begin() + (begins ? 1 : 0), tags.end(), [end_ps](const Tag& tag) {
        return tag.kind == TagKind::clock_break || tag.time_ps >= end_ps;
      });
  return static_cast<std::size_t>(cut - tags.begin());
}

std::int64_t RotatingWriter::end_of_file(std::int64_t first_ps) const {
  return saturated_sum(first_ps, static_cast<std::int64_t>(plan_.options.max_file_s * ps_per_s));
}

void RotatingWriter::follow_losses(std::span<const Tag> tags) {
  for (const Tag& tag : tags) {
    if (tag.kind == TagKind::loss_begin) loss_is_open_ = true;
    if (tag.kind == TagKind::loss_end) loss_is_open_ = false;
  }
}

void RotatingWriter::store(std::span<const Tag> tags) {
  if (tags.empty()) return;
  if (!writer_ && !begin_file(tags.front().time_ps)) {
    lose(tags);
    return;
  }
  try {
    writer_->write(tags);
    file_bytes_ = writer_->bytes();
    last_ps_ = tags.back().time_ps;
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
  DeviceClock clock(plan_.source, clock_);
  clock.anchor(first_ps);
  file_ =
      folder_.next(clock.unix_s(first_ps), bytes_of(plan_.options.max_file_mib + file_excess_mib));
  std::unique_ptr<EncoderSource> counts = open_counts_();
  PtuFacts facts = plan_.facts;
  if (counts) facts.encoder_file = name_of(encoder_file_of(file_));
  writer_.emplace(file_, std::move(facts), clock, false);
  ++files_;
  if (counts) counts_.emplace(file_, std::move(counts), channels_);
  file_bytes_ = writer_->bytes();
  first_ps_ = first_ps;
  last_ps_ = first_ps;
  end_ps_ = end_of_file(first_ps);
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
  writer_->write(tags);
  gap_ = {};
}

void RotatingWriter::end_file() {
  if (!writer_) return;
  try {
    flush();
    if (!writer_) return;
    writer_->close();
    file_bytes_ = writer_->bytes();
    rejected_ += writer_->rejected();
    writer_.reset();
    counts_.reset();
  } catch (const Error& error) {
    fail(error.what());
  }
}

void RotatingWriter::fail(const std::string& why) {
  if (writer_) {
    const bool is_gone = writer_->removed();
    lose(writer_->give_up());
    rejected_ += writer_->rejected();
    if (is_gone || writer_->written_records() == 0) remove_file();
    writer_.reset();
    counts_.reset();
  }
  retry_ns_ = clock_.steady_ns() + retry_interval_ns;
  if (fault_.empty()) say_("nothing is recorded: " + why);
  fault_ = "nothing is recorded: " + why;
}

// Removes a file that no tag came into; the losses in its header go to the next file.
void RotatingWriter::remove_file() {
  for (const Loss& loss : writer_->losses()) {
    gap_.unknown = gap_.unknown || loss.count < 0;
    gap_.count += static_cast<std::uint64_t>(std::max<std::int64_t>(loss.count, 0));
  }
  std::remove(file_.c_str());
  std::remove(encoder_file_of(file_).c_str());
  file_.clear();
  file_bytes_ = 0;
  first_ps_ = last_ps_ = 0;
  --files_;
}

void RotatingWriter::lose(std::span<const Tag> tags) {
  std::uint64_t events = 0;
  for (const Tag& tag : tags) {
    events += is_event(tag.kind) ? 1 : 0;
    if (tag.kind != TagKind::missed && tag.kind != TagKind::loss_end) continue;
    // No file is open that could hold the losses that the stream itself reports.
    gap_.unknown = gap_.unknown || tag.value < 0;
    gap_.count += static_cast<std::uint64_t>(std::max(tag.value, 0));
  }
  lose(events);
}

void RotatingWriter::lose(std::uint64_t count) {
  gap_.count += count;
  lost_tags_ += count;
}

}  // namespace splid::recording
