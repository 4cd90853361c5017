#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "tests/support/tags16_block.hpp"
#include "tests/support/ttm_encoder.hpp"

namespace splid::test {

// The stream of a BrightEyes-TTM as it comes live: the records of each millisecond of the host's
// time, and padding.
//
// Threads: any; locks.
class TtmSender {
 public:
  static constexpr std::int64_t block_ps = 1'000'000'000;

  // events(begin_ps, end_ps): those of that time, sorted.
  using Events = std::function<std::vector<TtmEvent>(std::int64_t, std::int64_t)>;

  explicit TtmSender(Events events) : events_(std::move(events)) {}

  // As a StreamFirmware::Supply.
  std::size_t operator()(std::span<std::byte> room) {
    const std::lock_guard lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    if (start_ == std::chrono::steady_clock::time_point{}) start_ = now;
    // It sends often, even where it has fallen behind on a slow machine.
    const std::int64_t due_ps = std::min(std::chrono::nanoseconds(now - start_).count() * 1000,
                                         at_ps_ + blocks_a_call * block_ps);
    while (at_ps_ + block_ps <= due_ps && waiting_.size() < room.size()) {
      for (int i = 0; i < 10; ++i) append_little_endian(std::uint16_t{0x7FFF}, waiting_);
      const std::int64_t begin_ps = std::exchange(at_ps_, at_ps_ + block_ps);
      if (!pads_) encoder_.append(events_(begin_ps, at_ps_), at_ps_, waiting_);
    }
    const std::size_t count = std::min(room.size(), waiting_.size());
    std::copy_n(waiting_.begin(), count, room.begin());
    waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(count));
    return count;
  }

  // Its memory is nearly full from now on, or no more.
  void set_drops(bool drops) {
    const std::lock_guard lock(mutex_);
    encoder_.drops = drops;
  }
  // It sends padding alone from now on, or no more.
  void set_pads(bool pads) {
    const std::lock_guard lock(mutex_);
    pads_ = pads;
    if (!pads) encoder_.skip_to(at_ps_);
  }
  // The records of so many milliseconds are missing.
  void skip(int blocks) {
    const std::lock_guard lock(mutex_);
    at_ps_ += blocks * block_ps;
    encoder_.skip_to(at_ps_);
  }
  // On the instrument's clock, where the next block begins.
  [[nodiscard]] std::int64_t now_ps() {
    const std::lock_guard lock(mutex_);
    return at_ps_;
  }
  // As after power came.
  void restart() {
    const std::lock_guard lock(mutex_);
    start_ = {};
    at_ps_ = 0;
    encoder_ = {};
    waiting_.clear();
  }

 private:
  static constexpr std::int64_t blocks_a_call = 5;

  std::mutex mutex_;
  Events events_;
  TtmEncoder encoder_;
  std::chrono::steady_clock::time_point start_;
  std::int64_t at_ps_ = 0;
  bool pads_ = false;
  std::vector<std::byte> waiting_;
};

}  // namespace splid::test
