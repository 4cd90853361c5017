#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <span>
#include <stop_token>
#include <utility>
#include <vector>

#include "drivers/source.hpp"
#include "protocol/tag.hpp"

namespace splid::test {

// Keeps all tags. Hands out at most max_room at a time, so that a source's handling of small rooms
// shows, and nothing once a stop was requested.
class VectorSink : public TagSink {
 public:
  explicit VectorSink(std::size_t max_room = 1 << 16, std::stop_token stop = {})
      : max_room_(max_room), stop_(std::move(stop)) {}

  std::span<Tag> claim(std::size_t max_count) override {
    if (stop_.stop_requested()) return {};
    const std::size_t count = std::min(max_count, max_room_);
    if (room_.size() < count) room_.resize(count);
    return std::span(room_).first(count);
  }

  void publish(std::size_t count) override {
    tags.insert(tags.end(), room_.begin(), room_.begin() + static_cast<std::ptrdiff_t>(count));
    if (on_publish) on_publish(*this);
  }

  std::vector<Tag> tags;
  std::function<void(VectorSink&)> on_publish;

 private:
  std::size_t max_room_;
  std::stop_token stop_;
  std::vector<Tag> room_;
};

// Counts tags and forgets them.
class CountingSink : public TagSink {
 public:
  std::span<Tag> claim(std::size_t max_count) override {
    return std::span(room_).first(std::min(max_count, room_.size()));
  }
  void publish(std::size_t count) override { tags += count; }

  std::size_t tags = 0;

 private:
  std::vector<Tag> room_ = std::vector<Tag>(1 << 16);
};

}  // namespace splid::test
