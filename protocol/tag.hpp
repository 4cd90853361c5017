#pragma once

#include <cstdint>
#include <cstring>

// protocol/ is the vocabulary that all rooms share, and its encodings as bytes, text and JSON. A
// newcomer should read this header first, and then protocol/pattern.hpp and
// protocol/frame_json.hpp: a tagger's events and a pattern go into splid, and frames come out.

namespace splid {

// What a tag stands for. The first three kinds are events that an instrument saw. The kinds from
// heartbeat on are facts about the stream itself, which travel in the stream, in order, so that
// each loss is told.
enum class TagKind : std::uint8_t {
  photon,       // value: the input, as the instrument (in a PTU: the record) numbers it
  sync,         // comes once a pattern period, where the instrument has a sync input of its own
  marker,       // value: the marker bits, 1 to 15
  heartbeat,    // no event: the instrument's clock has reached time_ps. Closes frames in the dark
  loss_begin,   // from time_ps on, tags may be missing
  loss_end,     // up to time_ps tags were missing; value: how many, -1 where the count is unknown
  missed,       // value: tags missing near time_ps, where the instrument gives no interval
  clock_break,  // the instrument's clock was set anew: later times do not follow earlier ones
};

// One event of a time tagger. time_ps is in the tagger's own clock, whose zero is anywhere: 0, or
// 3.4e17 on an instrument that counts from an epoch. Streams are sorted by time to within a
// microsecond; a stream that steps back further says clock_break.
//
// Design note: 16 bytes, so that four fit a cache line and a block is copied by plain vector moves.
struct Tag {
  std::int64_t time_ps = 0;
  std::int32_t value = 0;
  TagKind kind = TagKind::photon;
  std::uint8_t reserved[3] = {0, 0, 0};

  friend bool operator==(const Tag&, const Tag&) = default;
};
static_assert(sizeof(Tag) == 16);

constexpr Tag photon_tag(std::int64_t time_ps, int input) {
  return {time_ps, input, TagKind::photon, {}};
}
constexpr Tag sync_tag(std::int64_t time_ps) { return {time_ps, 0, TagKind::sync, {}}; }
constexpr Tag marker_tag(std::int64_t time_ps, int bits) {
  return {time_ps, bits, TagKind::marker, {}};
}
constexpr Tag heartbeat_tag(std::int64_t time_ps) { return {time_ps, 0, TagKind::heartbeat, {}}; }

// The last 8 bytes of a Tag: all but its time.
struct TagMeaning {
  std::int32_t value = 0;
  TagKind kind = TagKind::photon;
  std::uint8_t reserved[3] = {0, 0, 0};
};
static_assert(sizeof(TagMeaning) + sizeof(std::int64_t) == sizeof(Tag));

// Writes a tag by two stores of 8 bytes. Member by member there would be six stores, and decoding
// of a recording would be a third slower.
inline void write_tag(Tag& tag, std::int64_t time_ps, const TagMeaning& meaning) {
  auto* bytes = reinterpret_cast<unsigned char*>(&tag);
  std::memcpy(bytes, &time_ps, sizeof time_ps);
  std::memcpy(bytes + sizeof time_ps, &meaning, sizeof meaning);
}

// True for the kinds that an instrument records. Only these are counted as tags.
constexpr bool is_event(TagKind kind) { return kind <= TagKind::marker; }

// A stretch of the tagger's time, [begin_ps, end_ps), in which tags may be missing.
struct Loss {
  std::int64_t begin_ps = 0;
  std::int64_t end_ps = 0;
  std::int64_t count = 0;  // tags known to be missing; -1 where the count is unknown

  friend bool operator==(const Loss&, const Loss&) = default;
};

}  // namespace splid
