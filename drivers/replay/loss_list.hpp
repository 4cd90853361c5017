#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "protocol/tag.hpp"

namespace splid {

// The losses that a recording's header lists, as loss_begin, loss_end and missed tags in the order
// of time: the tags that told of these losses in the live stream.
//
// Threads: one. No allocation after construction.
class LossList {
 public:
  explicit LossList(std::span<const Loss> losses);

  // The next tag; null when all were taken.
  [[nodiscard]] const Tag* next() const { return taken_ < tags_.size() ? &tags_[taken_] : nullptr; }
  void take() { ++taken_; }

 private:
  std::vector<Tag> tags_;
  std::size_t taken_ = 0;
};

}  // namespace splid
