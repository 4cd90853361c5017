#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "protocol/tag.hpp"
#include "protocol/tags16.hpp"

namespace splid {

// Makes tags16 blocks (docs/reference/tags16.md) of a stream of tags, as Tags16Decoder reads them:
//
//  - a block begins where the block before it ended, and ends at its latest tag or heartbeat. The
//    first block with a tag begins at that tag, and so does the first one after a clock_break;
//    until then blocks tell no time;
//  - photons, syncs and markers have a record each, and so have the beginnings and ends of losses.
//    A count is told by records of missed events.
//
// Tags may be out of order by 1 us. What is out of order by more than that is counted as missed by
// the receiver.
//
// Threads: one. Errors: none. No allocation but by tell().
class Tags16Encoder {
 public:
  struct Progress {
    std::size_t tags = 0;   // used
    std::size_t bytes = 0;  // written
  };

  // The least room for a block.
  static constexpr std::size_t least_room = 4096;

  // Writes one block of as many tags as there is room for, up to the next clock_break; an empty
  // block where there are no tags.
  Progress encode(std::span<const Tag> tags, std::span<std::byte> room);

  // Has the next block begin with a sentence about the instrument. A sentence of more than
  // tags16::max_text_bytes is cut; what was told before the last block was made is not lost.
  void tell(NoticeKind kind, const std::string& text);

 private:
  struct Output;

  void begin(std::span<const Tag> tags, Output& out);
  void put_texts(Output& out);
  bool put(const Tag& tag, Output& out);
  bool put_count(const Tag& tag, Output& out);

  std::string texts_;  // records that wait, without their times
  std::uint32_t sequence_ = 0;
  std::int64_t reached_ps_ = tags16::no_time_ps;
  std::int64_t told_of_count_ = 0;  // of the tag that comes next
  bool has_begun_ = false;          // the clock that blocks tell of
  bool was_broken_ = false;         // by a clock_break that no block has told
};

}  // namespace splid
