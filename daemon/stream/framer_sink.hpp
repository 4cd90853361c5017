#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <stop_token>
#include <utility>
#include <vector>

#include "daemon/stream/framer.hpp"
#include "drivers/source.hpp"

namespace splid {

// Frames a source's tags on the source's own thread, without a ring, for work that need not keep up
// with an instrument.
//
// Threads: the source's. Errors, timeouts: none.
class FramerSink final : public TagSink {
 public:
  // framer outlives this.
  FramerSink(Framer& framer, std::stop_token stop)
      : framer_(framer), stop_(std::move(stop)), block_(block_tags) {}

  std::span<Tag> claim(std::size_t max_count) override {
    if (stop_.stop_requested()) return {};
    return std::span(block_).first(std::min(max_count, block_.size()));
  }
  void publish(std::size_t count) override { framer_.push(std::span(block_).first(count), 0); }

 private:
  static constexpr std::size_t block_tags = 16'384;

  Framer& framer_;
  std::stop_token stop_;
  std::vector<Tag> block_;
};

}  // namespace splid
