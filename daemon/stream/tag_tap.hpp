#pragma once

#include <span>

#include "protocol/tag.hpp"

namespace splid {

// Who hears of every tag that is framed, such as a recording.
//
// Threads: the framer's. Timeouts: take() may wait only where the source can, as a replay does; it
// allocates nothing and takes no lock. Errors: none.
class TagTap {
 public:
  virtual ~TagTap() = default;

  // The next tags of the stream, in its order.
  virtual void take(std::span<const Tag> tags) = 0;
  // The stream is over, or the tap is taken away: no tag comes any more.
  virtual void finish() = 0;
};

}  // namespace splid
