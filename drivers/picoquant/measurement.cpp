#include "drivers/picoquant/measurement.hpp"

#include <algorithm>
#include <thread>
#include <utility>

#include "drivers/picoquant/source.hpp"
#include "drivers/tag_writer.hpp"

namespace splid::picoquant {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

// 256 KiB, which stay in the second-level cache from the decoder to the socket.
constexpr std::size_t block_tags = 16'384;

// Where fewer records came than this, the next are waited for: 4 M/s at most are read so often.
constexpr std::size_t few_bytes = 4096 * ptu_record_bytes;
constexpr milliseconds between_reads{1};
constexpr milliseconds between_looks{1000};
constexpr milliseconds between_events{1000};

constexpr const char* silent_words = "it sends nothing, not even the wraps of its clock";

}  // namespace

Measurement::Measurement(Device& device, const FamilyTraits& traits, TagSink& sink,
                         const Report& report)
    : device_(device), traits_(traits), sink_(sink), report_(report) {}

void Measurement::run(const std::stop_token& stop) {
  begin();
  report(DeviceState::connected, "");
  try {
    while (!stop.stop_requested()) step();
  } catch (const LibraryError&) {
    if (has_time_) put_clock_end(latest_ps_, sink_);
    throw;
  }
}

void Measurement::begin() {
  device_.start();
  decoder_.emplace(traits_.record_type, device_.resolution_s());
  latest_ps_ = 0;
  has_time_ = false;
  flags_ = 0;
  went_on_ = steady_clock::now();
  next_look_ = went_on_ + between_looks;
}

void Measurement::begin_anew(const std::string& why) {
  if (has_time_) put_clock_end(latest_ps_, sink_);
  tell(why);
  device_.stop();
  begin();
}

void Measurement::step() {
  const std::span<const std::byte> records = device_.read();
  // Asked after the records: what was read while the FIFO ran full may lack some, or their wraps.
  if (const Flag* full = look_at_flags()) {
    begin_anew(full->words);
  } else if (records.empty() && device_.has_ended()) {
    begin_anew("its longest measurement is over");
  } else if (!decode(records)) {
    begin_anew("it sent data that are not T2 records");
  } else {
    watch(!records.empty());
    if (records.size() < few_bytes) std::this_thread::sleep_for(between_reads);
  }
}

// The flag of a FIFO that was full; null where it was not.
const Flag* Measurement::look_at_flags() {
  const int flags = device_.flags();
  const int risen = flags & ~flags_;
  const bool is_new = flags != flags_;
  flags_ = flags;
  std::string words;
  for (const Flag& flag : traits_.flags) {
    if ((flags & flag.bits) == 0) continue;
    if (flag.meaning == Flag::Meaning::fifo_full) return &flag;
    if (flag.meaning == Flag::Meaning::counts_dropped && (risen & flag.bits) != 0) {
      drops_counts_ = true;
    }
    words.append(words.empty() ? "" : "; ").append(flag.words);
  }
  if (is_new && words != flag_words_) {
    flag_words_ = words;
    report(DeviceState::connected, "");
  }
  return nullptr;
}

// False where the records are none; those before are decoded.
bool Measurement::decode(std::span<const std::byte> records) {
  TagWriter out(sink_);
  const bool lost = std::exchange(drops_counts_, false) && has_time_;
  if (lost) {
    out.put({latest_ps_, 0, TagKind::loss_begin, {}});
    out.publish();
  }
  const std::uint64_t unknown = decoder_->unknown_records();
  while (!records.empty()) {
    const std::span<Tag> room = sink_.claim(block_tags);
    if (room.empty()) return true;  // a stop was requested
    const auto done = decoder_->decode(records, room);
    if (decoder_->unknown_records() != unknown) return false;
    has_time_ = true;
    records = records.subspan(done.bytes);
    number(room.first(done.tags));
    sink_.publish(done.tags);
  }
  // The latest tag tells the time, but where wraps of the clock came after it.
  if (decoder_->reached_ps() > latest_ps_) {
    latest_ps_ = decoder_->reached_ps();
    out.put(heartbeat_tag(latest_ps_));
  }
  if (lost) out.put({latest_ps_, -1, TagKind::loss_end, {}});
  out.publish();
  return true;
}

// Inputs get the numbers of the panel, which counts from 1 where the records count from 0. A
// PicoHarp's records have the sync as their input 0.
void Measurement::number(std::span<Tag> tags) {
  std::int64_t latest_ps = latest_ps_;
  if (traits_.record_type == RecordType::pico_harp) {
    for (Tag& tag : tags) {
      latest_ps = std::max(latest_ps, tag.time_ps);
      if (tag.kind == TagKind::photon && tag.value == 0) tag.kind = TagKind::sync;
    }
  } else {
    for (Tag& tag : tags) {
      latest_ps = std::max(latest_ps, tag.time_ps);
      tag.value += tag.kind == TagKind::photon ? 1 : 0;
    }
  }
  latest_ps_ = latest_ps;
}

void Measurement::watch(bool went_on) {
  const Time now = steady_clock::now();
  if (went_on) {
    if (now - went_on_ > Source::silence_told) report(DeviceState::connected, "");
    went_on_ = now;
  } else {
    sink_.publish(0);
    const auto silent = now - went_on_;
    if (silent > Source::silence_ended) throw LibraryError(silent_words);
    if (silent > Source::silence_told) report(DeviceState::failing, silent_words);
  }
  if (now < next_look_) return;
  next_look_ = now + between_looks;
  std::string warnings = device_.warnings();
  if (warnings == warnings_) return;
  warnings_ = std::move(warnings);
  report(DeviceState::connected, "");
}

void Measurement::report(DeviceState state, const std::string& reason) {
  const std::string& name = device_.name();
  std::string caution = flag_words_;
  if (!warnings_.empty()) caution.append(caution.empty() ? "" : "; ").append(warnings_);
  report_({state, reason.empty() ? "" : name + ": " + reason, name,
           caution.empty() ? "" : name + ": " + caution});
}

// Of what happens again and again, one event a second is told. The losses are all in the stream.
void Measurement::tell(const std::string& event) {
  const Time now = steady_clock::now();
  if (now < next_event_) return;
  next_event_ = now + between_events;
  report(DeviceState::connected, event + "; its clock begins anew");
}

}  // namespace splid::picoquant
