#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace splid::simulator {

// A queue of times that come nearly in order and are handed on in order.
//
// Threads: one. Allocates only where the queue has to hold more times than ever before.
class PendingTimes {
 public:
  static constexpr std::int64_t none = std::numeric_limits<std::int64_t>::max();

  void insert(std::int64_t time_ps) {
    std::size_t place = times_ps_.size();
    times_ps_.push_back(time_ps);
    for (; place > first_ && times_ps_[place - 1] > time_ps; --place) {
      times_ps_[place] = times_ps_[place - 1];
    }
    times_ps_[place] = time_ps;
  }

  // The earliest time, or `none`.
  [[nodiscard]] std::int64_t front() const {
    return first_ < times_ps_.size() ? times_ps_[first_] : none;
  }
  void pop() { ++first_; }

  // Gives the room of popped times back. Must be called now and then.
  void compact() {
    times_ps_.erase(times_ps_.begin(), times_ps_.begin() + static_cast<std::ptrdiff_t>(first_));
    first_ = 0;
  }

 private:
  std::vector<std::int64_t> times_ps_;
  std::size_t first_ = 0;
};

}  // namespace splid::simulator
