#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "drivers/source.hpp"
#include "tests/support/patience.hpp"

namespace splid::test {

// Keeps all tags of a source that runs on another thread, for a test that waits for them.
class SharedSink final : public TagSink {
 public:
  std::span<Tag> claim(std::size_t max_count) override {
    return std::span(room_).first(std::min(max_count, room_.size()));
  }
  void publish(std::size_t count) override {
    const std::lock_guard lock(mutex_);
    tags_.insert(tags_.end(), room_.begin(), room_.begin() + static_cast<std::ptrdiff_t>(count));
    changed_.notify_all();
  }

  // At least `count` tags, or fewer when the test's patience is at its end.
  std::vector<Tag> wait(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, patience, [&] { return tags_.size() >= count; });
    return tags_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Tag> tags_;
  std::vector<Tag> room_ = std::vector<Tag>(1 << 12);
};

// What a source reported, for a test that waits for it.
class ReportList {
 public:
  void add(const DeviceReport& report) {
    const std::lock_guard lock(mutex_);
    reports_.push_back(report);
    changed_.notify_all();
  }
  // Whether a report of that state with `words` in its reason comes.
  bool wait(DeviceState state, const std::string& words) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, patience, [&] {
      return std::any_of(reports_.begin(), reports_.end(), [&](const DeviceReport& report) {
        return report.state == state && report.reason.find(words) != std::string::npos;
      });
    });
  }

  // All that came so far.
  std::vector<DeviceReport> all() {
    const std::lock_guard lock(mutex_);
    return reports_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<DeviceReport> reports_;
};

}  // namespace splid::test
