#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "daemon/stream/frame.hpp"

namespace splid::test {

// Keeps every frame that the framer closes. With reuse, one frame only, as a pool would.
class FrameList final : public FrameSink {
 public:
  explicit FrameList(FrameCapacity capacity = {}, bool reuse = false)
      : capacity_(capacity), reuse_(reuse) {
    if (reuse_) open_ = std::make_unique<Frame>(capacity_);
  }

  Frame& open() override {
    ++opened;
    if (!reuse_) open_ = std::make_unique<Frame>(capacity_);
    return *open_;
  }
  void close() override {
    ++closed;
    if (!reuse_) frames.push_back(std::move(open_));
  }
  const Frame& operator[](std::size_t i) const { return *frames.at(i); }
  [[nodiscard]] std::size_t size() const { return frames.size(); }

  std::vector<std::unique_ptr<Frame>> frames;
  int opened = 0;
  int closed = 0;

 private:
  FrameCapacity capacity_;
  bool reuse_;
  std::unique_ptr<Frame> open_;
};

}  // namespace splid::test
