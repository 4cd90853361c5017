#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>

#include "protocol/tag.hpp"

namespace splid {

// What a stream of tags16 blocks held besides its tags. Each counts from the start of the stream.
struct Tags16Counts {
  std::uint64_t blocks = 0;          // whole ones
  std::uint64_t lost_blocks = 0;     // gaps in the sequence numbers
  std::uint64_t damaged_blocks = 0;  // cut off at a record that is no tag, or at a new connection
  std::uint64_t bad_headers = 0;     // with the magic, but not of a block: see Tags16Decoder
  std::uint64_t outside_tags = 0;    // with a time outside their block; each is one missed tag
  std::uint64_t skipped_bytes = 0;   // that belong to no block
};

// The types of a record, in its first byte.
namespace tags16 {
inline constexpr std::uint64_t type_tag = 0;
inline constexpr std::uint64_t type_time_base_broken = 1;
inline constexpr std::uint64_t type_overflow_begin = 2;
inline constexpr std::uint64_t type_overflow_end = 3;
inline constexpr std::uint64_t type_missed = 4;
inline constexpr std::uint64_t type_sync = 5;
inline constexpr std::uint64_t type_markers = 6;
inline constexpr std::uint64_t type_text = 7;

// Where a block begins and ends, and the time of its records, while no time is known yet: such a
// block has sentences alone, or is a sign of life.
inline constexpr std::int64_t no_time_ps = std::numeric_limits<std::int64_t>::min();
// Blocks may overlap by as much as streams may be unsorted.
inline constexpr std::int64_t max_disorder_ps = 1'000'000;
// How much of a sentence one record of type_text holds.
inline constexpr std::size_t text_bytes_a_record = 6;
// A sentence that is longer is cut.
inline constexpr std::size_t max_text_bytes = 252;
}  // namespace tags16

// How a sentence about the instrument is meant; the second byte of its records.
enum class NoticeKind : std::uint8_t {
  caution,  // the instrument is there; the sentence holds until the next; empty: all is well
  absent,   // it is not there: unplugged, switched off, in use by another program
  failing,  // it is there and does not do what it should
  event,    // something that is over; what held before still holds
};

// A sentence that a sender said of its instrument.
struct Notice {
  std::uint64_t number = 0;  // counts the sentences of its sort that came; 0: none did
  NoticeKind kind = NoticeKind::caution;
  std::string_view text;  // bytes of a stranger, of whatever encoding
};

// Turns tags16 blocks (docs/reference/tags16.md) into tags, from bytes however they are cut:
//
//  - a tag is a photon tag whose value is the channel, negative for a falling edge; syncs and
//    markers have records of their own;
//  - the end of a block is a heartbeat, but for a block without a time;
//  - a broken time base, and a block that begins more than 1 us before the end of the one before,
//    is a clock_break;
//  - an overflow is a loss, missed events are `missed`, as is a tag outside its block;
//  - time between two blocks, a gap in the sequence and bytes that are no block are a loss of
//    unknown count from where the stream was to where the next block begins.
//
// The time before the first block is no loss.
//
// A header is believed where its version, flags, count and end are possible, and no other header
// begins inside it, as happens where a block was cut off in its header. A header that is more than
// 10 s ahead, or covers more than 10 s, or is early without the next sequence number, must be
// confirmed by what follows it: up to three records of its time or, for an empty block, the header
// of a block that goes on from there. Sixteen records in a row outside their block are taken for
// misaligned bytes: the block then ends before the first of them, as a block that was cut off.
//
// Threads: one. Errors: none, whatever the bytes; see counts(). No allocation.
class Tags16Decoder {
 public:
  static constexpr std::size_t header_bytes = 32;
  static constexpr std::size_t tag_bytes = 16;
  // Design note: a block of a million tags is 16 MiB, a tenth of a second of the fastest tagger. A
  // larger count is taken for damage, so that a wrong one costs no more than that.
  static constexpr std::uint32_t max_block_tags = 1 << 20;

  struct Progress {
    std::size_t bytes = 0;  // used
    std::size_t tags = 0;   // written
  };

  // Decodes until either `bytes` or `out` is used up. As long as `out` was filled, more tags may be
  // waiting: call it again, with the bytes that are left, or with none.
  Progress decode(std::span<const std::byte> bytes, std::span<Tag> out);

  // The bytes that come next do not follow those before, as after a new connection.
  void cut();

  [[nodiscard]] const Tags16Counts& counts() const { return counts_; }
  // The last sentence that still holds, and the last event. The texts are valid until the next
  // decode().
  [[nodiscard]] Notice notice() const { return state_.notice(); }
  [[nodiscard]] Notice event() const { return event_.notice(); }
  // The time up to which the blocks so far told of all tags, in the tagger's clock; 0 before the
  // first block.
  [[nodiscard]] std::int64_t reached_ps() const { return reached_ps_; }

 private:
  struct Input;
  struct Output;
  struct Header;
  struct Sentence {
    std::array<char, tags16::max_text_bytes> text{};
    std::size_t bytes = 0;
    NoticeKind kind = NoticeKind::caution;
    std::uint64_t number = 0;

    [[nodiscard]] Notice notice() const { return {number, kind, {text.data(), bytes}}; }
  };
  enum class Verdict { credible, none, more };  // more: bytes are needed to tell

  static constexpr std::size_t probe_records = 3;
  static constexpr std::size_t probe_bytes = header_bytes + probe_records * tag_bytes;

  bool read_header(Input& in);
  void take_header();
  [[nodiscard]] Verdict judge_header() const;
  [[nodiscard]] Verdict find_header_inside() const;
  [[nodiscard]] bool is_doubtful(const Header& header) const;
  [[nodiscard]] Verdict judge_what_follows(const Header& header) const;
  void drop_held(std::size_t bytes);
  void skip_to_magic();
  void follow(std::uint32_t sequence);
  bool read_tags(Input& in, Output& out);
  void read_run(Input& in, Output& out);
  bool read_special(const std::byte* record, Output& out);
  void read_text(const std::byte* record);
  bool hold(Input& in, std::size_t bytes);
  void damaged();
  void end_block();
  void wait(const Tag& tag) { waiting_[waiting_count_++] = tag; }

  // The bytes of a header and of what confirms it, or of a tag that came in two pieces.
  std::array<std::byte, probe_bytes> held_{};
  std::size_t held_bytes_ = 0;
  std::array<Tag, 3> waiting_{};  // tags between blocks that wait for room
  std::size_t waiting_count_ = 0;

  bool in_block_ = false;
  std::uint32_t tags_left_ = 0;  // of the block
  std::int64_t begin_ps_ = 0;
  std::int64_t end_ps_ = 0;

  bool begun_ = false;   // a block with a time has come
  bool doubted_ = true;  // bytes are missing since the last block
  bool fresh_ = true;    // nothing has come since the beginning, or since cut()
  int outside_in_row_ = 0;
  bool counted_overflow_ = false;
  std::uint32_t next_sequence_ = 0;
  std::int64_t reached_ps_ = 0;
  Tags16Counts counts_;

  std::array<char, tags16::max_text_bytes> coming_{};  // of the sentence that is coming
  std::size_t coming_bytes_ = 0;
  // The last whole sentences. A block may have one of each sort, of which both count.
  Sentence state_;
  Sentence event_;
};

}  // namespace splid
