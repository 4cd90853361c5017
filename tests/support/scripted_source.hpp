#pragma once

#include <algorithm>
#include <chrono>
#include <span>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include "drivers/source.hpp"
#include "protocol/error.hpp"
#include "protocol/tag.hpp"

namespace splid {

// A source that sends given tags and then ends, fails, or waits to be stopped.
class ScriptedSource final : public TagSource {
 public:
  enum class End { stream, error, until_stopped };

  ScriptedSource(std::vector<Tag> tags, SourceInfo info, End end = End::stream)
      : tags_(std::move(tags)), info_(std::move(info)), end_(end) {}

  // For End::until_stopped: asks for that stop itself once all tags are sent.
  void stop_when_sent(std::stop_source stop) { when_sent_ = std::move(stop); }

  [[nodiscard]] SourceInfo info() const override { return info_; }

  void run(TagSink& sink, std::stop_token stop) override {
    std::span<const Tag> left = tags_;
    while (!left.empty() && !stop.stop_requested()) {
      const std::span<Tag> room = sink.claim(left.size());
      if (room.empty()) return;
      std::copy_n(left.begin(), room.size(), room.begin());
      sink.publish(room.size());
      left = left.subspan(room.size());
    }
    when_sent_.request_stop();
    if (end_ == End::error) throw Error(Fault::device, "scripted source: the cable came off");
    while (end_ == End::until_stopped && !stop.stop_requested()) {
      std::this_thread::sleep_for(std::chrono::milliseconds{1});
    }
  }

 private:
  std::vector<Tag> tags_;
  SourceInfo info_;
  End end_;
  std::stop_source when_sent_{std::nostopstate};
};

}  // namespace splid
