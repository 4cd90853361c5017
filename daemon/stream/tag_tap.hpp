#pragma once

#include <span>

#include "protocol/tag.hpp"

namespace splid {

// Gets every tag that the framer takes, as a recording does.
//
// Threads: the framer's. Timeouts: take() may wait only if the source can wait, as a replay can; it
// allocates nothing and takes no lock. Errors: none.
class TagTap {
 public:
  virtual ~TagTap() = default;

  // The next tags of the stream, in its order.
  virtual void take(std::span<const Tag> tags) = 0;
  // The stream is over or the tap was removed from it: no more tags will come.
  virtual void finish() = 0;
};

}  // namespace splid
