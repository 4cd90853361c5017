#include "protocol/tags16.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "protocol/saturated.hpp"

namespace splid {
namespace {

constexpr std::array<std::byte, 4> tags16_magic = {std::byte{'S'}, std::byte{'P'}, std::byte{'T'},
                                                   std::byte{'B'}};
constexpr std::uint16_t tags16_version = 1;

// Design note: rule 1 has a block every 10 ms, so 10 s are a thousand times what a block covers or
// skips. Of 20 bytes at random, taken for a header's times, one in 10^12 is as near as that.
constexpr std::int64_t far_ps = 10'000'000'000'000;

// How far outside its block the time of a record that is no tag may be, such as the end of an
// overflow.
constexpr std::int64_t near_ps = 1'000'000'000;
constexpr int most_outside_in_row = 16;

template <class Number>
Number little_endian(const std::byte* bytes) {
  Number value = 0;
  if constexpr (std::endian::native == std::endian::little) {
    std::memcpy(&value, bytes, sizeof value);
  } else {
    for (std::size_t i = sizeof value; i-- > 0;) {
      value = static_cast<Number>((value << 8U) | std::to_integer<Number>(bytes[i]));
    }
  }
  return value;
}

std::int64_t time_at(const std::byte* bytes) {
  return static_cast<std::int64_t>(little_endian<std::uint64_t>(bytes));
}

bool is_magic(std::span<const std::byte> bytes) {
  return std::equal(tags16_magic.begin(), tags16_magic.end(), bytes.begin());
}

// The begin of each header: magic, version, flags.
constexpr std::array<std::byte, 8> beginning = {tags16_magic[0],
                                                tags16_magic[1],
                                                tags16_magic[2],
                                                tags16_magic[3],
                                                std::byte{tags16_version},
                                                {},
                                                {},
                                                {}};

bool agree(std::span<const std::byte> bytes) {
  const std::size_t count = std::min(bytes.size(), beginning.size());
  return std::equal(beginning.begin(), beginning.begin() + count, bytes.begin());
}

// The first 8 bytes of a record: type, reserved, missed (16 bits), channel (32 bits).
std::uint64_t type_of(std::uint64_t head) { return head & 0xFFU; }
std::int32_t missed_of(std::uint64_t head) {
  return static_cast<std::int32_t>((head >> 16U) & 0xFFFFU);
}
std::uint32_t channel_of(std::uint64_t head) { return static_cast<std::uint32_t>(head >> 32U); }

// The last 8 bytes of a tag: all but its time.
struct Meaning {
  std::uint32_t value = 0;
  std::uint32_t kind_and_reserved = 0;
};

// Writes a photon or a sync by two stores of 8 bytes. The assignment of a Tag is six times as slow:
// the compiler makes the tag on the stack and waits to read it back.
void put_event(std::uint64_t time, std::uint32_t channel, bool is_sync, Tag& tag) {
  static_assert(offsetof(Tag, time_ps) == 0 && offsetof(Tag, value) == sizeof time);
  static_assert(static_cast<int>(TagKind::photon) == 0 && static_cast<int>(TagKind::sync) == 1);
  static_assert(std::endian::native != std::endian::little || offsetof(Tag, kind) == 12);
  constexpr std::uint32_t sync = std::endian::native == std::endian::little ? 1 : 1U << 24U;
  const Meaning meaning{is_sync ? 0 : channel, is_sync ? sync : 0};
  auto* bytes = reinterpret_cast<std::byte*>(&tag);
  std::memcpy(bytes, &time, sizeof time);
  std::memcpy(bytes + sizeof time, &meaning, sizeof meaning);
}

}  // namespace

struct Tags16Decoder::Input {
  std::span<const std::byte> left;

  [[nodiscard]] const std::byte* data() const { return left.data(); }
  void skip(std::size_t bytes) { left = left.subspan(bytes); }
};

struct Tags16Decoder::Output {
  std::span<Tag> room;

