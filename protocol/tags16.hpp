#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

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

// Turns tags16 blocks (docs/reference/tags16.md) into tags, from bytes however they are cut:
//
//  - a tag is a photon tag whose value is the channel, negative for a falling edge;
//  - the end of a block is a heartbeat;
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
  // The time up to which the blocks so far told of all tags, in the tagger's clock; 0 before the
  // first block.
  [[nodiscard]] std::int64_t reached_ps() const { return reached_ps_; }

 private:
  struct Input;
  struct Output;
  struct Header;
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

  bool begun_ = false;   // a block has come
  bool doubted_ = true;  // bytes are missing since the last block
  bool fresh_ = true;    // nothing has come since the beginning, or since cut()
  int outside_in_row_ = 0;
  bool counted_overflow_ = false;
  std::uint32_t next_sequence_ = 0;
  std::int64_t reached_ps_ = 0;
  Tags16Counts counts_;
};

}  // namespace splid
