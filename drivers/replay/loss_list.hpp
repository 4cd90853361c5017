#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "protocol/tag.hpp"

namespace splid {

// The losses that a recording's header lists, as the tags that told of them in the live stream, in
// the order of time.
//
// Threads: one. No allocation after construction.
class LossList {
 public:
  explicit LossList(std::span<const Loss> losses);

  // Null when all were taken.
  [[nodiscard]] const Tag* next() const { return taken_ < tags_.size() ? &tags_[taken_] : nullptr; }
  void take() { ++taken_; }

 private:
  std::vector<Tag> tags_;
  std::size_t taken_ = 0;
};

}  // namespace splid