  void put(const Tag& tag) {
    room.front() = tag;
    room = room.subspan(1);
  }
};

Tags16Decoder::Progress Tags16Decoder::decode(std::span<const std::byte> bytes,
                                              std::span<Tag> out) {
  Input input{bytes};
  Output output{out};
  for (;;) {
    const std::size_t written = std::min(waiting_count_, output.room.size());
    for (std::size_t i = 0; i < written; ++i) output.put(waiting_[i]);
    std::copy(waiting_.begin() + written, waiting_.begin() + waiting_count_, waiting_.begin());
    waiting_count_ -= written;
    if (waiting_count_ > 0) break;
    if (!(in_block_ ? read_tags(input, output) : read_header(input))) break;
  }
  return {bytes.size() - input.left.size(), out.size() - output.room.size()};
}

void Tags16Decoder::cut() {
  counts_.skipped_bytes += held_bytes_;
  held_bytes_ = 0;
  coming_bytes_ = 0;
  if (in_block_) damaged();
  doubted_ = true;
  fresh_ = true;
}

// Takes bytes until `bytes` of them are held; false where there are too few.
bool Tags16Decoder::hold(Input& in, std::size_t bytes) {
  if (held_bytes_ >= bytes) return true;
  const std::size_t taken = std::min(bytes - held_bytes_, in.left.size());
  std::copy_n(in.left.begin(), taken, held_.begin() + held_bytes_);
  held_bytes_ += taken;
  in.skip(taken);
  return held_bytes_ == bytes;
}

void Tags16Decoder::drop_held(std::size_t bytes) {
  std::copy(held_.begin() + bytes, held_.begin() + held_bytes_, held_.begin());
  held_bytes_ -= bytes;
}

bool Tags16Decoder::read_header(Input& in) {
  if (!hold(in, header_bytes)) return false;
  if (!is_magic(held_)) {
    skip_to_magic();
    return true;
  }
  // Byte by byte, so that it waits for no more bytes than it needs to decide.
  Verdict verdict = judge_header();
  while (verdict == Verdict::more && hold(in, held_bytes_ + 1)) verdict = judge_header();
  if (verdict == Verdict::more) return false;
  if (verdict == Verdict::credible) {
    take_header();
  } else {
    ++counts_.bad_headers;
    skip_to_magic();
  }
  return true;
}

struct Tags16Decoder::Header {
  bool is_known;  // whether its version and flags are known
  std::uint32_t count;
  std::uint32_t sequence;
  std::int64_t begin_ps, end_ps;

  explicit Header(const std::byte* bytes)
      : is_known(agree({bytes, beginning.size()})),
        count(little_endian<std::uint32_t>(bytes + 8)),
        sequence(little_endian<std::uint32_t>(bytes + 12)),
        begin_ps(time_at(bytes + 16)),
        end_ps(time_at(bytes + 24)) {}

