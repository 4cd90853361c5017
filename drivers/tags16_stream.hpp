#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/source.hpp"
#include "protocol/tags16.hpp"

namespace splid {

// From the bytes of a tags16 stream straight into a sink, with counters for the metrics.
//
// Threads: the source's, but for counters(). Errors: none.
class Tags16Stream {
 public:
  // Decodes all of them; false, and what is left not decoded, once a stop was requested.
  bool feed(std::span<const std::byte> bytes, TagSink& sink);
  // As Tags16Decoder::cut().
  void cut();

  [[nodiscard]] std::uint64_t blocks() const { return decoder_.counts().blocks; }
  // Any thread.
  [[nodiscard]] std::vector<SourceCounter> counters() const;

 private:
  static constexpr std::size_t kinds = 7;

  void note();

  Tags16Decoder decoder_;
  std::uint64_t bytes_ = 0;
  std::array<std::atomic<std::uint64_t>, kinds> noted_{};  // in the order of counters()
};

}  // namespace splid
