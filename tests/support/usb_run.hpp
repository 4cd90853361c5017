#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "drivers/source.hpp"
#include "protocol/error.hpp"
#include "tests/support/patience.hpp"
#include "tests/support/scene_runs.hpp"

namespace splid::test {

// Looks again each millisecond; false where it does not come true within 20 s.
inline bool comes_true(const std::function<bool()>& condition) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
  }
  return true;
}

// A source that runs on a thread of its own, and all that it says. Stopped with it.
class SourceRun {
 public:
  explicit SourceRun(const SourceOptions& options, bool keep_photons = true)
      : sink_(*this, keep_photons) {
    context_.pattern = &pattern_;
    context_.report = [this](const DeviceReport& report) {
      const std::lock_guard lock(mutex_);
      reports_.push_back(report);
    };
    source_ = options.open(context_);
    thread_ = std::jthread([this](std::stop_token stop) {
      try {
        source_->run(sink_, std::move(stop));
      } catch (const Error& error) {
        const std::lock_guard lock(mutex_);
        error_ = error;
      }
    });
  }

  void stop() {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
  }

  // What ended it, if anything did.
  [[nodiscard]] std::optional<Error> error() const {
    const std::lock_guard lock(mutex_);
    return error_;
  }
  // The sink takes nothing until this is false again.
  void block(bool blocked) { blocked_ = blocked; }
  // The sink takes each clock_break, and then nothing until block(false).
  void block_after_clock_breaks() { blocks_after_break_ = true; }

  [[nodiscard]] std::vector<Tag> tags() const {
    const std::lock_guard lock(mutex_);
    return tags_;
  }
  [[nodiscard]] std::size_t count(TagKind kind) const {
    const std::lock_guard lock(mutex_);
    return counts_.at(static_cast<std::size_t>(kind));
  }
  [[nodiscard]] std::size_t photons() const { return count(TagKind::photon); }
  // How often the source published tags or nothing.
  [[nodiscard]] std::size_t publishes() const { return publishes_; }
  [[nodiscard]] std::vector<DeviceReport> reports() const {
    const std::lock_guard lock(mutex_);
    return reports_;
  }
  // A report of that state with those words.
  [[nodiscard]] bool said(DeviceState state, const std::string& words) const {
    for (const DeviceReport& report : reports()) {
      if (report.state == state && report.reason.find(words) != std::string::npos) return true;
    }
    return false;
  }
  [[nodiscard]] std::uint64_t counter(const std::string& name,
                                      const std::map<std::string, std::string>& labels = {}) const {
    for (const SourceCounter& each : source_->counters()) {
      if (each.name == name && each.labels == labels) return each.value;
    }
    return ~std::uint64_t{0};
  }

 private:
  class Sink final : public TagSink {
   public:
    Sink(SourceRun& run, bool keep_photons) : run_(run), keep_photons_(keep_photons) {}
    std::span<Tag> claim(std::size_t max_count) override {
      return std::span(room_).first(std::min(max_count, room_.size()));
    }
    void publish(std::size_t count) override {
      ++run_.publishes_;
      while (run_.blocked_) std::this_thread::sleep_for(std::chrono::milliseconds{1});
      const std::lock_guard lock(run_.mutex_);
      for (const Tag& tag : std::span(room_).first(count)) {
        if (run_.blocks_after_break_ && tag.kind == TagKind::clock_break) run_.blocked_ = true;
        ++run_.counts_.at(static_cast<std::size_t>(tag.kind));
        if (keep_photons_ || tag.kind != TagKind::photon) run_.tags_.push_back(tag);
      }
    }

   private:
    SourceRun& run_;
    bool keep_photons_;
    std::vector<Tag> room_ = std::vector<Tag>(1 << 14);
  };

  Pattern pattern_ = paper_pattern();
  SourceContext context_;
  mutable std::mutex mutex_;
  std::vector<Tag> tags_;
  std::array<std::size_t, 8> counts_{};
  std::vector<DeviceReport> reports_;
  std::optional<Error> error_;
  std::atomic<bool> blocked_{false};
  std::atomic<bool> blocks_after_break_{false};
  std::atomic<std::size_t> publishes_{0};
  Sink sink_;
  std::unique_ptr<TagSource> source_;
  std::jthread thread_;
};

}  // namespace splid::test