  [[nodiscard]] bool can_be() const {
    return is_known && count <= max_block_tags && end_ps >= begin_ps;
  }
};

void Tags16Decoder::take_header() {
  const Header header(held_.data());
  drop_held(header_bytes);
  in_block_ = true;
  tags_left_ = header.count;
  begin_ps_ = header.begin_ps;
  end_ps_ = header.end_ps;
  outside_in_row_ = 0;
  follow(header.sequence);
  if (tags_left_ == 0) end_block();
}

Tags16Decoder::Verdict Tags16Decoder::judge_header() const {
  const Header header(held_.data());
  if (!header.can_be()) return Verdict::none;
  const Verdict verdict = find_header_inside();
  if (verdict != Verdict::credible || !is_doubtful(header)) return verdict;
  return judge_what_follows(header);
}

// The verdict is none where a header begins inside this header, of which then only a part came.
Tags16Decoder::Verdict Tags16Decoder::find_header_inside() const {
  Verdict verdict = Verdict::credible;
  // In nearly all headers no byte equals the first byte of the magic.
  if (std::memchr(&held_[1], 'S', header_bytes - 1) == nullptr) return verdict;
  for (std::size_t at = 1; at < header_bytes; ++at) {
    const auto bytes = std::span(held_).first(held_bytes_).subspan(at);
    if (!agree(bytes)) continue;
    if (bytes.size() >= beginning.size()) return Verdict::none;
    verdict = Verdict::more;
  }
  return verdict;
}

bool Tags16Decoder::is_doubtful(const Header& header) const {
  if (saturated_difference(header.end_ps, header.begin_ps) > far_ps) return true;
  // As a sender says that began anew, and knows no time yet.
  if (header.begin_ps == tags16::no_time_ps && header.end_ps == tags16::no_time_ps) return false;
  if (!begun_ || fresh_) return false;
  const bool follows = !doubted_ && header.sequence == next_sequence_;
  const std::int64_t ahead_ps = saturated_difference(header.begin_ps, reached_ps_);
  return ahead_ps > far_ps || (ahead_ps < -tags16::max_disorder_ps && !follows);
}

Tags16Decoder::Verdict Tags16Decoder::judge_what_follows(const Header& header) const {
  const auto after = std::span(held_).first(held_bytes_).subspan(header_bytes);
  if (header.count == 0) {
    if (!agree(after)) return Verdict::none;
    if (after.size() < header_bytes) return Verdict::more;
    const Header next(after.data());
    const std::int64_t gap_ps = saturated_difference(next.begin_ps, header.end_ps);
    const bool goes_on = next.can_be() && gap_ps >= -tags16::max_disorder_ps && gap_ps <= far_ps;
    return goes_on ? Verdict::credible : Verdict::none;
  }
  const std::size_t records = std::min<std::size_t>(header.count, probe_records);
  for (std::size_t i = 0; i < records; ++i) {
    if (after.size() < (i + 1) * tag_bytes) return Verdict::more;
    const std::byte* record = &after[i * tag_bytes];
    const std::int64_t time_ps = time_at(record + 8);
    const bool is_inside = time_ps >= header.begin_ps && time_ps <= header.end_ps;
    if (std::to_integer<unsigned>(record[0]) > tags16::type_text || !is_inside)
      return Verdict::none;
  }
  return Verdict::credible;
}

// Drops the first held byte, and all bytes up to the next that could begin a block.
void Tags16Decoder::skip_to_magic() {
  const auto held_end = held_.begin() + held_bytes_;
  const auto place = std::find(held_.begin() + 1, held_end, tags16_magic.front());
  counts_.skipped_bytes += static_cast<std::uint64_t>(place - held_.begin());
  held_bytes_ = static_cast<std::size_t>(held_end - place);
  std::copy(place, held_end, held_.begin());
  doubted_ = true;
  fresh_ = false;
}

// Writes into the stream how the block that begins follows the block before it.
void Tags16Decoder::follow(std::uint32_t sequence) {
  const std::uint32_t gap = sequence - next_sequence_;
  next_sequence_ = sequence + 1;
  const bool followed = !doubted_ && gap == 0;
  // A sequence number steps back where a sender began anew.
  if (begun_ && gap < (1U << 31U)) counts_.lost_blocks += gap;
  fresh_ = false;
  doubted_ = end_ps_ == tags16::no_time_ps && !followed;  // the next block with a time tells a loss
  if (end_ps_ == tags16::no_time_ps) return;
  if (begun_) {
    if (saturated_difference(reached_ps_, begin_ps_) > tags16::max_disorder_ps) {
      wait({begin_ps_, 0, TagKind::clock_break, {}});
    } else if (!followed || begin_ps_ > reached_ps_) {
      wait({reached_ps_, 0, TagKind::loss_begin, {}});
      wait({std::max(begin_ps_, reached_ps_), -1, TagKind::loss_end, {}});
    }
  }
  begun_ = true;
  reached_ps_ = begin_ps_;
}

bool Tags16Decoder::read_tags(Input& in, Output& out) {
  if (out.room.empty()) return false;
  if (held_bytes_ > 0) {
    if (!hold(in, tag_bytes)) return false;
    Input one{std::span(held_).first(tag_bytes)};
    read_run(one, out);
    if (!one.left.empty() && !read_special(one.data(), out)) return true;  // held for a header
    drop_held(tag_bytes);
  } else {
    read_run(in, out);
    if (tags_left_ > 0) {
      if (out.room.empty()) return false;
      if (in.left.size() < tag_bytes) {
        hold(in, tag_bytes);
        return false;
      }
      if (!read_special(in.data(), out)) return true;
      in.skip(tag_bytes);
    }
  }
  if (tags_left_ == 0) end_block();
  return true;
}

// The hot loop: takes photons and syncs up to the first record of another type, or outside its
// block.
void Tags16Decoder::read_run(Input& in, Output& out) {
  const std::size_t most =
      std::min({std::size_t{tags_left_}, in.left.size() / tag_bytes, out.room.size()});
  const auto begin = static_cast<std::uint64_t>(begin_ps_);
  const std::uint64_t length = static_cast<std::uint64_t>(end_ps_) - begin;
  const std::byte* record = in.data();
  Tag* const tags = out.room.data();
  std::size_t count = 0;
  for (; count < most; ++count, record += tag_bytes) {
    const auto head = little_endian<std::uint64_t>(record);
    const auto time = little_endian<std::uint64_t>(record + 8);
    const bool is_sync = type_of(head) == tags16::type_sync;
    if ((type_of(head) != tags16::type_tag && !is_sync) || time - begin > length) break;
    put_event(time, channel_of(head), is_sync, tags[count]);
  }
  if (count > 0) {
    reached_ps_ = tags[count - 1].time_ps;
    outside_in_row_ = 0;
  }
  tags_left_ -= static_cast<std::uint32_t>(count);
  in.skip(count * tag_bytes);
  out.room = out.room.subspan(count);
}

// Takes a record that read_run left. Where it is no record it takes nothing, ends the block and
// returns false.
bool Tags16Decoder::read_special(const std::byte* record, Output& out) {
  const auto head = little_endian<std::uint64_t>(record);
  const std::int64_t record_ps = time_at(record + 8);
  const bool inside = record_ps >= begin_ps_ && record_ps <= end_ps_;
  const std::int64_t time_ps = inside ? record_ps : reached_ps_;
  const bool is_near = saturated_difference(record_ps, begin_ps_) >= -near_ps &&
                       saturated_difference(record_ps, end_ps_) <= near_ps;
  std::uint64_t type = type_of(head);
  outside_in_row_ = inside ? 0 : outside_in_row_ + 1;
  if (type > tags16::type_text || outside_in_row_ == most_outside_in_row) {
    damaged();
    return false;
  }
  if (!is_near) type = tags16::type_tag;  // its content does not belong to this block
  const std::uint32_t markers = channel_of(head);
  if (type == tags16::type_markers && (!inside || markers < 1 || markers > 15))
    type = tags16::type_tag;
  switch (type) {
    case tags16::type_tag:
    case tags16::type_sync:
      ++counts_.outside_tags;
      out.put({time_ps, 1, TagKind::missed, {}});
      break;
    case tags16::type_time_base_broken:
      out.put({time_ps, 0, TagKind::clock_break, {}});
      break;
    case tags16::type_overflow_begin:
      counted_overflow_ = false;
      out.put({time_ps, 0, TagKind::loss_begin, {}});
      break;
    case tags16::type_overflow_end:
      // Where the sender knows the count, records of missed events have told it.
      out.put({time_ps, counted_overflow_ ? 0 : -1, TagKind::loss_end, {}});
      break;
    case tags16::type_markers:
      out.put(marker_tag(time_ps, static_cast<int>(markers)));
      break;
    case tags16::type_text:
      read_text(record);
      break;
    default:
      counted_overflow_ = true;
      out.put({time_ps, missed_of(head), TagKind::missed, {}});
  }
  if (time_ps != tags16::no_time_ps) reached_ps_ = time_ps;
  --tags_left_;
  return true;
}

// A sentence ends with the first record that has a NUL in its text.
void Tags16Decoder::read_text(const std::byte* record) {
  const auto* text = reinterpret_cast<const char*>(record + 2);
  const std::size_t bytes = ::strnlen(text, tags16::text_bytes_a_record);
  const std::size_t taken = std::min(bytes, coming_.size() - coming_bytes_);
  std::copy_n(text, taken, coming_.begin() + coming_bytes_);
  coming_bytes_ += taken;
  if (bytes == tags16::text_bytes_a_record) return;
  const auto kind = static_cast<NoticeKind>(std::min(std::to_integer<std::uint8_t>(record[1]),
                                                     static_cast<std::uint8_t>(NoticeKind::event)));
  Sentence& said = kind == NoticeKind::event ? event_ : state_;
  said = {coming_, std::exchange(coming_bytes_, 0), kind, said.number + 1};
}

void Tags16Decoder::damaged() {
  ++counts_.damaged_blocks;
  coming_bytes_ = 0;
  in_block_ = false;
  doubted_ = true;
}

void Tags16Decoder::end_block() {
  ++counts_.blocks;
  in_block_ = false;
  if (end_ps_ == tags16::no_time_ps) return;
  reached_ps_ = end_ps_;
  wait(heartbeat_tag(end_ps_));
}

}  // namespace splid
