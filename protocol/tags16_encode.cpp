#include "protocol/tags16_encode.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "protocol/saturated.hpp"

namespace splid {
namespace {

constexpr std::size_t header_bytes = Tags16Decoder::header_bytes;
constexpr std::size_t record_bytes = Tags16Decoder::tag_bytes;
constexpr std::int64_t most_missed_a_record = 0xFFFF;

// A block that has no room for so many records is full. The count of a loss is told by several.
constexpr std::size_t most_records_a_tag = 64;
constexpr std::int64_t most_missed_a_block = (most_records_a_tag - 1) * most_missed_a_record;

template <class Number>
void store(Number value, std::byte* bytes) {
  if constexpr (std::endian::native == std::endian::little) {
    std::memcpy(bytes, &value, sizeof value);
  } else {
    for (std::size_t i = 0; i < sizeof value; ++i) {
      bytes[i] = static_cast<std::byte>(static_cast<std::uint64_t>(value) >> (8 * i));
    }
  }
}

void store_record(std::uint64_t head, std::int64_t time_ps, std::byte* bytes) {
  store(head, bytes);
  store(time_ps, bytes + sizeof head);
}

// By kind: photon, sync, marker.
constexpr std::array<std::uint64_t, 3> type_of_event = {tags16::type_tag, tags16::type_sync,
                                                        tags16::type_markers};

}  // namespace

struct Tags16Encoder::Output {
  std::byte* at;
  std::byte* end;
  std::int64_t earliest_ps, latest_ps;

  [[nodiscard]] std::size_t records_left() const {
    return static_cast<std::size_t>(end - at) / record_bytes;
  }
  void see(std::int64_t time_ps) {
    earliest_ps = std::min(earliest_ps, time_ps);
    latest_ps = std::max(latest_ps, time_ps);
  }
  void put(std::uint64_t head, std::int64_t time_ps) {
    see(time_ps);
    store_record(head, time_ps, at);
    at += record_bytes;
  }
  void put_missed(std::int64_t count, std::int64_t time_ps) {
    while (count > 0) {
      const std::int64_t some = std::min(count, most_missed_a_record);
      put(tags16::type_missed | (static_cast<std::uint64_t>(some) << 16U), time_ps);
      count -= some;
    }
  }
};

void Tags16Encoder::tell(NoticeKind kind, const std::string& text) {
  constexpr std::size_t a_record = tags16::text_bytes_a_record;
  const std::size_t bytes =
      std::min(text.find('\0'), std::min(text.size(), tags16::max_text_bytes - 1));
  for (std::size_t from = 0; from <= bytes; from += a_record) {
    std::string record = {static_cast<char>(tags16::type_text), static_cast<char>(kind)};
    record.append(text, from, std::min(a_record, bytes - from));
    record.resize(2 + a_record, '\0');
    texts_ += record;
  }
}

Tags16Encoder::Progress Tags16Encoder::encode(std::span<const Tag> tags,
                                              std::span<std::byte> room) {
  Progress progress;
  while (progress.tags < tags.size() && tags[progress.tags].kind == TagKind::clock_break) {
    was_broken_ = was_broken_ || has_begun_;
    has_begun_ = false;
    ++progress.tags;
  }
  tags = tags.subspan(progress.tags);
  Output out{room.data() + header_bytes, room.data() + room.size(), 0, 0};
  begin(tags, out);
  const std::int64_t begin_ps = out.earliest_ps;
  put_texts(out);
  for (const Tag& tag : tags) {
    if (out.records_left() < most_records_a_tag || !put(tag, out)) break;
    ++progress.tags;
  }
  reached_ps_ = out.latest_ps;
  progress.bytes = static_cast<std::size_t>(out.at - room.data());
  const std::size_t records = (progress.bytes - header_bytes) / record_bytes;
  std::memcpy(room.data(), "SPTB\1\0\0\0", 8);
  store(static_cast<std::uint32_t>(records), &room[8]);
  store(sequence_++, &room[12]);
  // The rest of what came early is outside the block, as a receiver expects.
  store(std::max(out.earliest_ps, saturated_difference(begin_ps, tags16::max_disorder_ps)),
        &room[16]);
  store(reached_ps_, &room[24]);
  return progress;
}

// A receiver takes a step back for a clock that starts anew; any other break has to be told.
void Tags16Encoder::begin(std::span<const Tag> tags, Output& out) {
  const std::int64_t last_ps = reached_ps_;
  if (!has_begun_ && !tags.empty()) {
    has_begun_ = true;
    reached_ps_ = tags.front().time_ps;
  }
  out.earliest_ps = out.latest_ps = reached_ps_;
  if (!was_broken_ || !has_begun_) return;
  was_broken_ = false;
  const std::int64_t back_ps = saturated_difference(last_ps, reached_ps_);
  if (back_ps <= tags16::max_disorder_ps) out.put(tags16::type_time_base_broken, reached_ps_);
}

void Tags16Encoder::put_texts(Output& out) {
  constexpr std::size_t head_bytes = record_bytes - sizeof(std::int64_t);
  const std::size_t count =
      std::min(texts_.size() / head_bytes, out.records_left() - most_records_a_tag);
  for (std::size_t i = 0; i < count; ++i) {
    std::uint64_t head = 0;
    std::memcpy(&head, &texts_[i * head_bytes], head_bytes);
    std::memcpy(out.at, &head, head_bytes);
    store(reached_ps_, out.at + head_bytes);
    out.at += record_bytes;
  }
  texts_.erase(0, count * head_bytes);
}

// False for a tag that the next block begins with.
bool Tags16Encoder::put(const Tag& tag, Output& out) {
  if (is_event(tag.kind)) {
    out.put(type_of_event.at(static_cast<std::size_t>(tag.kind)) |
                (static_cast<std::uint64_t>(static_cast<std::uint32_t>(tag.value)) << 32U),
            tag.time_ps);
    return true;
  }
  switch (tag.kind) {
    case TagKind::clock_break:
      return false;
    case TagKind::loss_begin:
      out.put(tags16::type_overflow_begin, tag.time_ps);
      break;
    case TagKind::loss_end:
      if (!put_count(tag, out)) return false;
      out.put(tags16::type_overflow_end, tag.time_ps);
      break;
    case TagKind::missed:
      return put_count(tag, out);
    default:
      out.see(tag.time_ps);
  }
  return true;
}

// False where the next block tells the rest of the count.
bool Tags16Encoder::put_count(const Tag& tag, Output& out) {
  const std::int64_t left = tag.value - told_of_count_;
  const std::int64_t some = std::min(left, most_missed_a_block);
  out.put_missed(some, tag.time_ps);
  told_of_count_ = some < left ? told_of_count_ + some : 0;
  return some == left;
}

}  // namespace splid
