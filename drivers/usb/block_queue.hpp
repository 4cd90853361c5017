#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

namespace splid::usb {

// The bytes of one transfer.
struct Block {
  std::span<const std::byte> bytes;  // valid until pop()
  std::uint32_t cuts = 0;            // number of cuts before these bytes, since the queue was made
};

// The way of the bytes from libusb's callbacks to the thread that decodes them: blocks of any
// length in a ring of bytes, each in one piece. A cut is a place in the stream at which bytes may
// be missing; push() makes a cut itself where it has no room for the bytes.
//
// Threads: the producer calls push() and cut(), the consumer front() and pop(), anyone cuts().
// Errors: none. No allocation after construction, no lock.
class BlockQueue {
 public:
  // capacity: bytes, a power of two of at least 64. The ring's memory is not touched before use.
  explicit BlockQueue(std::size_t capacity);

  // Copies the bytes into the ring. Where there is no room it makes a cut and returns false.
  bool push(std::span<const std::byte> bytes);
  void cut() { cuts_.store(cuts_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }

  // The oldest block; absent where there is none.
  std::optional<Block> front();
  // Gives the room of the oldest block back.
  void pop();

  // A consumer that reads this count, and then finds the queue empty, has taken all bytes before
  // the last of these cuts.
  [[nodiscard]] std::uint32_t cuts() const { return cuts_.load(std::memory_order_acquire); }
  // How many of the cuts are blocks that there was no room for. Whoever has seen a cut sees it
  // here.
  [[nodiscard]] std::uint32_t drops() const { return drops_.load(std::memory_order_relaxed); }

 private:
  struct Header {
    std::uint32_t bytes = 0;
    std::uint32_t cuts = 0;
  };
  // As a header's length: the ring has nothing more before its end.
  static constexpr std::uint32_t rest_unused = 0xFFFFFFFF;
  static constexpr std::size_t cache_line = 64;

  [[nodiscard]] std::size_t place(std::uint64_t at) const { return at & (capacity_ - 1); }

  std::size_t capacity_;
  std::unique_ptr<std::byte[]> ring_;
  alignas(cache_line) std::atomic<std::uint64_t> written_{0};  // producer writes
  std::atomic<std::uint32_t> cuts_{0};                         // producer writes
  std::atomic<std::uint32_t> drops_{0};                        // producer writes
  alignas(cache_line) std::atomic<std::uint64_t> read_{0};     // consumer writes
  std::uint64_t next_ = 0;                                     // consumer only: after the front
};

}  // namespace splid::usb
