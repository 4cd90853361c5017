#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <mutex>
#include <span>
#include <vector>

#include "tests/support/tags16_block.hpp"

namespace splid::test {

// Blocks of tags16 as an instrument would send them live: one a millisecond of the host's time,
// with whatever tags that millisecond had.
//
// Threads: any; locks.
class Tags16Sender {
 public:
  static constexpr std::int64_t block_ps = 1'000'000'000;

  // records(begin_ps, end_ps): tags of that time, sorted.
  using Records = std::function<std::vector<Tags16Record>(std::int64_t, std::int64_t)>;

  explicit Tags16Sender(Records records) : records_(std::move(records)) {}

  // As a StreamFirmware::Supply.
  std::size_t operator()(std::span<std::byte> room) {
    const std::lock_guard lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    if (start_ == std::chrono::steady_clock::time_point{}) {
      start_ = now;
      const auto unix_time = std::chrono::system_clock::now().time_since_epoch();
      start_unix_s_ = std::chrono::duration<double>(unix_time).count();
    }
    const std::int64_t due_ps = std::chrono::nanoseconds(now - start_).count() * 1000;
    const std::int64_t until_ps = std::min(due_ps, at_ps_ + blocks_a_call * block_ps);
    while ((unpaced_ || at_ps_ + block_ps <= until_ps) && waiting_.size() < room.size()) {
      const std::int64_t end_ps = at_ps_ + block_ps;
      std::vector<Tags16Record> records = records_(at_ps_, end_ps);
      for (Tags16Record& record : records) record.time_ps += step_ps_;
      append_block({sequence_++, at_ps_ + step_ps_, end_ps + step_ps_, records, version_},
                   waiting_);
      at_ps_ = end_ps;
    }
    const std::size_t count = std::min(room.size(), waiting_.size());
    std::copy_n(waiting_.begin(), count, room.begin());
    waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(count));
    return count;
  }

  // As fast as it is asked, whatever the time.
  void set_unpaced(bool unpaced) {
    const std::lock_guard lock(mutex_);
    unpaced_ = unpaced;
  }
  // Leaves out the blocks of a time, and their numbers: a gap.
  void skip(int blocks) {
    const std::lock_guard lock(mutex_);
    sequence_ += static_cast<std::uint32_t>(blocks);
    at_ps_ += blocks * block_ps;
  }
  // Leaves out numbers alone, as a sender does that lost what it had and knows no more than that.
  void skip_numbers(std::uint32_t blocks) {
    const std::lock_guard lock(mutex_);
    sequence_ += blocks;
  }
  // The instrument's clock steps, and says nothing.
  void step(std::int64_t by_ps) {
    const std::lock_guard lock(mutex_);
    step_ps_ += by_ps;
  }
  // The version of the format that the blocks to come claim to have.
  void set_version(std::uint16_t version) {
    const std::lock_guard lock(mutex_);
    version_ = version;
  }
  // On the instrument's clock, where the next block begins: what is done to the sender now takes
  // effect there, however late the machine is.
  [[nodiscard]] std::int64_t now_ps() {
    const std::lock_guard lock(mutex_);
    return at_ps_ + step_ps_;
  }
  // The host's UTC at a time of the instrument's clock, as that is now set.
  [[nodiscard]] double unix_s(std::int64_t time_ps) {
    const std::lock_guard lock(mutex_);
    return start_unix_s_ + static_cast<double>(time_ps - step_ps_) * 1e-12;
  }
  // As after power came: clock and numbers from 0.
  void restart() {
    const std::lock_guard lock(mutex_);
    start_ = {};
    at_ps_ = 0;
    sequence_ = 0;
    waiting_.clear();
  }

 private:
  // A sender that has fallen behind, as under the thread sanitizer, still sends often: all that is
  // due at once took it longer than the second after which a bridge counts as silent.
  static constexpr std::int64_t blocks_a_call = 20;

  std::mutex mutex_;
  Records records_;
  std::chrono::steady_clock::time_point start_;
  double start_unix_s_ = 0;
  std::int64_t at_ps_ = 0;
  std::int64_t step_ps_ = 0;
  std::uint32_t sequence_ = 0;
  std::uint16_t version_ = 1;
  bool unpaced_ = false;
  std::vector<std::byte> waiting_;
};

// A tag on input 1 every 10 us.
inline constexpr std::int64_t steady_gap_ps = 10'000'000;
inline std::vector<Tags16Record> steady_records(std::int64_t begin_ps, std::int64_t end_ps) {
  std::vector<Tags16Record> records;
  for (std::int64_t at_ps = begin_ps; at_ps < end_ps; at_ps += steady_gap_ps) {
    records.push_back({at_ps, 1, 0, 0});
  }
  return records;
}

}  // namespace splid::test
