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

// Says in sentences, for the status and the log, what goes wrong with a stream of tags16 blocks.
//
// Threads: one. Errors: none.
class Tags16News {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // What went wrong since this was last told; empty where nothing did. Call it often. Damage is
  // told within 40 ms, so that what belongs together is in one sentence, and once a second at most.
  // A stream may begin in the middle of a block: bytes that were skipped by the time of the first
  // look are no damage.
  std::string since_last(const Tags16Counts& counts, Time now);

 private:
  static constexpr std::chrono::milliseconds between_looks{40};
  static constexpr std::chrono::milliseconds between_news{1000};

  Tags16Counts told_;  // the counts when damage was last looked for
  Time next_look_;
};

// What came in all tags16 streams of a source, one after another, for the metrics.
//
// Threads: add() is the source's, list() may be called from any. Errors: none.
class Tags16Counters {
 public:
  // The bytes that came, and what the counts of their stream rose by.
  void add(std::uint64_t bytes, const Tags16Counts& before, const Tags16Counts& now);
  [[nodiscard]] std::vector<SourceCounter> list() const;

 private:
  static constexpr std::size_t kinds = 7;

  std::array<std::atomic<std::uint64_t>, kinds> values_{};  // in the order of list()
};

// Decodes the bytes of a tags16 stream straight into a sink, and counts what came.
//
// Threads: the source's. Errors: none.
class Tags16Stream {
 public:
  // counters: outlives this object.
  explicit Tags16Stream(Tags16Counters& counters) : counters_(counters) {}

  // Decodes all bytes. Once a stop was requested it returns false, and bytes may be left undecoded.
  bool feed(std::span<const std::byte> bytes, TagSink& sink);
  // As Tags16Decoder::cut().
  void cut();

  // Of this stream alone.
  [[nodiscard]] const Tags16Counts& counts() const { return decoder_.counts(); }
  // As Tags16Decoder::reached_ps(), notice() and event().
  [[nodiscard]] std::int64_t reached_ps() const { return decoder_.reached_ps(); }
  [[nodiscard]] Notice notice() const { return decoder_.notice(); }
  [[nodiscard]] Notice event() const { return decoder_.event(); }

 private:
  void note(std::uint64_t bytes);

  Tags16Decoder decoder_;
  Tags16Counters& counters_;
  Tags16Counts noted_;  // what counters_ has
};

}  // namespace splid
