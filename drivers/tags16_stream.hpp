#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/source.hpp"
#include "protocol/tags16.hpp"

namespace splid {

// What goes wrong with a stream of blocks, in sentences for the status and the log.
//
// Threads: one. Errors: none.
class Tags16News {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // What went wrong since it was last said, empty where nothing did; to be asked often. It is said
  // within 40 ms, so that what belongs together is in one sentence, and once a second at most.
  // Where in a block a stream is first met is nothing that went wrong.
  std::string since_last(const Tags16Counts& counts, Time now);

 private:
  static constexpr std::chrono::milliseconds between_looks{40};
  static constexpr std::chrono::milliseconds between_news{1000};

  Tags16Counts said_;
  Time next_look_;
};

// From the bytes of a tags16 stream straight into a sink, with counters for the metrics.
//
// Threads: the source's, but for counters(). Errors: none.
class Tags16Stream {
 public:
  // Decodes all of them; false, and what is left not decoded, once a stop was requested.
  bool feed(std::span<const std::byte> bytes, TagSink& sink);
  // As Tags16Decoder::cut().
  void cut();

  [[nodiscard]] const Tags16Counts& counts() const { return decoder_.counts(); }
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
