#include "protocol/ptu_encode.hpp"

#include <algorithm>
#include <iterator>
#include <optional>

#include "protocol/saturated.hpp"

namespace splid {
namespace {

constexpr std::int64_t wrap_ps = 1 << 25;
// The largest overflow count. Design note: the format has 25 bits for the count, but readers in
// wide use keep it in 7.
constexpr std::int64_t max_wraps_a_record = 127;
constexpr std::uint32_t special = 1U << 31U;
constexpr std::uint32_t overflow_record = special | (63U << 25U);

constexpr std::int64_t clock_break_gap_ps = 1'000'000'000'000;  // 1 s

// Design note: 1 us of the fastest tagger's bursts (90 M tags/s) holds 90 tags. A burst past this
// is written early instead of growing the buffer.
constexpr std::size_t max_waiting = 4096;

}  // namespace

std::uint64_t ptu_tags(std::span<const std::byte> records) {
  // The last byte of a record, little endian, holds the special bit, the channel's six and one of
  // the time's.
  constexpr std::byte channel_bits{0xFE};
  std::uint64_t tags = 0;
  for (std::size_t at = 3; at < records.size(); at += 4) {
    tags += (records[at] & channel_bits) != channel_bits ? 1 : 0;
  }
  return tags;
}

PtuEncoder::PtuEncoder(std::int64_t origin_ps, const PtuInputs& inputs)
    : inputs_(inputs), now_ps_(origin_ps), written_ps_(origin_ps), base_ps_(origin_ps) {
  waiting_.reserve(2 * max_waiting);
}

void PtuEncoder::encode(std::span<const Tag> tags, std::vector<std::byte>& out) {
  for (const Tag& tag : tags) take(tag, out);
}

void PtuEncoder::flush(std::vector<std::byte>& out) { write_until(now_ps_, out); }

void PtuEncoder::take(Tag tag, std::vector<std::byte>& out) {
  if (tag.kind == TagKind::clock_break) {
    clock_broke_ = true;
    return;
  }
  const std::int64_t step_ps = saturated_difference(in_recording(tag.time_ps), now_ps_);
  if (clock_broke_ || step_ps > ptu_longest_step_ps) restart(tag.time_ps, out);
  tag.time_ps = in_recording(tag.time_ps);
  if (is_event(tag.kind)) {
    const std::optional<std::uint32_t> record = record_of(tag);
    if (!record || tag.time_ps < written_ps_) {
      reject(tag.time_ps);
    } else {
      insert({tag.time_ps, *record}, out);
    }
  } else {
    losses_.take(tag);
  }
  now_ps_ = std::max(now_ps_, tag.time_ps);
  write_until(saturated_difference(now_ps_, ptu_sorted_within_ps), out);
}

// The record of a tag, without its time; absent where no record can hold the tag.
std::optional<std::uint32_t> PtuEncoder::record_of(const Tag& tag) {
  if (tag.kind == TagKind::sync) return special;
  if (tag.kind == TagKind::photon) {
    const auto channel = inputs_.channel_of(tag.value);
    return channel ? std::optional(*channel << 25U) : std::nullopt;
  }
  if (tag.value < 1 || tag.value > 15) return std::nullopt;
  return special | (static_cast<std::uint32_t>(tag.value) << 25U);
}

std::int64_t PtuEncoder::in_recording(std::int64_t time_ps) const {
  return saturated_sum(saturated_difference(time_ps, clock_zero_ps_), recording_zero_ps_);
}

void PtuEncoder::restart(std::int64_t time_ps, std::vector<std::byte>& out) {
  flush(out);
  const std::int64_t from_ps = now_ps_;
  now_ps_ = saturated_sum(from_ps, clock_break_gap_ps);
  clock_zero_ps_ = time_ps;
  recording_zero_ps_ = now_ps_;
  // The first tags after the break may be unsorted too.
  written_ps_ = std::max(written_ps_, now_ps_ - ptu_sorted_within_ps);
  losses_.add({from_ps, now_ps_, -1});
  clock_broke_ = false;
}

void PtuEncoder::reject(std::int64_t time_ps) {
  ++rejected_;
  losses_.add_missed(time_ps, 1);
}

void PtuEncoder::insert(Waiting waiting, std::vector<std::byte>& out) {
  if (waiting_.size() - first_waiting_ == max_waiting) write(waiting_[first_waiting_++], out);
  if (first_waiting_ >= max_waiting) {
    waiting_.erase(waiting_.begin(),
                   waiting_.begin() + static_cast<std::ptrdiff_t>(first_waiting_));
    first_waiting_ = 0;
  }
  auto place = waiting_.end();
  const auto first = waiting_.begin() + static_cast<std::ptrdiff_t>(first_waiting_);
  while (place != first && std::prev(place)->time_ps > waiting.time_ps) --place;
  waiting_.insert(place, waiting);
}

void PtuEncoder::write_until(std::int64_t time_ps, std::vector<std::byte>& out) {
  while (first_waiting_ < waiting_.size() && waiting_[first_waiting_].time_ps <= time_ps) {
    write(waiting_[first_waiting_++], out);
  }
  if (first_waiting_ == waiting_.size()) {
    waiting_.clear();
    first_waiting_ = 0;
  }
}

void PtuEncoder::write(const Waiting& waiting, std::vector<std::byte>& out) {
  std::int64_t wraps = (waiting.time_ps - base_ps_) / wrap_ps;
  base_ps_ += wraps * wrap_ps;
  while (wraps > 0) {
    const std::int64_t count = std::min(wraps, max_wraps_a_record);
    append(overflow_record | static_cast<std::uint32_t>(count), out);
    wraps -= count;
  }
  append(waiting.record | static_cast<std::uint32_t>(waiting.time_ps - base_ps_), out);
  written_ps_ = waiting.time_ps;
  ++tags_;
}

void PtuEncoder::append(std::uint32_t record, std::vector<std::byte>& out) {
  for (unsigned shift = 0; shift < 32; shift += 8) {
    out.push_back(static_cast<std::byte>((record >> shift) & 0xFFU));
  }
  ++records_;
}

}  // namespace splid
