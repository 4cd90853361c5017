#include "drivers/usb/block_queue.hpp"

#include <cstring>

namespace splid::usb {
namespace {

// Blocks begin on a cache line, as decoders like it; so a header always fits before the ring's end.
constexpr std::size_t alignment = 64;

std::uint64_t rounded(std::uint64_t bytes) { return (bytes + alignment - 1) & ~(alignment - 1); }

}  // namespace

BlockQueue::BlockQueue(std::size_t capacity)
    : capacity_(capacity), ring_(std::make_unique_for_overwrite<std::byte[]>(capacity)) {}

bool BlockQueue::push(std::span<const std::byte> bytes) {
  const std::uint64_t at = written_.load(std::memory_order_relaxed);
  const std::uint64_t room = capacity_ - (at - read_.load(std::memory_order_acquire));
  const std::uint64_t to_end = capacity_ - place(at);
  const std::uint64_t needed = rounded(sizeof(Header) + bytes.size());
  const std::uint64_t skipped = needed > to_end ? to_end : 0;
  if (skipped + needed > room) {
    drops_.store(drops_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    cut();
    return false;
  }
  if (skipped > 0) {
    const Header unused{rest_unused, 0};
    std::memcpy(&ring_[place(at)], &unused, sizeof unused);
  }
  const Header header{static_cast<std::uint32_t>(bytes.size()),
                      cuts_.load(std::memory_order_relaxed)};
  std::byte* const begin = &ring_[place(at + skipped)];
  std::memcpy(begin, &header, sizeof header);
  if (!bytes.empty()) std::memcpy(begin + sizeof header, bytes.data(), bytes.size());
  written_.store(at + skipped + needed, std::memory_order_release);
  return true;
}

std::optional<Block> BlockQueue::front() {
  std::uint64_t at = read_.load(std::memory_order_relaxed);
  if (at == written_.load(std::memory_order_acquire)) return std::nullopt;
  Header header;
  std::memcpy(&header, &ring_[place(at)], sizeof header);
  if (header.bytes == rest_unused) {
    at += capacity_ - place(at);
    std::memcpy(&header, &ring_[place(at)], sizeof header);
  }
  next_ = at + rounded(sizeof header + header.bytes);
  return Block{{&ring_[place(at)] + sizeof header, header.bytes}, header.cuts};
}

void BlockQueue::pop() { read_.store(next_, std::memory_order_release); }

}  // namespace splid::usb
