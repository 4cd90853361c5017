#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/source.hpp"
#include "protocol/tag.hpp"

namespace splid {

// Writes tags one by one into the room that a sink hands out.
//
// Threads: the source's only. Errors: none.
class TagWriter {
 public:
  explicit TagWriter(TagSink& sink) : sink_(sink) {}

  // False, and nothing written, once a stop was requested.
  bool put(const Tag& tag) {
    if (used_ == room_.size() && !claim_more()) return false;
    room_[used_++] = tag;
    return true;
  }

  // Hands on what was written.
  void publish() {
    if (!room_.empty()) sink_.publish(used_);
    room_ = {};
    used_ = 0;
  }

 private:
  bool claim_more() {
    publish();
    room_ = sink_.claim(block_tags);
    return !room_.empty();
  }

  // 64 KiB: fits the first caches, and a block takes longer to fill than to hand on.
  static constexpr std::size_t block_tags = 4096;

  TagSink& sink_;
  std::span<Tag> room_;
  std::size_t used_ = 0;
};

// Writes tags and hands them on.
inline void put_tags(std::span<const Tag> tags, TagSink& sink) {
  TagWriter out(sink);
  for (const Tag& tag : tags) {
    if (!out.put(tag)) return;
  }
  out.publish();
}

// Writes a loss of unknown count at time_ps, where the stream was, and a clock_break: later times
// do not follow earlier ones.
inline void put_clock_end(std::int64_t time_ps, TagSink& sink) {
  const std::array<Tag, 3> tags{{{time_ps, 0, TagKind::loss_begin, {}},
                                 {time_ps, -1, TagKind::loss_end, {}},
                                 {time_ps, 0, TagKind::clock_break, {}}}};
  put_tags(tags, sink);
}

}  // namespace splid
