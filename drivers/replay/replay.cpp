#include "drivers/replay/replay.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>

#include "protocol/error.hpp"

namespace splid {
namespace {

// How many tags are read at a time: 1 MiB.
constexpr std::size_t claim_tags = 65'536;

// The real time that a paced replay hands on at once.
constexpr double slice_s = 5e-3;

// The recorded time of a slice. At a slow pace it is at least a microsecond, within which streams
// may be unsorted; at a fast pace it is at most 1000 s.
std::int64_t slice_ps(double speed) {
  return static_cast<std::int64_t>(std::clamp(slice_s * speed * 1e12, 1e6, 1e15));
}

double period_of(const Pattern& pattern) {
  return pattern.calibrated_period_ps.value_or(pattern_period_ps(pattern));
}

const bool replay_registered = register_source("replay", std::make_unique<ReplayOptions>);

}  // namespace

void ReplayOptions::describe(OptionVisitor& visitor) {
  visitor.path(
      "recording", recording,
      "the recording to play: PTU in T2 or T3 mode, .pt2, .pt3, .ht2, .ht3, .qutag or .spc");
  visitor.require("recording");
  visitor.number("speed", speed, {0, 1e9},
                 "1: at the recorded pace; N: that many times as fast; 0: as fast as possible");
}

std::optional<OptionFault> ReplayOptions::start_fault() const {
  try {
    const RecordingReader reader(recording, [](const std::string&) {});
    return std::nullopt;
  } catch (const Error& error) {
    return OptionFault{"/recording", error.what()};
  }
}

std::unique_ptr<TagSource> ReplayOptions::open(const SourceContext& context) const {
  return std::make_unique<ReplaySource>(*this, context);
}

ReplaySource::ReplaySource(const ReplayOptions& options, const SourceContext& context)
    : speed_(options.speed),
      reader_(options.recording, context.warn, period_of(*context.pattern)),
      losses_(reader_.header().losses),
      block_(claim_tags),
      reached_ps_(reader_.header().origin_ps) {}

SourceInfo ReplaySource::info() const {
  const RecordingHeader& header = reader_.header();
  SourceInfo info;
  info.name = "replay of " + header.text("HW_Type").value_or("a recording");
  if (header.created_unix_s) {
    info.start_unix_s = *header.created_unix_s - static_cast<double>(header.origin_ps) * 1e-12;
  }
  info.syncs_are_counted = header.is_t3;
  info.scan = scan_of(header);
  return info;
}

void ReplaySource::run(TagSink& sink, std::stop_token stop) {
  const bool direct = speed_ <= 0 && losses_.next() == nullptr;
  if (direct ? run_directly(sink, stop) : run_in_slices(sink, stop)) end(sink);
}

// Decodes records straight into the sink's room. False once a stop was requested, as of the
// functions below.
bool ReplaySource::run_directly(TagSink& sink, const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    const std::span<Tag> room = sink.claim(claim_tags);
    if (room.empty()) return false;
    const std::size_t tags = reader_.read(room);
    if (tags > 0) reached_ps_ = std::max(reached_ps_, room[tags - 1].time_ps);
    sink.publish(tags);
    if (tags == 0) return true;
  }
  return false;
}

bool ReplaySource::run_in_slices(TagSink& sink, const std::stop_token& stop) {
  TagWriter out(sink);
  for (;;) {
    const std::span<const Tag> tags = std::span(block_).first(reader_.read(block_));
    if (tags.empty()) break;
    for (const Tag& tag : tags) {
      if (!put_before(tag.time_ps, out, stop) || !put(tag, out, stop)) return false;
    }
    if (speed_ <= 0) out.publish();
  }
  if (!put_before(std::numeric_limits<std::int64_t>::max(), out, stop)) return false;
  out.publish();
  return !stop.stop_requested();
}

// Writes the losses that come before an event at time_ps, or at the same time.
bool ReplaySource::put_before(std::int64_t time_ps, TagWriter& out, const std::stop_token& stop) {
  while (const Tag* loss = losses_.next()) {
    if (loss->time_ps > time_ps) break;
    if (!put(*loss, out, stop)) return false;
    losses_.take();
  }
  return true;
}

bool ReplaySource::put(const Tag& tag, TagWriter& out, const std::stop_token& stop) {
  if (tag.time_ps >= slice_end_ps_ && !await(tag.time_ps, out, stop)) return false;
  reached_ps_ = std::max(reached_ps_, tag.time_ps);
  return out.put(tag);
}

// Waits until the slice that time_ps is in has passed. A slice is handed on at its end, as a live
// stream would be.
bool ReplaySource::await(std::int64_t time_ps, TagWriter& out, const std::stop_token& stop) {
  out.publish();
  if (speed_ <= 0) {
    slice_end_ps_ = std::numeric_limits<std::int64_t>::max();
    return !stop.stop_requested();
  }
  if (!started_) {
    started_ = true;
    pace_ = Pace(speed_);
    first_ps_ = time_ps;
  }
  // Unsigned, since the times of a damaged recording may be anything.
  const auto length_ps = static_cast<std::uint64_t>(slice_ps(speed_));
  const auto first_ps = static_cast<std::uint64_t>(first_ps_);
  const std::uint64_t begun_ps = static_cast<std::uint64_t>(time_ps) - first_ps;
  const std::uint64_t since_ps = (begun_ps / length_ps + 1) * length_ps;
  slice_end_ps_ = static_cast<std::int64_t>(first_ps + since_ps);
  return pace_.wait_until(static_cast<std::int64_t>(since_ps), stop);
}

void ReplaySource::end(TagSink& sink) {
  TagWriter out(sink);
  out.put(heartbeat_tag(std::max(reached_ps_, reader_.decoder().reached_ps())));
  out.publish();
}

}  // namespace splid
